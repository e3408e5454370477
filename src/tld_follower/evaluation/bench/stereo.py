# SPDX-License-Identifier: BSD-3-Clause
"""The stereo node against Debian's stereo_image_proc: CPU time a pair, on the same pairs, taking turns."""

import os
import struct
import subprocess
import threading
import time
from contextlib import ExitStack

import roslib.packages
import rospkg
import rospy
import yaml

from tld_follower.evaluation import graph
from tld_follower.evaluation.bench.cpu import Stopwatch
from tld_follower.evaluation.bench.pairs import TOPICS, record

RESOLUTION = "640x480"
ALGORITHMS = {"bm": 0, "sgbm": 1}  # name -> ~stereo_algorithm
OURS, PEER = ("tld_follower", "stereo_cloud"), ("stereo_image_proc", "stereo_image_proc")
_RESULTS = ("disparity", "points2")
_RECORDED = 30  # pairs, shown again and again
_TURN = 30  # pairs that a node is given before it is the other one's turn
_START_TIMEOUT, _PAIR_TIMEOUT = 30.0, 10.0  # s of wall-clock time


def _stamp(buffer):
    """Stamp in ns of a serialised message that begins with a std_msgs/Header (seq, seconds, nanoseconds)."""
    _, seconds, nanoseconds = struct.unpack_from("<III", buffer)
    return seconds * 10**9 + nanoseconds


class Contestant:
    """A stereo node in a namespace of its own, shown pair after pair.

    It runs from the making on; `close` ends it.

    Parameters
    ----------
    executable : str
        Path.
    namespace : str
    parameters : dict
        Private ones of the node.
    log : path
        File for its output.
    """

    def __init__(self, executable, namespace, parameters, log):
        self._changed = threading.Condition()
        self._seen = dict.fromkeys(_RESULTS, 0)  # topic -> newest stamp, ns
        self._namespace = namespace
        rospy.set_param(f"{namespace}/stereo_image_proc", parameters)
        with open(log, "wb") as output:
            self._process = subprocess.Popen(
                [executable, "__name:=stereo_image_proc", f"__ns:={namespace}"],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._log = log
        self._publishers = {
            topic: rospy.Publisher(f"{namespace}/{topic}", kind, queue_size=2, tcp_nodelay=True)
            for topic, kind in TOPICS.items()
        }
        self._subscribers = [
            rospy.Subscriber(f"{namespace}/{topic}", rospy.AnyMsg, self._store, topic, tcp_nodelay=True)
            for topic in _RESULTS
        ]

    def close(self):
        """End the node and take its topics off the graph."""
        for topic in [*self._subscribers, *self._publishers.values()]:
            topic.unregister()
        graph.stop(self._process)

    def _store(self, message, topic):
        with self._changed:
            self._seen[topic] = _stamp(message._buff)
            self._changed.notify_all()

    def _alive(self):
        if self._process.poll() is not None:
            raise graph.GraphError(f"{self._namespace} ended; see {self._log}")

    def wait_until_connected(self, pair):
        """Wait until the node listens to all topics and has answered a pair."""
        deadline = time.monotonic() + _START_TIMEOUT
        while not all(topic.get_num_connections() for topic in self._publishers.values()):
            self._alive()
            if time.monotonic() > deadline:
                raise graph.GraphError(f"{self._namespace} does not subscribe; see {self._log}")
            time.sleep(0.05)
        while not self._show(pair, 1.0):
            self._alive()
            if time.monotonic() > deadline:
                raise graph.GraphError(f"{self._namespace} does not answer; see {self._log}")

    def _show(self, pair, timeout):
        """Publish a pair; return whether all results of it have come in time."""
        stamp = rospy.Time.now()
        for topic, message in pair.items():
            message.header.stamp = stamp
            self._publishers[topic].publish(message)
        with self._changed:
            return self._changed.wait_for(lambda: min(self._seen.values()) >= stamp.to_nsec(), timeout)

    def turn(self, pairs):
        """Show pairs, each once the one before is answered; returns the node's CPU time a pair in ms."""
        stopwatch = Stopwatch({"node": self._process.pid})
        for pair in pairs:
            if not self._show(pair, _PAIR_TIMEOUT):
                self._alive()
                raise graph.GraphError(f"{self._namespace} lost a pair; see {self._log}")
        return stopwatch.ms_per(len(pairs))["node"]


def _executable(package, name):
    """Path of a node, None where it is not installed."""
    try:
        found = roslib.packages.find_node(package, name)
    except (rospkg.ResourceNotFound, roslib.packages.ROSPkgException):
        return None
    return found[0] if found else None


def _parameters():
    path = os.path.join(rospkg.RosPack().get_path("tld_follower"), "config", "stereo.yaml")
    with open(path) as text:
        return yaml.safe_load(text)


def compare(name, pairs, count, logs, tell):
    """Let both nodes take turns over `count` pairs each.

    Parameters
    ----------
    name : str
        bm or sgbm.
    pairs : list of dict
        See `pairs.record`.
    count : int
        Pairs for each node.
    logs : Path
        Folder of the nodes' logs.
    tell : callable
        Takes lines of progress.

    Returns
    -------
    dict
        ours_cpu_ms, peer_cpu_ms, ratio; the last two are None where the peer is not installed.
    """
    parameters = {**_parameters(), "stereo_algorithm": ALGORITHMS[name]}
    executables = {"ours": _executable(*OURS), "peer": _executable(*PEER)}
    if not executables["ours"]:
        raise graph.GraphError("stereo_cloud is not built")
    if not executables["peer"]:
        tell("stereo_image_proc is not installed (apt-get install ros-stereo-image-proc): no comparison")
    totals = {who: 0.0 for who, executable in executables.items() if executable}
    with ExitStack() as stack:
        contestants = {}
        for who in totals:
            namespace, log = f"/{name}_{who}", logs / f"{name}_{who}.log"
            contestants[who] = Contestant(executables[who], namespace, parameters, log)
            stack.callback(contestants[who].close)
        for contestant in contestants.values():
            contestant.wait_until_connected(pairs[0])
        for begin in range(0, count, _TURN):
            shown = [pairs[index % len(pairs)] for index in range(begin, min(begin + _TURN, count))]
            for who, contestant in contestants.items():
                totals[who] += contestant.turn(shown) * len(shown)
            tell(f"stereo, {name}: {begin + len(shown)} of {count} pairs each")
    ours, peer = totals["ours"] / count, totals["peer"] / count if "peer" in totals else None
    return {"ours_cpu_ms": ours, "peer_cpu_ms": peer, "ratio": ours / peer if peer else None}


def measure(count, logs, tell):
    """Compare the nodes with each algorithm; returns the object for the JSON."""
    tell(f"stereo: recording {_RECORDED} pairs")
    pairs = record(_RECORDED, RESOLUTION, logs)
    rospy.set_param("/use_sim_time", False)  # the simulator that set it is gone
    return {name: compare(name, pairs, count, logs, tell) for name in ALGORITHMS}
