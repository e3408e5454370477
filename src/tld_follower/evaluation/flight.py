"""Flies one scenario on a running graph in lockstep: drives the target, boxes it, keeps the trace."""

import math
import threading
import time

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image, RegionOfInterest
from std_srvs.srv import Empty

from tld_follower.evaluation.graph import DEPTH_EDGE, FLYING_EDGES, GraphError, wait_for_edges
from tld_follower.msg import BoundingBox, FollowState, Truth
from tld_follower.nodes.conversions import message_box

# How long one frame may take before the flight is given up; lockstep itself goes on after less.
FRAME_TIMEOUT = 60.0  # s of wall-clock time


def _known(value):
    """Return a number, or None for NaN, which JSON has no word for."""
    return None if math.isnan(value) else value


class Flight:
    """The driver and scorer of a simulation in lockstep that waits for /husky/cmd_vel as well as /cmd_vel.

    It answers every frame once truth, box and follower state (and the image, if watched) of that frame are
    here, so that every run of a seed sees the same commands at the same frames.
    """

    def __init__(self, on_image=None):
        self._on_image = on_image
        self._topics = {"truth": "/gazebo/truth", "box": "/pointA", "state": "/pointsdepthA/state"}
        types = {"truth": Truth, "box": BoundingBox, "state": FollowState, "image": Image}
        if on_image:
            self._topics["image"] = "/stereo/left/image_raw"
        self._frames = {}  # stamp -> {kind: message}
        self._changed = threading.Condition()
        self._targets = 0
        self._drive = rospy.Publisher("/husky/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1, tcp_nodelay=True)
        self._subscribers = [
            rospy.Subscriber(topic, types[kind], self._store, kind, queue_size=10, tcp_nodelay=True)
            for kind, topic in self._topics.items()
        ]
        self._subscribers.append(rospy.Subscriber("/NODE/target", RegionOfInterest, self._learnt))

    def close(self):
        """Take this flight's topics off the graph."""
        for topic in [*self._subscribers, self._drive, self._init]:
            topic.unregister()

    def _store(self, message, kind):
        stamp = message.captured if kind == "box" else message.header.stamp
        with self._changed:
            self._frames.setdefault(stamp, {})[kind] = message
            self._changed.notify_all()

    def _learnt(self, _):
        with self._changed:
            self._targets += 1
            self._changed.notify_all()

    def wait_until_connected(self, alive=lambda: None, use_depth=False):
        """Wait for every edge of the graph, the tracker's clouds with `use_depth`, and this flight's own."""
        me = rospy.get_name()
        sources = {"truth": "/gazebo", "box": "/NODE", "state": "/pointsdepthA", "image": "/gazebo"}
        own = {(sources[kind], topic, me) for kind, topic in self._topics.items()}
        own |= {(me, "/husky/cmd_vel", "/gazebo"), (me, "/NODE/init", "/NODE"), ("/NODE", "/NODE/target", me)}
        if use_depth:
            own.add(DEPTH_EDGE)
        wait_for_edges(FLYING_EDGES | own, alive=alive)

    def fly(self, scenario, alive=lambda: None):
        """Fly a scenario from the simulation's start.

        Parameters
        ----------
        scenario : Scenario
        alive : callable
            Called while waiting; raises if the graph has died.

        Returns
        -------
        trace : dict of lists
            One entry a frame from the boxing on; see `metrics.flight_figures` and `_record`.
        real_time_factor : float
            Simulated over wall-clock time, of the traced part.
        """
        rospy.wait_for_service("/gazebo/unpause_physics", timeout=30.0)
        rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
        trace = {}
        boxed_at = None
        done = rospy.Time()
        while True:
            stamp, frame = self._next_frame(done, alive)
            done = stamp
            t = stamp.to_sec()
            if boxed_at is None and t >= scenario.box_at:
                self._box_target(frame["truth"], alive)
                boxed_at, began = t, time.monotonic()
            elif boxed_at is not None:
                self._record(trace, t - scenario.start, frame)
                if self._on_image:
                    self._on_image(frame, t - scenario.start)
            if t >= scenario.end:
                return trace, (t - boxed_at) / (time.monotonic() - began)
            command = Twist()
            command.linear.x, command.angular.z = scenario.target_command(t)
            self._drive.publish(command)

    def _next_frame(self, after, alive):
        """Wait for the next frame that is complete; return its stamp and messages."""
        deadline = time.monotonic() + FRAME_TIMEOUT
        with self._changed:
            while True:
                for stamp in sorted(self._frames):
                    if stamp <= after:
                        del self._frames[stamp]
                    elif len(self._frames[stamp]) == len(self._topics):
                        return stamp, self._frames.pop(stamp)
                self._changed.wait(1.0)
                alive()
                if time.monotonic() > deadline:
                    newest = self._frames[max(self._frames)] if self._frames else {}
                    missing = [topic for kind, topic in self._topics.items() if kind not in newest]
                    raise GraphError(
                        f"no whole frame for {FRAME_TIMEOUT:.0f} s after t = {after.to_sec():.3f} s; "
                        f"missing: {', '.join(missing)}"
                    )

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
