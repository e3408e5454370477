import threading

import rospy
from sensor_msgs.msg import PointCloud2

from tld_follower.nodes import by_stamp
from tld_follower.nodes.by_stamp import ByStamp


def cloud(seconds):
    message = PointCloud2()
    message.header.stamp = rospy.Time.from_sec(seconds)
    return message


def wait(clouds, seconds, superseded=lambda: False):
    return clouds.wait(rospy.Time.from_sec(seconds), 0.1, superseded)


class Ticking:
    """A `superseded` that lets ROS time pass whenever it is asked, and counts the questions."""

    def __init__(self, clock):
        self.clock, self.asked = clock, 0

    def __call__(self):
        self.asked += 1
        self.clock[0] += 0.06
        return False


def test_the_cloud_of_a_stamp_and_no_other(clock):
    clouds = ByStamp(max_age=0.5)
    clouds.put(cloud(99.9))
    clouds.put(cloud(100.0))
    assert wait(clouds, 99.9).header.stamp.to_sec() == 99.9
    assert wait(clouds, 100.0).header.stamp.to_sec() == 100.0
    assert clouds.newest.header.stamp.to_sec() == 100.0


def test_a_cloud_that_comes_later_is_waited_for_while_time_stands_still(clock):
    clouds = ByStamp(max_age=0.5)
    coming = threading.Timer(0.2, clouds.put, [cloud(100.0)])
    coming.start()
    assert wait(clouds, 100.0) is not None
    coming.join()


def test_a_wait_ends_in_ros_time_and_is_not_repeated_before_a_cloud_comes(clock):
    clouds, asking = ByStamp(max_age=0.5), Ticking(clock)
    assert wait(clouds, 100.0, asking) is None
    assert asking.asked == 2
    assert wait(clouds, 100.3, asking) is None
    assert asking.asked == 2
    clouds.put(cloud(100.3))
    assert wait(clouds, 100.4, asking) is None
    assert asking.asked > 2


def test_newer_work_ends_a_wait(clock):
    assert wait(ByStamp(max_age=0.5), 100.0, lambda: True) is None


def test_a_cloud_that_was_passed_over_is_not_waited_for(clock):
    clouds, asking = ByStamp(max_age=0.5), Ticking(clock)
    clouds.put(cloud(100.1))
    assert wait(clouds, 100.0, asking) is None
    assert asking.asked == 0


def test_old_clouds_are_forgotten(clock):
    clouds = ByStamp(max_age=0.5)
    clouds.put(cloud(99.0))
    clouds.put(cloud(100.0))
    assert wait(clouds, 99.0) is None


def test_clouds_from_before_a_jump_back_are_dropped(clock):
    clouds = ByStamp(max_age=0.5)
    clouds.put(cloud(100.0))
    assert wait(clouds, 100.0) is not None
    assert wait(clouds, 10.0, Ticking(clock)) is None
    assert clouds.newest is None
    clouds.put(cloud(10.1))
    assert wait(clouds, 10.1) is not None


def test_a_wait_ends_even_if_ros_time_stands_still(clock, monkeypatch):
    monkeypatch.setattr(by_stamp, "STANDSTILL", 0.01)
    assert wait(ByStamp(max_age=0.5), 100.0) is None
