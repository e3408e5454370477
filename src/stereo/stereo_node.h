// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/server.h>
#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>
#include <stereo_msgs/DisparityImage.h>
#include <tld_follower/StereoConfig.h>

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "stereo/camera.h"
#include "stereo/cloud.h"
#include "stereo/image.h"
#include "stereo/matcher.h"

namespace tld_follower::stereo {

/// Turns {left,right}/{image_raw,camera_info} into `disparity` and `points2`: a drop-in for the
/// node stereo_image_proc. Subscribes only while somebody subscribes to a result, computes only
/// what is subscribed, and works on the newest pair. All callbacks must come from one thread.
class StereoNode {
 public:
  /// Topics are relative to `handle`, parameters private to `private_handle`.
  /// Throws std::invalid_argument naming the parameter if one that cannot change has a wrong type
  /// or value.
  StereoNode(ros::NodeHandle handle, ros::NodeHandle private_handle);

 private:
  using ImagePtr = sensor_msgs::ImageConstPtr;
  using InfoPtr = sensor_msgs::CameraInfoConstPtr;

  using Exact = message_filters::Synchronizer<message_filters::sync_policies::ExactTime<
      sensor_msgs::Image, sensor_msgs::CameraInfo, sensor_msgs::Image, sensor_msgs::CameraInfo>>;
  using Approximate = message_filters::Synchronizer<message_filters::sync_policies::ApproximateTime<
      sensor_msgs::Image, sensor_msgs::CameraInfo, sensor_msgs::Image, sensor_msgs::CameraInfo>>;

  /// One camera: what it sent last, and the buffers that outlive a frame.
  struct Eye {
    explicit Eye(const char* camera_name) : name(camera_name) {}

    std::string name;
    Calibration calibration;
    Encoding encoding = Encoding::kMono;
    cv::Mat raw;             // Shares the message's bytes.
    cv::Mat rectified_grey;  // Shares them too where nothing had to be done.

    /// Throws std::invalid_argument, with the camera's name, for messages that make no picture.
    void Read(const sensor_msgs::Image& image, const sensor_msgs::CameraInfo& info);
    /// Colours of the rectified image that was read last.
    Texture RectifiedTexture();

   private:
    Rectifier grey_rectifier_, texture_rectifier_;
    cv::Mat grey_, texture_;
  };

  void StartReconfigure(const ros::NodeHandle& private_handle);
  void MakeSynchroniser();
  template <int kInput, typename Message>
  void OnMessage(const ros::MessageEvent<const Message>& event);
  void SubscribeWhileNeeded();
  void OnReconfigure(tld_follower::StereoConfig* config);
  void OnPair(const ImagePtr& left_image, const InfoPtr& left_info, const ImagePtr& right_image,
              const InfoPtr& right_info);
  void PublishDisparity(const cv::Mat& disparity, const StereoGeometry& geometry,
                        const std_msgs::Header& header);
  void PublishCloud(const cv::Mat& disparity, const StereoGeometry& geometry,
                    const std_msgs::Header& header);
  void CheckInputs();
  void Warn(const std::string& text);

  ros::NodeHandle handle_;
  image_transport::ImageTransport transport_;
  image_transport::TransportHints hints_;
  int queue_size_;
  bool approximate_sync_;

  std::array<image_transport::SubscriberFilter, 2> images_;
  std::array<message_filters::Subscriber<sensor_msgs::CameraInfo>, 2> infos_;
  std::variant<std::unique_ptr<Exact>, std::unique_ptr<Approximate>> synchroniser_;
  bool subscribed_ = false;

  Matcher matcher_;
  CloudMaker cloud_maker_;
  Eye left_{"left"}, right_{"right"};
  stereo_msgs::DisparityImage disparity_message_;
  sensor_msgs::PointCloud2 cloud_message_;

  // Of left image, left info, right image, right info: the newest stamp, and how many came in since
  // CheckInputs() looked; pairs_: how many pairs they made.
  std::array<ros::Time, 4> newest_;
  std::array<int, 4> received_{};
  int pairs_ = 0;
  ros::Time last_check_;
  std::string last_warning_;
  std::chrono::steady_clock::time_point last_warning_time_;

  ros::Publisher disparity_publisher_, cloud_publisher_;
  std::optional<dynamic_reconfigure::Server<tld_follower::StereoConfig>> reconfigure_server_;
  ros::WallTimer input_timer_;
};

}  // namespace tld_follower::stereo
