"""/stamp: gives every box of /pointA the header that pairs it with the cloud of its image."""

import rospy

from tld_follower.msg import BoundingBox, BoundingBoxStamped
from tld_follower.nodes.settings import checked, fatal_if_wrong


class StampNode:
    """Stamps with the box's own `captured`; with the time now where that is zero."""

    def __init__(self):
        self._frame = checked(rospy.get_param("~frame_id", "stereo_left_optical_frame"), "frame_id", str)
        self._publisher = rospy.Publisher("/pointstampA", BoundingBoxStamped, queue_size=10)
        rospy.Subscriber("/pointA", BoundingBox, self._stamp, tcp_nodelay=True)

    def _stamp(self, box):
        message = BoundingBoxStamped(box=box)
        message.header.frame_id = self._frame
        message.header.stamp = box.captured if box.captured else rospy.Time.now()
        self._publisher.publish(message)


def main():
    """Run the node until ROS shuts down."""
    rospy.init_node("stamp")
    with fatal_if_wrong():
        StampNode()
    rospy.spin()
