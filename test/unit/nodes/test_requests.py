import threading

import pytest

from tld_follower.nodes import requests
from tld_follower.nodes.newest import Newest
from tld_follower.nodes.requests import Requests


@pytest.fixture
def worker():
    """Requests that a thread serves between items, until it gets None."""
    work = Newest(every=True)
    jobs = Requests(work.wake)
    ended = threading.Event()

    def run():
        while not ended.is_set():
            work.take(timeout=60)
            jobs.serve()

    thread = threading.Thread(target=run)
    thread.start()
    yield jobs
    ended.set()
    work.wake()
    thread.join(60)


def test_the_worker_does_the_job_and_answers(worker):
    me = threading.get_ident()
    assert worker.ask(threading.get_ident) != me
    assert [worker.ask(lambda i=i: 2 * i) for i in range(5)] == [0, 2, 4, 6, 8]


def test_an_error_goes_to_the_one_who_asked(worker):
    with pytest.raises(ValueError, match="no such file"):
        worker.ask(lambda: (_ for _ in ()).throw(ValueError("no such file")))
    assert worker.ask(lambda: "still alive") == "still alive"


def test_a_job_that_nobody_waits_for_any_more_is_never_done(monkeypatch):
    monkeypatch.setattr(requests, "PATIENCE", 0.01)
    jobs, done = Requests(lambda: None), []
    with pytest.raises(TimeoutError):
        jobs.ask(lambda: done.append(1))
    jobs.serve()
    assert not done
