"""Flies one plan on a running graph in lockstep: drives the target, boxes it, keeps the trace."""

import math
import threading
import time

import rospy
from sensor_msgs.msg import RegionOfInterest

from tld_follower.evaluation.graph import COMMAND_EDGE, FLYING_EDGES, GraphError
from tld_follower.evaluation.stage import FRAME_TIMEOUT, Stage
from tld_follower.nodes.conversions import message_box


def _known(value):
    """Return a number, or None for NaN, which JSON has no word for."""
    return None if math.isnan(value) else value


def _vector(message):
    return [message.x, message.y, message.z]


def _attitude(q):
    """Return roll, pitch and yaw of a quaternion message in rad (REP-103)."""
    return [
        math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x**2 + q.y**2)),
        math.asin(max(-1.0, min(1.0, 2 * (q.w * q.y - q.z * q.x)))),
        math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y**2 + q.z**2)),
    ]


class Flight:
    """A plan on the whole graph: the target is boxed, and every frame from then on is recorded.

    Parameters
    ----------
    plan : Plan
    watchers : sequence of callables
        Called with every frame (messages truth, box, state and image) and its time since the start of the
        drive in s, from the frame on in which the target is boxed.
    """

    def __init__(self, plan, watchers=()):
        self._plan = plan
        self._watchers = watchers
        self._stage = Stage(
            plan, ("truth", "box", "state", "image") if watchers else ("truth", "box", "state")
        )
        self._changed = threading.Condition()
        self._targets = 0
        self._init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1, tcp_nodelay=True)
        self._target = rospy.Subscriber("/NODE/target", RegionOfInterest, self._learnt)

    def close(self):
        """Take this flight's topics off the graph."""
        self._stage.close()
        self._init.unregister()
        self._target.unregister()

    def _learnt(self, _):
        with self._changed:
            self._targets += 1
            self._changed.notify_all()

    def wait_until_connected(self, alive=lambda: None, more=()):
        """Wait for every edge of the graph, those it has `more` by its settings, and this flight's own."""
        me = rospy.get_name()
        edges = set(FLYING_EDGES) | {(me, "/NODE/init", "/NODE"), ("/NODE", "/NODE/target", me), *more}
        if self._plan.scripted:
            edges.remove(COMMAND_EDGE)
        if self._plan.target_robot != "husky":
            edges = {edge for edge in edges if not edge[1].startswith("/husky/")}
        if self._plan.vehicle == "ugv":
            edges = {(a, topic.replace("/spiri/odometry", "/ugv/odometry"), b) for a, topic, b in edges}
        self._stage.wait_until_connected(edges, alive)

    def fly(self, alive=lambda: None):
        """Fly the plan from the simulation's start.

        Parameters
        ----------
        alive : callable
            Called while waiting; raises if the graph has died.

        Returns
        -------
        trace : dict of lists
            One entry a frame after the boxing; see `metrics.flight_figures` and `_record`.
        real_time_factor : float
            Simulated over wall-clock time, of the traced part.
        """
        trace = {}
        boxed_at = None
        for t, frame in self._stage.frames(alive):
            if boxed_at is not None:
                self._record(trace, t - self._plan.start, frame)
            elif t >= self._plan.box_at:
                self._box_target(frame["truth"], alive)
                boxed_at, began = t, time.monotonic()
                if not self._plan.scripted:
                    self._stage.run_ahead()
            else:
                continue
            for watch in self._watchers:
                watch(frame, t - self._plan.start)
        return trace, (t - boxed_at) / (time.monotonic() - began)

    def _box_target(self, truth, alive):
        """Show the tracker the true box of this very frame, and wait until it has learnt it."""
        box = truth.target_box
        if not box.visible:
            raise GraphError("the target is not in view when it should be boxed")
        targets = self._targets
        self._init.publish(
            RegionOfInterest(
                x_offset=round(box.x), y_offset=round(box.y), width=round(box.width), height=round(box.height)
            )
        )
        deadline = time.monotonic() + FRAME_TIMEOUT
        with self._changed:
            while self._targets == targets:
                self._changed.wait(1.0)
                alive()
                if time.monotonic() > deadline:
                    raise GraphError("the tracker did not take the target's box")

    @staticmethod
    def _record(trace, t, frame):
        """Add a frame: truth (m, m/s in world axes), what was found, and what was commanded (yaw frame)."""
        truth, state = frame["truth"], frame["state"]
        true_box, found_box = message_box(truth.target_box), message_box(frame["box"])
        command, drone, target = state.command, truth.drone_pose, truth.target_pose
        estimate = [_known(getattr(state.target_velocity, axis)) for axis in "xyz"]
        entry = {
            "t": round(t, 6),
            "distance": truth.distance,
            "measured_distance": _known(state.distance),
            "nearest_obstacle": _known(state.nearest_obstacle),
            "clearance": truth.clearance,
            "collisions": truth.collisions,
            "drone_position": _vector(drone.position),
            "drone_attitude": _attitude(drone.orientation),
            "drone_velocity": _vector(truth.drone_twist.linear),
            "target_position": _vector(target.position),
            "target_yaw": _attitude(target.orientation)[2],
            "target_velocity": _vector(truth.target_twist.linear),
            "estimated_velocity": None if None in estimate else estimate,
            "command": [*_vector(command.linear), command.angular.z],
            "mode": state.mode,
            "reason": state.reason,
            "in_view": true_box is not None,
            "box_visible": found_box is not None,
            "overlap": true_box.overlap(found_box) if true_box and found_box else 0.0,
        }
        for name, value in entry.items():
            trace.setdefault(name, []).append(value)
