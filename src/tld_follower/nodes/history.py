"""Keeps a topic's messages in order until a worker takes those that lead up to a time."""

import threading
import time

import rospy

from tld_follower.nodes.by_stamp import STANDSTILL

_KEPT = 200  # messages; older ones are dropped if nobody takes them


class History:
    """A queue that knows the topic's rate, so that it can tell whether a message before a time is still due.

    In a simulation in lockstep a worker so always gets the same messages with the same image.
    """

    def __init__(self):
        self._changed = threading.Condition()
        self._messages = []
        self._newest = None
        self._period = 0.0
        self._silent = False

    def put(self, message):
        """Store a message; the callback of the topic."""
        stamp = message.header.stamp
        with self._changed:
            if self._newest is not None:
                self._period = max(0.0, (stamp - self._newest).to_sec())
            self._newest = stamp
            self._messages = [*self._messages[-_KEPT:], message]
            self._silent = False
            self._changed.notify_all()

    def take(self, stamp, patience, superseded):
        """Return all messages stored, in order, once the last one before `stamp` is among them.

        Parameters
        ----------
        stamp : rospy.Time
        patience : float
            Seconds of ROS time; at most `STANDSTILL` of wall-clock time. After a wait in vain there is no
            other until a message comes.
        superseded : callable
            True when there is newer work, which ends the wait.
        """
        deadline, given_up = rospy.Time.now() + rospy.Duration(patience), time.monotonic() + STANDSTILL
        with self._changed:
            while self._due(stamp) and not superseded():
                if rospy.Time.now() >= deadline or time.monotonic() >= given_up or rospy.is_shutdown():
                    self._silent = True
                    break
                self._changed.wait(0.02)
            taken, self._messages = self._messages, []
            return taken

    def _due(self, stamp):
        if self._silent or self._newest is None:
            return False
        return (stamp - self._newest).to_sec() > 0.999 * self._period
