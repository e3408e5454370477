import threading

from tld_follower.nodes.newest import Newest


def test_only_the_newest_is_kept():
    box = Newest()
    box.put(1)
    box.put(2)
    assert box.waiting
    assert box.take(0) == 2
    assert box.take(0) is None


def test_every_item_in_order():
    box = Newest(every=True)
    for i in range(5):
        box.put(i)
    assert [box.take(0) for _ in range(6)] == [0, 1, 2, 3, 4, None]


def test_wake_and_put_end_the_wait():
    box = Newest()
    for act, expected in ((box.wake, None), (lambda: box.put(7), 7)):
        timer = threading.Timer(0.05, act)
        timer.start()
        assert box.take(timeout=60) == expected
        timer.join()


def test_wake_does_not_lose_an_item():
    box = Newest()
    box.put(1)
    box.wake()
    assert box.take(0) == 1
