"""Pairs the messages of one topic with those of another by their stamps."""

import threading
import time

import rospy

# ROS time itself may stand still, as when a bag has come to its end [s of wall-clock time].
STANDSTILL = 10.0


class ByStamp:
    """A topic's messages of the last `max_age` seconds, and a wait for the one of a given stamp.

    The wait is in ROS time, so that a simulation in lockstep always gets the pair. After a wait in vain there
    is no other until a message comes: a publisher that has died costs one wait and no more.
    """

    def __init__(self, max_age):
        self._max_age = max_age
        self._changed = threading.Condition()
        self._recent = {}  # stamp -> message, in order of arrival
        self._stamp = rospy.Time()
        self._silent = False

    def put(self, message):
        """Store a message; the callback of the topic."""
        stamp = message.header.stamp
        with self._changed:
            self._recent = {
                at: kept for at, kept in self._recent.items() if 0 < (stamp - at).to_sec() < self._max_age
            }
            self._recent[stamp] = message
            self._silent = False
            self._changed.notify_all()

    def wait(self, stamp, patience, superseded):
        """Return the message of a stamp, or None if it does not come.

        Parameters
        ----------
        stamp : rospy.Time
            One before that of the last call means that time has jumped back: later messages are dropped.
        patience : float
            Seconds of ROS time; at most `STANDSTILL` of wall-clock time.
        superseded : callable
            True when there is newer work, which ends the wait.
        """
        deadline, given_up = rospy.Time.now() + rospy.Duration(patience), time.monotonic() + STANDSTILL
        with self._changed:
            if stamp < self._stamp:
                self._recent = {at: kept for at, kept in self._recent.items() if at <= stamp}
            self._stamp = stamp
            while self._expected(stamp) and not superseded():
                if rospy.Time.now() >= deadline or time.monotonic() >= given_up or rospy.is_shutdown():
                    break
                self._changed.wait(0.02)
            self._silent = stamp not in self._recent and not self._passed(stamp)
            return self._recent.get(stamp)

    @property
    def newest(self):
        """The newest message, None before the first."""
        with self._changed:
            return self._recent[max(self._recent)] if self._recent else None

    def _expected(self, stamp):
        return not (self._silent or stamp in self._recent or self._passed(stamp))

    def _passed(self, stamp):
        """Whether a later message has come: they come in order, so that of this stamp will not."""
        return bool(self._recent) and max(self._recent) > stamp
