// SPDX-License-Identifier: BSD-3-Clause
#include <malloc.h>
#include <ros/ros.h>

#include <exception>
#include <opencv2/core/utility.hpp>

#include "stereo/stereo_node.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "stereo_image_proc");
  // Clouds come and go at frame rate: keep their pages instead of asking the kernel for new ones.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  cv::setNumThreads(1);  // The machine's other cores belong to the other nodes.
  ros::start();          // Or the end of the node's last handle would silence the message below.
  try {
    tld_follower::stereo::StereoNode node(ros::NodeHandle(), ros::NodeHandle("~"));
    ros::spin();
  } catch (const std::exception& problem) {
    ROS_FATAL("%s", problem.what());
    return 1;
  }
  return 0;
}
