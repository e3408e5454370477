# SPDX-License-Identifier: BSD-3-Clause
"""Stereo pairs recorded from the simulator, for the stereo nodes."""

import queue

import rospy
from sensor_msgs.msg import CameraInfo, Image

from tld_follower.evaluation import graph
from tld_follower.srv import Step

# Of the camera's namespace, in the order in which a driver publishes them.
TOPICS = {
    "left/camera_info": CameraInfo,
    "right/camera_info": CameraInfo,
    "left/image_raw": Image,
    "right/image_raw": Image,
}
_TAKE_OFF = 90  # frames until the drone hovers
_TIMEOUT = 30.0  # s of wall-clock time


def record(count, resolution, logs):
    """Record pairs of the hovering drone, Husky 1 m ahead.

    Parameters
    ----------
    count : int
    resolution : str
        WxH in pixels.
    logs : Path
        Folder of the simulator's log.

    Returns
    -------
    list of dict
        For each pair, topic under /stereo -> message.

    Raises
    ------
    GraphError
        If the simulator does not run or gives no images.
    """
    arguments = {"mode": "fast", "paused": "true", "resolution": resolution, "spiri_pose": "-1.5,0,0"}
    arguments["world"] = graph.world_file("testing_grounds.world")
    inboxes = {topic: queue.Queue() for topic in TOPICS}
    with graph.launched("sim.launch", arguments, logs / "pairs.log") as alive:
        subscribers = [
            rospy.Subscriber(f"/stereo/{topic}", kind, inboxes[topic].put, tcp_nodelay=True)
            for topic, kind in TOPICS.items()
        ]
        try:
            me = rospy.get_name()
            graph.wait_for_edges({("/gazebo", f"/stereo/{topic}", me) for topic in TOPICS}, alive=alive)
            step = rospy.ServiceProxy("/gazebo/step", Step)
            step(frames=_TAKE_OFF)
            pairs = []
            while len(pairs) < count:
                stamp = step(frames=1).stamp
                pairs.append({topic: _of_stamp(inbox, stamp) for topic, inbox in inboxes.items()})
        except queue.Empty as error:
            alive()
            raise graph.GraphError("the simulator gave no images") from error
        except rospy.ServiceException as error:
            raise graph.GraphError(f"the simulator does not step: {error}") from error
        finally:
            for subscriber in subscribers:
                subscriber.unregister()
    return pairs


def _of_stamp(inbox, stamp):
    """Take messages until that of a stamp comes; queue.Empty if it does not."""
    while True:
        message = inbox.get(timeout=_TIMEOUT)
        if message.header.stamp == stamp:
            return message
