// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/server.h>
#include <image_transport/image_transport.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <stereo_msgs/DisparityImage.h>
#include <tld_follower/StereoConfig.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "stereo/cloud.h"
#include "stereo/filtered_cloud_node.h"
#include "stereo/image_topics_node.h"
#include "stereo/input_node.h"
#include "stereo/matcher.h"
#include "stereo/message_pool_node.h"
#include "stereo/views.h"
#include "stereo/warning_node.h"

namespace tld_follower::stereo {

/// Turns {left,right}/{image_raw,camera_info} into `disparity`, `points2`, `points2_filtered` and
/// the images of image_proc: a drop-in for the node stereo_image_proc. Subscribes only while
/// somebody subscribes to a result, computes only what is subscribed, and works on the newest pair.
/// The handles must share one queue whose callbacks come one at a time, in any thread, possibly
/// while the constructor still runs.
class StereoNode {
 public:
  /// Topics are relative to `handle`, parameters private to `private_handle`.
  /// Throws std::invalid_argument naming the parameter if one that cannot change has a wrong type
  /// or value.
  StereoNode(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle);

 private:
  /// One camera: its views and the topics that show them.
  struct Camera {
    std::string name;
    CameraViews views;
    std::optional<ImageTopics> topics;

    /// Takes a message and publishes its views. Throws std::invalid_argument, with the camera's
    /// name, for messages that make no picture.
    void Read(const sensor_msgs::Image::ConstPtr& image, const sensor_msgs::CameraInfo& info);
    /// The image to match. Throws as Read() does.
    const cv::Mat& RectifiedGrey();
  };

  bool DisparityIsNeeded() const;
  bool CloudIsNeeded() const;
  void SubscribeWhileNeeded();
  void OnReconfigure(tld_follower::StereoConfig* config);
  void OnPair(const sensor_msgs::Image::ConstPtr& left_image,
              const sensor_msgs::CameraInfo::ConstPtr& left_info,
              const sensor_msgs::Image::ConstPtr& right_image,
              const sensor_msgs::CameraInfo::ConstPtr& right_info);
  void PublishDisparity(const cv::Mat& disparity, const StereoGeometry& geometry,
                        const std_msgs::Header& header);
  void PublishCloud(const cv::Mat& disparity, const StereoGeometry& geometry,
                    const std_msgs::Header& header);

  ros::NodeHandle handle_;
  image_transport::ImageTransport transport_;
  StereoInput input_;

  Matcher matcher_;
  CloudMaker cloud_maker_;
  Camera left_{"left", {}, {}}, right_{"right", {}, {}};
  MessagePool<stereo_msgs::DisparityImage> disparities_;
  MessagePool<sensor_msgs::PointCloud2> clouds_;
  Warner warn_;

  std::mutex advertising_;  // Subscribers that come before all topics are there have to wait.
  ros::Publisher disparity_publisher_, cloud_publisher_;
  std::unique_ptr<dynamic_reconfigure::Server<tld_follower::StereoConfig>> reconfigure_server_;
  std::optional<FilteredCloud> filtered_cloud_;
};

}  // namespace tld_follower::stereo
