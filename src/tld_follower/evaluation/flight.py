"""Flies one scenario on a running graph in lockstep: drives the target, boxes it, keeps the trace."""

import math
import threading
import time

import rospy
from sensor_msgs.msg import RegionOfInterest

from tld_follower.evaluation.graph import COMMAND_EDGE, DEPTH_EDGE, FLYING_EDGES, GraphError
from tld_follower.evaluation.stage import FRAME_TIMEOUT, Stage
from tld_follower.nodes.conversions import message_box


def _known(value):
    """Return a number, or None for NaN, which JSON has no word for."""
    return None if math.isnan(value) else value


class Flight:
    """A scenario on the whole graph: the target is boxed, and every frame from then on is recorded.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    watchers : sequence of callables
        Called with every frame (messages truth, box, state and image) and its time since the start of the
        drive in s, from the frame on in which the target is boxed.
    """

    def __init__(self, scenario, seed, watchers=()):
        self._scenario = scenario
        self._watchers = watchers
        self._stage = Stage(
            scenario, seed, ("truth", "box", "state", "image") if watchers else ("truth", "box", "state")
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

    def wait_until_connected(self, alive=lambda: None, use_depth=False):
        """Wait for every edge of the graph, the tracker's clouds with `use_depth`, and this flight's own."""
        me = rospy.get_name()
        edges = FLYING_EDGES - {COMMAND_EDGE} if self._scenario.scripted else FLYING_EDGES
        edges |= {(me, "/NODE/init", "/NODE"), ("/NODE", "/NODE/target", me)}
        self._stage.wait_until_connected(edges | {DEPTH_EDGE} if use_depth else edges, alive)

    def fly(self, alive=lambda: None):
        """Fly the scenario from the simulation's start.

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
                self._record(trace, t - self._scenario.start, frame)
            elif t >= self._scenario.box_at:
                self._box_target(frame["truth"], alive)
                boxed_at, began = t, time.monotonic()
                if not self._scenario.scripted:
                    self._stage.run_ahead()
            else:
                continue
            for watch in self._watchers:
                watch(frame, t - self._scenario.start)
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
        command, drone, target = state.command, truth.drone_twist.linear, truth.target_twist.linear
        entry = {
            "t": round(t, 6),
            "distance": truth.distance,
            "measured_distance": _known(state.distance),
            "nearest_obstacle": _known(state.nearest_obstacle),
            "clearance": truth.clearance,
            "collisions": truth.collisions,
            "drone_position": [getattr(truth.drone_pose.position, axis) for axis in "xyz"],
            "drone_velocity": [drone.x, drone.y, drone.z],
            "target_velocity": [target.x, target.y, target.z],
            "command": [command.linear.x, command.linear.y, command.linear.z, command.angular.z],
            "mode": state.mode,
            "in_view": true_box is not None,
            "box_visible": found_box is not None,
            "overlap": true_box.overlap(found_box) if true_box and found_box else 0.0,
        }
        for name, value in entry.items():
            trace.setdefault(name, []).append(value)
