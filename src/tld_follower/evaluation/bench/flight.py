# SPDX-License-Identifier: BSD-3-Clause
"""The whole graph in real time: does it keep up, how late are its commands, what does each node cost."""

import queue
import time

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, RegionOfInterest

from tld_follower.evaluation import graph
from tld_follower.evaluation.bench.cpu import Stopwatch, node_pids
from tld_follower.evaluation.scenarios import straight
from tld_follower.msg import FollowState, Truth

RESOLUTION, RATE = "640x480", 30.0
NODES = ("/gazebo", "/NODE", "/stamp", "/stereo/stereo_image_proc", "/pointsdepthA", "/teleop_twist_keyboard")
NODES += ("/husky/robot_state_publisher",)
FRAMES = 300  # that count at most: the target drives straight, and its lane ends
_BOX_AT = 4.0  # s of simulated time: the drone hovers
_UNDER_WAY = 60  # frames from the target's start to the first one that counts
_SPEED = 1.0  # of the target, m/s
_TIMEOUT = 30.0  # s of wall-clock time for one message


class Observer:
    """When the graph's messages arrive here, by the wall clock, and a drive for the target.

    The clock of a frame is published before the frame is drawn, camera_info with the images, the follower's
    state right after its command.
    """

    def __init__(self):
        self.begun = {}  # stamp of any tick -> arrival of its /clock
        self.frames = {}  # stamp -> arrival of its camera_info
        self.answers = {}  # stamp -> arrival of the follower's state
        self.followed = set()  # stamps of the frames in which the target was followed
        self._new_frame = queue.SimpleQueue()
        self._drive = rospy.Publisher("/husky/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._command = Twist()
        self._topics = [
            self._drive,
            rospy.Subscriber("/clock", Clock, self._on_clock, tcp_nodelay=True),
            rospy.Subscriber("/stereo/left/camera_info", CameraInfo, self._on_frame, tcp_nodelay=True),
            rospy.Subscriber("/pointsdepthA/state", FollowState, self._on_state, tcp_nodelay=True),
        ]

    def close(self):
        """Take the topics off the graph."""
        for topic in self._topics:
            topic.unregister()

    def edges(self):
        """Return the edges that this observer needs."""
        me = rospy.get_name()
        return {
            ("/gazebo", "/clock", me),
            ("/gazebo", "/stereo/left/camera_info", me),
            ("/pointsdepthA", "/pointsdepthA/state", me),
            (me, "/husky/cmd_vel", "/gazebo"),
        }

    def _on_clock(self, message):
        self.begun[message.clock] = time.monotonic()

    def _on_frame(self, message):
        self.frames[message.header.stamp] = time.monotonic()
        self._drive.publish(self._command)  # Husky stops without a command for a quarter of a second
        self._new_frame.put(message.header.stamp)

    def _on_state(self, message):
        self.answers[message.header.stamp] = time.monotonic()
        if message.mode == FollowState.FOLLOWING:
            self.followed.add(message.header.stamp)

    def next_frame(self):
        """Wait for the next frame's images; returns its stamp."""
        return self._new_frame.get(timeout=_TIMEOUT)

    def drive(self):
        """Have the target drive, from the next frame on."""
        self._command = Twist()
        self._command.linear.x = _SPEED


def figures(frames, answers, begun):
    """Figures of frames that were all published in real time.

    Parameters
    ----------
    frames : list of (float, float)
        Simulated time of each frame and the wall-clock time of its images' arrival, s, in order.
    answers, begun : dict
        Simulated time -> wall-clock time of the answer, where there is one, and of the moment itself, s.

    Returns
    -------
    dict
        real_time_factor, skipped_frames (those without an answer), latency_ms (p50 and p99; None without any
        answer).
    """
    (first, first_arrival), (last, last_arrival) = frames[0], frames[-1]
    latencies = [1e3 * (answers[t] - begun[t]) for t, _ in frames if t in answers and t in begun]
    p50, p99 = map(float, np.percentile(latencies, (50, 99))) if latencies else (None, None)
    return {
        "real_time_factor": (last - first) / (last_arrival - first_arrival),
        "skipped_frames": sum(t not in answers for t, _ in frames),
        "latency_ms": {"p50": p50, "p99": p99},
    }


def _box_target(alive):
    """Show the tracker the resting target's true box, and wait until it has learnt it."""
    init = rospy.Publisher("/NODE/init", RegionOfInterest, queue_size=1, latch=True)
    try:
        box = rospy.wait_for_message("/gazebo/truth", Truth, _TIMEOUT).target_box
        if not box.visible:
            raise graph.GraphError("the target is not in view when it should be boxed")
        region = RegionOfInterest(x_offset=round(box.x), y_offset=round(box.y))
        region.width, region.height = round(box.width), round(box.height)
        init.publish(region)
        rospy.wait_for_message("/NODE/target", RegionOfInterest, _TIMEOUT)
    finally:
        init.unregister()
        alive()


def measure(tracker, count, logs, tell):
    """Fly behind the driving target in real time.

    Parameters
    ----------
    tracker : str
        tld or tld_sift.
    count : int
        Frames that count, at most `FRAMES`.
    logs : Path
        Folder of the graph's log.
    tell : callable
        Takes lines of progress.

    Returns
    -------
    dict
        The object for the JSON, see doc/bench.md.

    Raises
    ------
    GraphError
        If the graph does not run.
    """
    count = min(count, FRAMES)
    arguments = {
        "mode": "realtime",
        "resolution": RESOLUTION,
        "max_speed": 1.5,
        "tracker": tracker,
        "vehicle_pose": ",".join(map(str, straight(0).drone)),
    }
    tell(f"graph: {count} frames in real time")
    observer = Observer()
    try:
        with graph.launched("follow.launch", arguments, logs / "flight.log") as alive:
            graph.wait_for_edges(graph.FLYING_EDGES | observer.edges(), alive=alive)
            while observer.next_frame().to_sec() < _BOX_AT:
                pass
            _box_target(alive)
            observer.drive()
            for _ in range(_UNDER_WAY):
                observer.next_frame()
            stopwatch = Stopwatch(node_pids(NODES))
            stamps = [observer.next_frame() for _ in range(count)]
            cpu = stopwatch.ms_per(count)
            time.sleep(1.0)  # for the last answers
            alive()
    except (queue.Empty, rospy.ROSException) as error:
        raise graph.GraphError(f"the graph stands still: {error}") from error
    finally:
        observer.close()
    times = {stamp: stamp.to_sec() for stamp in stamps}
    return {
        "resolution": RESOLUTION,
        "rate_hz": RATE,
        "frames": count,
        "followed_frames": sum(stamp in observer.followed for stamp in stamps),
        **figures(
            [(times[stamp], observer.frames[stamp]) for stamp in stamps],
            {times[stamp]: observer.answers[stamp] for stamp in stamps if stamp in observer.answers},
            {times[stamp]: observer.begun[stamp] for stamp in stamps if stamp in observer.begun},
        ),
        "cpu_ms_per_frame": cpu,
    }
