"""Hands messages from a callback to a worker thread.

rospy calls back with ever older messages when the callback is slower than the topic (its receive buffer holds
many), so callbacks only store, and the work is done on the newest message.
"""

import threading
from collections import deque


class Newest:
    """A box for the newest message: `put` replaces what nobody took yet.

    With `every` it is a queue instead, for replaying recordings in which each message counts.
    """

    def __init__(self, every=False):
        self._items = deque(maxlen=None if every else 1)
        self._changed = threading.Condition()
        self._woken = False

    def put(self, item):
        """Store an item and wake the taker."""
        with self._changed:
            self._items.append(item)
            self._changed.notify_all()

    def take(self, timeout):
        """Return the next item, or None if there is none within `timeout` seconds of wall-clock time."""
        with self._changed:
            self._changed.wait_for(lambda: self._items or self._woken, timeout)
            self._woken = False
            return self._items.popleft() if self._items else None

    @property
    def waiting(self):
        """Whether an item waits to be taken."""
        return bool(self._items)

    def wake(self):
        """Let the taker return at once, with None if there is no item."""
        with self._changed:
            self._woken = True
            self._changed.notify_all()
