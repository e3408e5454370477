"""From a box and a point cloud to a velocity command (thesis section 3.3). Knows no ROS."""
