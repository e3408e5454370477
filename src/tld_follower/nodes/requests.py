"""Hands what services ask for to the worker thread that owns the state."""

import queue
from concurrent.futures import Future

# How long a service waits for the worker [s of wall-clock time]; one frame takes far less.
PATIENCE = 30.0


class Requests:
    """Jobs that the worker does between frames, so that no frame ever sees half a change.

    Parameters
    ----------
    wake : callable
        Wakes the worker where it waits for work.
    """

    def __init__(self, wake):
        self._wake = wake
        self._jobs = queue.SimpleQueue()

    def ask(self, job):
        """Have the worker call `job()`; return or raise what it does.

        Raises
        ------
        TimeoutError
            If the worker does not come to it in time; then it never will.
        """
        future = Future()
        self._jobs.put((future, job))
        self._wake()
        try:
            return future.result(PATIENCE)
        except TimeoutError:
            if not future.cancel():
                return future.result(PATIENCE)
            raise

    def serve(self):
        """Do all that was asked for so far; called by the worker."""
        while not self._jobs.empty():
            future, job = self._jobs.get()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(job())
            except Exception as error:  # belongs to the one who asked
                future.set_exception(error)
