# SPDX-License-Identifier: BSD-3-Clause
"""The simulation in lockstep from outside: answers every frame with the commands of a scenario's script."""

import threading
import time

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image
from std_srvs.srv import Empty

from tld_follower.evaluation.graph import GraphError, wait_for_edges, world_file
from tld_follower.msg import BoundingBox, FollowState, Truth

# How long one frame may take before the flight is given up; lockstep itself goes on after less.
FRAME_TIMEOUT = 60.0  # s of wall-clock time

# What can be watched: kind -> node, topic, type.
_SOURCES = {
    "truth": ("/gazebo", "/gazebo/truth", Truth),
    "image": ("/gazebo", "/stereo/left/image_raw", Image),
    "box": ("/NODE", "/pointA", BoundingBox),
    "state": ("/pointsdepthA", "/pointsdepthA/state", FollowState),
}


def simulation_arguments(scenario, seed, resolution, image_noise, world=None):
    """Arguments of sim.launch for a `Stage`; `world` is a file, the scenario's own if None."""
    return {
        "mode": "lockstep",
        "lockstep_target": "true",
        "lockstep_timeout": "30",
        "paused": "true",
        "resolution": resolution,
        "image_noise": image_noise,
        "seed": seed,
        "vehicle_pose": _pose(scenario.spiri_pose(seed)),
        "target_pose": _pose(scenario.husky_pose(seed)),
        "world": world.resolve() if world else world_file(scenario.world),
    }


def _pose(values):
    return ",".join(f"{value:.6f}" for value in values)


def _twist(forward, left, turn):
    command = Twist()
    command.linear.x, command.linear.y, command.angular.z = forward, left, turn
    return command


class Stage:
    """Where a scenario is played: a simulation in lockstep that waits for /cmd_vel and /husky/cmd_vel.

    A frame is answered only once every watched message of it is here and has been dealt with, so that every
    run of a seed sees the same commands at the same frames. Where the follower answers as well, `run_ahead`
    does without that wait, and no less surely: the follower's command alone then says that a frame is done.

    Parameters
    ----------
    scenario : Scenario
    seed : int
        Of the scenario's script.
    watched : iterable of str
        What belongs to a frame: any of truth, image, box, state.
    """

    def __init__(self, scenario, seed, watched):
        self._scenario, self._seed = scenario, seed
        self._sources = {kind: _SOURCES[kind] for kind in watched}
        self._frames = {}  # stamp -> {kind: message}
        self._changed = threading.Condition()
        self._ahead = False
        self._drivers = {"/husky/cmd_vel": self._target_command}
        if scenario.scripted:
            self._drivers["/cmd_vel"] = scenario.drone_command
        self._publishers = {
            topic: rospy.Publisher(topic, Twist, queue_size=1, tcp_nodelay=True) for topic in self._drivers
        }
        self._subscribers = [
            rospy.Subscriber(topic, message, self._store, kind, queue_size=10, tcp_nodelay=True)
            for kind, (_, topic, message) in self._sources.items()
        ]

    def close(self):
        """Take this stage's topics off the graph."""
        for topic in [*self._subscribers, *self._publishers.values()]:
            topic.unregister()

    def _target_command(self, t, seed):
        speed, turn = self._scenario.target_command(t, seed)
        return speed, 0.0, turn

    def run_ahead(self):
        """Answer each frame as soon as its truth is here, from the next frame on.

        For scenarios in which the follower flies: the simulation still waits for its command.
        """
        self._ahead = True

    def _answer(self, t):
        for topic, command_at in self._drivers.items():
            self._publishers[topic].publish(_twist(*command_at(t, self._seed)))

    def _store(self, message, kind):
        stamp = message.captured if kind == "box" else message.header.stamp
        if kind == "truth" and self._ahead and stamp.to_sec() < self._scenario.end:
            self._answer(stamp.to_sec())
        with self._changed:
            self._frames.setdefault(stamp, {})[kind] = message
            self._changed.notify_all()

    def wait_until_connected(self, edges=frozenset(), alive=lambda: None):
        """Wait for this stage's edges, and any others given as (publisher, topic, subscriber)."""
        me = rospy.get_name()
        own = {(node, topic, me) for node, topic, _ in self._sources.values()}
        own |= {(me, topic, "/gazebo") for topic in self._publishers}
        wait_for_edges(own | set(edges), alive=alive)

    def frames(self, alive=lambda: None):
        """Start the simulation and yield its frames up to the scenario's end, each answered before the next.

        Parameters
        ----------
        alive : callable
            Called while waiting; raises if the graph has died.

        Yields
        ------
        t : float
            Simulated time, s.
        frame : dict
            kind -> message, all of one stamp.
        """
        rospy.wait_for_service("/gazebo/unpause_physics", timeout=30.0)
        rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
        done = rospy.Time()
        while True:
            done, frame = self._next_frame(done, alive)
            t = done.to_sec()
            answered_ahead = self._ahead
            yield t, frame
            if t >= self._scenario.end:
                return
            if not answered_ahead:
                self._answer(t)

    def _next_frame(self, after, alive):
        """Wait for the next frame that is complete; return its stamp and messages."""
        deadline = time.monotonic() + FRAME_TIMEOUT
        with self._changed:
            while True:
                for stamp in sorted(self._frames):
                    if stamp <= after:
                        del self._frames[stamp]
                    elif len(self._frames[stamp]) == len(self._sources):
                        return stamp, self._frames.pop(stamp)
                self._changed.wait(1.0)
                alive()
                if time.monotonic() > deadline:
                    newest = self._frames[max(self._frames)] if self._frames else {}
                    missing = [topic for kind, (_, topic, _) in self._sources.items() if kind not in newest]
                    raise GraphError(
                        f"no whole frame for {FRAME_TIMEOUT:.0f} s after t = {after.to_sec():.3f} s; "
                        f"missing: {', '.join(missing)}"
                    )
