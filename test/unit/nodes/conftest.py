"""What several tests of nodes share."""

import pytest
import rospy


@pytest.fixture
def clock(monkeypatch):
    """ROS time as a list of one number, which tests set [s]."""
    now = [100.0]
    monkeypatch.setattr(rospy.Time, "now", staticmethod(lambda: rospy.Time.from_sec(now[0])))
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    return now
