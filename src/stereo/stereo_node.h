// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/server.h>
#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <stereo_msgs/DisparityImage.h>
#include <tld_follower/StereoConfig.h>

#include <array>
#include <chrono>
#include <memory>
#include <string>

#include "stereo/camera.h"
#include "stereo/cloud.h"
#include "stereo/matcher.h"

namespace tld_stereo {

/// Turns {left,right}/{image_raw,camera_info} into `disparity` and `points2`: a drop-in for the
/// node stereo_image_proc. Subscribes only while somebody subscribes to a result, computes only
/// what is subscribed, and works on the newest pair. All callbacks must come from one thread.
class StereoNode {
 public:
  /// Topics are relative to `nh`, parameters private to `private_nh`.
  StereoNode(ros::NodeHandle nh, ros::NodeHandle private_nh);

 private:
  using ImagePtr = sensor_msgs::ImageConstPtr;
  using InfoPtr = sensor_msgs::CameraInfoConstPtr;

  /// One camera's side of the work: its rectification and the buffers that outlive a frame.
  struct Eye {
    Rectifier grey_rectifier, texture_rectifier;
    cv::Mat grey, texture;
  };

  template <typename Policy>
  void synchronise();
  void subscribeWhileNeeded();
  void reconfigure(tld_follower::StereoConfig& config);
  void receive(const ImagePtr& left, const InfoPtr& left_info, const ImagePtr& right,
               const InfoPtr& right_info);
  void process(const sensor_msgs::Image& left, const sensor_msgs::CameraInfo& left_info,
               const sensor_msgs::Image& right, const sensor_msgs::CameraInfo& right_info);
  void publishDisparity(const cv::Mat& disparity, const StereoGeometry& geometry,
                        const std_msgs::Header& header);
  void publishCloud(const cv::Mat& disparity, const Texture& texture,
                    const StereoGeometry& geometry, const std_msgs::Header& header);
  void checkInputs();
  void warn(const std::string& text);

  ros::NodeHandle nh_;
  image_transport::ImageTransport transport_;
  image_transport::TransportHints hints_;
  int queue_size_;
  bool approximate_;

  std::array<image_transport::SubscriberFilter, 2> images_;
  std::array<message_filters::Subscriber<sensor_msgs::CameraInfo>, 2> infos_;
  std::shared_ptr<void> synchroniser_;  // of one of two policies; dies before what feeds it
  bool subscribed_ = false;

  Matcher matcher_;
  CloudMaker cloud_maker_;
  Eye left_, right_;
  stereo_msgs::DisparityImage disparity_message_;
  sensor_msgs::PointCloud2 cloud_message_;

  // What came in since checkInputs() looked: left image, left info, right image, right info; pairs.
  std::array<int, 4> received_{};
  int pairs_ = 0;
  ros::Time last_check_;
  std::string last_warning_;
  std::chrono::steady_clock::time_point last_warning_time_;

  ros::Publisher disparity_publisher_, cloud_publisher_;
  dynamic_reconfigure::Server<tld_follower::StereoConfig> reconfigure_server_;
  ros::WallTimer input_timer_;
};

}  // namespace tld_stereo
