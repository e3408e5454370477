"""/pointsdepthA: one velocity command for every box, from the box and the cloud of the same image."""

import math

import rospy
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2

from tld_follower.following import local_map
from tld_follower.following.follower import Follower
from tld_follower.following.parameters import Parameters
from tld_follower.msg import BoundingBoxStamped, FollowState
from tld_follower.nodes.by_stamp import ByStamp
from tld_follower.nodes.conversions import cloud_points, message_box
from tld_follower.nodes.history import History
from tld_follower.nodes.memory import keep_memory
from tld_follower.nodes.newest import Newest
from tld_follower.nodes.settings import fatal_if_wrong


def twist(command):
    """Make the Twist of a `Command`."""
    message = Twist(linear=Vector3(command.x, command.y, command.z))
    message.angular.z = command.yaw
    return message


class FollowerNode:
    """Pairs boxes with clouds by stamp and publishes what the `Follower` decides.

    A box waits for its cloud, in ROS time, so that a simulation in lockstep always gets the pair.
    """

    def __init__(self):
        self._parameters = Parameters.from_dict(rospy.get_param("~", {}))
        if self._parameters.control == "predictive":
            local_map.warm_up()
        self._follower = Follower(self._parameters)
        self._odometry = History()
        self._boxes = Newest()
        self._clouds = ByStamp(self._parameters.max_age)
        self._stamp = rospy.Time()
        self._mode = None
        self._starved = False

        self._command = rospy.Publisher("/cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        self._state = rospy.Publisher("~state", FollowState, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber("/stereo/points2", PointCloud2, self._clouds.put, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("odometry", Odometry, self._odometry.put, queue_size=50, tcp_nodelay=True)
        rospy.Subscriber("/pointstampA", BoundingBoxStamped, self._boxes.put, queue_size=1, tcp_nodelay=True)

    def run(self):
        """Process boxes until ROS shuts down; the drone then hovers by its own command timeout."""
        while not rospy.is_shutdown():
            message = self._boxes.take(timeout=0.1)
            if message is not None:
                self._process(message)
            self._watch()

    def _watch(self):
        """Say so when boxes stop coming, and when they come again."""
        starved = bool(self._stamp) and (rospy.Time.now() - self._stamp).to_sec() > self._parameters.max_age
        if starved != self._starved:
            self._starved = starved
            if starved:
                rospy.logwarn("no boxes on /pointstampA any more: the drone hovers by its command timeout")
            else:
                rospy.loginfo("boxes are coming again")

    def _process(self, message):
        stamp = message.header.stamp
        if stamp < self._stamp:
            rospy.logwarn("time jumped back by %.3f s; starting afresh", (self._stamp - stamp).to_sec())
            self._follower = Follower(self._parameters)
        self._stamp = stamp
        cloud = self._clouds.wait(stamp, self._parameters.cloud_wait, lambda: self._boxes.waiting)
        cloud = cloud or self._clouds.newest
        points, cloud_stamp = None, -math.inf
        if cloud is not None:
            points, cloud_stamp = self._points(cloud), cloud.header.stamp.to_sec()
        for odometry in self._odometry.take(stamp, self._parameters.cloud_wait, lambda: self._boxes.waiting):
            self._add_odometry(odometry)
        try:
            box = message_box(message.box)
        except ValueError as error:
            rospy.logerr_throttle_identical(5.0, f"box ignored: {error}")
            box = None
        # The clock's message may be handled after the image's, though it was sent before.
        now = max(rospy.Time.now(), stamp).to_sec()
        state = self._follower.update(box, message.box.target, stamp.to_sec(), now, points, cloud_stamp)
        self._publish(message.header, state)

    def _add_odometry(self, message):
        pose, velocity = message.pose.pose, message.twist.twist.linear
        place, turn = pose.position, pose.orientation
        try:
            self._follower.add_odometry(
                message.header.stamp.to_sec(),
                (place.x, place.y, place.z),
                (turn.x, turn.y, turn.z, turn.w),
                (velocity.x, velocity.y, velocity.z),
            )
        except ValueError as error:
            rospy.logerr_throttle_identical(5.0, f"odometry ignored: {error}")

    def _points(self, cloud):
        try:
            points = cloud_points(cloud)
            height, width = points.shape[:2]
            if (width, height) != (self._parameters.image_width, self._parameters.image_height):
                raise ValueError(
                    f"cloud of {width}x{height} points for images of "
                    f"{self._parameters.image_width}x{self._parameters.image_height} pixels"
                )
        except ValueError as error:
            rospy.logerr_throttle_identical(5.0, f"cloud ignored: {error}")
            return None
        return points

    def _publish(self, header, state):
        if state.mode != self._mode:
            self._mode = state.mode
            rospy.loginfo("%s: %s", state.mode.name, state.reason)
        command = twist(state.command)
        self._command.publish(command)
        self._state.publish(
            FollowState(
                header=header,
                mode=state.mode,
                reason=state.reason,
                distance=state.distance,
                nearest_obstacle=state.nearest_obstacle,
                target_velocity=Vector3(*state.target_velocity),
                command=command,
            )
        )


def main():
    """Run the node until ROS shuts down."""
    keep_memory()
    rospy.init_node("pointsdepthA")
    with fatal_if_wrong():
        node = FollowerNode()
    node.run()
