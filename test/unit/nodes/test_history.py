import rospy
from nav_msgs.msg import Odometry

from tld_follower.nodes.history import History


def odometry(seconds):
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(seconds)
    return message


def take(history, seconds, superseded=lambda: False):
    taken = history.take(rospy.Time.from_sec(seconds), 0.1, superseded)
    return [round(message.header.stamp.to_sec(), 3) for message in taken]


def filled(*stamps):
    history = History()
    for stamp in stamps:
        history.put(odometry(stamp))
    return history


def test_a_topic_that_is_silent_is_not_waited_for(clock):
    assert take(History(), 100.0) == []


def test_the_last_one_before_the_image_is_enough(clock):
    assert take(filled(99.97, 99.98, 99.99), 99.995) == [99.97, 99.98, 99.99]


def test_each_is_given_once_and_in_order(clock):
    history = filled(99.98, 99.99)
    take(history, 99.99)
    history.put(odometry(100.0))
    assert take(history, 100.0) == [100.0]


def test_one_that_is_due_is_waited_for(clock):
    history = filled(99.97, 99.98)

    def comes():
        if history._newest.to_sec() < 99.989:
            history.put(odometry(99.99))
        return False

    assert take(history, 99.995, comes) == [99.97, 99.98, 99.99]


def test_the_wait_ends_with_patience_and_is_not_repeated(clock):
    history, asked = filled(99.0, 99.01), []

    def tick():
        asked.append(clock[0])
        clock[0] += 0.06
        return False

    assert take(history, 100.0, tick) == [99.0, 99.01]
    assert len(asked) == 2
    take(history, 100.1, tick)
    assert len(asked) == 2


def test_newer_work_ends_the_wait(clock):
    assert take(filled(99.0, 99.01), 100.0, lambda: True) == [99.0, 99.01]


def test_time_that_jumps_back_is_not_waited_for(clock):
    history = filled(99.0, 99.01, 50.0)
    assert take(history, 50.005) == [99.0, 99.01, 50.0]
