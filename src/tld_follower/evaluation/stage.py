# SPDX-License-Identifier: BSD-3-Clause
"""The simulation in lockstep from outside: answers every frame with the commands of a plan."""

import threading
import time

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Image
from std_srvs.srv import Empty

from tld_follower.evaluation.graph import GraphError, wait_for_edges, world_file
from tld_follower.evaluation.worlds import write_world
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


# Who takes the target's commands, and the topic of a drone that a script flies.
_DRIVE_TOPIC = {"husky": "/husky/cmd_vel", "target": "/target/cmd_vel"}
_FLY_TOPIC = "/cmd_vel"


def simulation_arguments(plan, seed, resolution, image_noise, folder, world=None):
    """Arguments of sim.launch for a `Stage`.

    Parameters
    ----------
    plan : Plan
    seed : int
        Of all noise.
    resolution : str
        WxH in pixels.
    image_noise : float
        Standard deviation in grey levels.
    folder : Path
        Gets the world of the flight, SCENARIO-SEED.world.
    world : path or None
        The base world; the plan's own if None.

    Raises
    ------
    WorldError
        If the base world does not have the plan's robots.
    """
    file = folder.resolve() / f"{plan.scenario}-{seed}.world"
    write_world(plan, world or world_file(plan.world), file)
    return {
        "mode": "lockstep",
        "lockstep_target": "true",
        "lockstep_timeout": "30",
        "paused": "true",
        "resolution": resolution,
        "image_noise": image_noise,
        "seed": seed,
        "world": file,
    }


def _twist(forward, left, up, turn):
    command = Twist()
    command.linear.x, command.linear.y, command.linear.z = forward, left, up
    command.angular.z = turn
    return command


class Stage:
    """Where a plan is played: a simulation in lockstep that waits for the drone's and the target's commands.

    A frame is answered only once every watched message of it is here and has been dealt with, so that every
    run of a seed sees the same commands at the same frames. Where the follower answers as well, `run_ahead`
    does without that wait, and no less surely: the follower's command alone then says that a frame is done.

    Parameters
    ----------
    plan : Plan
    watched : iterable of str
        What belongs to a frame: any of truth, image, box, state.
    """

    def __init__(self, plan, watched):
        self._plan = plan
        self._sources = {kind: _SOURCES[kind] for kind in watched}
        self._frames = {}  # stamp -> {kind: message}
        self._changed = threading.Condition()
        self._ahead = False
        self._drivers = {_DRIVE_TOPIC[plan.target_robot]: plan.target_command}
        if plan.scripted:
            self._drivers[_FLY_TOPIC] = plan.drone_command
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

    def run_ahead(self):
        """Answer each frame as soon as its truth is here, from the next frame on.

        For plans in which the follower flies: the simulation still waits for its command.
        """
        self._ahead = True

    def _answer(self, t):
        for topic, command_at in self._drivers.items():
            self._publishers[topic].publish(_twist(*command_at(t)))

    def _store(self, message, kind):
        stamp = message.captured if kind == "box" else message.header.stamp
        if kind == "truth" and self._ahead and stamp.to_sec() < self._plan.end:
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
        """Start the simulation and yield its frames up to the plan's end, each answered before the next.

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
            if t >= self._plan.end:
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
