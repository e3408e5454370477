// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <variant>

#include "stereo/parameters_node.h"
#include "stereo/warning_node.h"

namespace tld_follower::stereo {

/// {left,right}/{image_raw,camera_info}, paired by their stamps. All callbacks come from the
/// handle's queue, one at a time.
class StereoInput {
 public:
  using Image = sensor_msgs::Image;
  using CameraInfo = sensor_msgs::CameraInfo;
  using Callback = std::function<void(const Image::ConstPtr& left, const CameraInfo::ConstPtr&,
                                      const Image::ConstPtr& right, const CameraInfo::ConstPtr&)>;

  /// Topics are relative to `handle`. Throws std::invalid_argument as ReadInputParameters does.
  StereoInput(const ros::NodeHandle& handle, const ros::NodeHandle& private_handle,
              Callback on_pair);

  /// Subscribes or unsubscribes all four.
  void Subscribe(bool wanted);

 private:
  using Exact = message_filters::Synchronizer<
      message_filters::sync_policies::ExactTime<Image, CameraInfo, Image, CameraInfo>>;
  using Approximate = message_filters::Synchronizer<
      message_filters::sync_policies::ApproximateTime<Image, CameraInfo, Image, CameraInfo>>;

  void MakeSynchroniser();
  template <int kInput, typename Message>
  void OnMessage(const ros::MessageEvent<const Message>& event);
  void OnPair(const Image::ConstPtr& left_image, const CameraInfo::ConstPtr& left_info,
              const Image::ConstPtr& right_image, const CameraInfo::ConstPtr& right_info);
  void Check();

  ros::NodeHandle handle_;
  image_transport::ImageTransport transport_;
  InputParameters parameters_;
  image_transport::TransportHints hints_;
  Callback on_pair_;

  std::array<image_transport::SubscriberFilter, 2> images_;
  std::array<message_filters::Subscriber<CameraInfo>, 2> infos_;
  std::variant<std::unique_ptr<Exact>, std::unique_ptr<Approximate>> synchroniser_;
  bool subscribed_ = false;

  // Of left image, left info, right image, right info: the newest stamp, and how many came in since
  // Check() looked; pairs_: how many pairs they made.
  std::array<ros::Time, 4> newest_;
  std::array<int, 4> received_{};
  int pairs_ = 0;
  ros::Time last_check_;
  Warner warn_;
  ros::WallTimer check_timer_;
};

}  // namespace tld_follower::stereo
