"""The ROS graph from outside: start it on a master of its own, see its edges, wait until it is connected."""

import ctypes
import os
import signal
import socket
import subprocess
import time
import xmlrpc.client
from contextlib import contextmanager

import rosgraph
import rospkg

_CALLER = "/graph_watcher"
_ANSWER_TIMEOUT = 5.0  # s, of a node that hangs
_PR_SET_PDEATHSIG = 1  # prctl(2)
_CAMERAS = [f"/stereo/{side}/{topic}" for side in ("left", "right") for topic in ("image_raw", "camera_info")]

# Who talks to whom in follow.launch: (publisher, topic, subscriber).
FLYING_EDGES = frozenset(
    {
        ("/gazebo", "/stereo/left/image_raw", "/NODE"),
        ("/NODE", "/pointA", "/stamp"),
        ("/stamp", "/pointstampA", "/pointsdepthA"),
        ("/stereo/stereo_image_proc", "/stereo/points2", "/pointsdepthA"),
        ("/gazebo", "/spiri/odometry", "/pointsdepthA"),
        ("/pointsdepthA", "/cmd_vel", "/gazebo"),
        ("/teleop_twist_keyboard", "/husky/cmd_vel", "/gazebo"),
        ("/gazebo", "/husky/joint_states", "/husky/robot_state_publisher"),
    }
    | {("/gazebo", topic, "/stereo/stereo_image_proc") for topic in _CAMERAS}
)
# The one that a scenario does without when a script flies the drone.
COMMAND_EDGE = ("/pointsdepthA", "/cmd_vel", "/gazebo")
# The ones more with use_depth and with use_right_camera.
DEPTH_EDGE = ("/stereo/stereo_image_proc", "/stereo/points2", "/NODE")
RIGHT_EDGE = ("/gazebo", "/stereo/right/image_raw", "/NODE")


class GraphError(RuntimeError):
    """The graph did not start, lost a node or stands still."""


class _Transport(xmlrpc.client.Transport):
    """Gives up on a node that does not answer."""

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = _ANSWER_TIMEOUT
        return connection


def edges():
    """Return the connections that are up, a set of (publisher, topic, subscriber)."""
    publishers, subscribers, _ = rosgraph.Master(_CALLER).getSystemState()
    nodes = {node for _, names in [*publishers, *subscribers] for node in names}
    found = set()
    for node in sorted(nodes):
        try:
            uri = rosgraph.Master(_CALLER).lookupNode(node)
            links = xmlrpc.client.ServerProxy(uri, transport=_Transport()).getBusInfo(_CALLER)[2]
        except (rosgraph.MasterException, OSError, xmlrpc.client.Error):
            continue  # it is starting or has died
        found |= {
            (node, topic, peer)
            for _, peer, direction, _, topic, connected, *_ in links
            if direction == "o" and connected
        }
    return found


def wait_for_edges(wanted, timeout=60.0, alive=lambda: None):
    """Wait until all wanted edges are up.

    Parameters
    ----------
    wanted : iterable of (publisher, topic, subscriber)
    timeout : float
        Seconds of wall-clock time; then GraphError names the missing edges.
    alive : callable
        Called each round; raises if there is no use in waiting.
    """
    deadline = time.monotonic() + timeout
    while True:
        missing = set(wanted) - edges()
        if not missing:
            return
        alive()
        if time.monotonic() > deadline:
            listed = "; ".join(f"{source} -[{topic}]-> {sink}" for source, topic, sink in sorted(missing))
            raise GraphError(f"not connected after {timeout:.0f} s: {listed}")
        time.sleep(0.1)


def world_file(name):
    """Path of a world of this package."""
    return os.path.join(rospkg.RosPack().get_path("tld_follower"), "worlds", name)


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def stop(process, patience=20.0):
    """End a process group as Ctrl-C would, and by force if it does not listen."""
    for number, wait in ((signal.SIGINT, patience), (signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0)):
        if process.poll() is not None:
            return
        os.killpg(process.pid, number)
        try:
            process.wait(wait)
        except subprocess.TimeoutExpired:
            continue


def _die_with_parent():
    """Have the kernel interrupt this process when its parent ends, however it ends."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)


def _start(command, output):
    """Start a command in a process group of its own, all its output in a file."""
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        preexec_fn=_die_with_parent,
    )


@contextmanager
def private_master(log_directory):
    """Run a master on a free port, for this process and those it starts; the user's own one is left alone."""
    environment = {
        "ROS_MASTER_URI": f"http://127.0.0.1:{_free_port()}",
        "ROS_IP": "127.0.0.1",
        "ROS_LOG_DIR": str(log_directory),
    }
    foreign = ("ROS_HOSTNAME", "ROS_NAMESPACE")
    before = {name: os.environ.get(name) for name in (*environment, *foreign)}
    for name in foreign:
        os.environ.pop(name, None)
    os.environ.update(environment)
    port = environment["ROS_MASTER_URI"].rsplit(":", 1)[1]
    with open(os.path.join(log_directory, "roscore.log"), "wb") as log:
        core = _start(["roscore", "-p", port], log)
    try:
        deadline = time.monotonic() + 30
        while "/rosout" not in _registered():
            if core.poll() is not None or time.monotonic() > deadline:
                raise GraphError(f"roscore did not start; see {log.name}")
            time.sleep(0.05)
        yield
    finally:
        stop(core)
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _registered():
    try:
        return {name for _, nodes in rosgraph.Master(_CALLER).getSystemState()[1] for name in nodes}
    except (OSError, rosgraph.MasterException):
        return set()


@contextmanager
def launched(launch_file, arguments, log):
    """Run a launch file of this package; yields a function that raises GraphError once a node has died.

    Parameters
    ----------
    launch_file : str
        Name of the file in the package's launch folder.
    arguments : dict
        Arguments of the launch file.
    log : path
        File for all output.
    """
    words = [f"{name}:={value}" for name, value in arguments.items()]
    with open(log, "wb") as output:
        process = _start(["roslaunch", "tld_follower", launch_file, *words], output)

    def alive():
        with open(log, errors="replace") as text:
            lines = text.readlines()
        died = [line for line in lines if "has died" in line]
        if died or process.poll() is not None:
            faults = [line for line in lines if "FATAL" in line or "ERROR" in line or "Error" in line]
            shown = "".join([*faults[:5], *died[:1]] or lines[-10:])
            raise GraphError(f"{launch_file} lost a node or ended early; {log} says:\n{shown}")

    try:
        yield alive
    finally:
        stop(process)
