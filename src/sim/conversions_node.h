// SPDX-License-Identifier: BSD-3-Clause
// From the simulator's types to messages.
#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <string>
#include <vector>

#include "sim/camera.h"
#include "sim/physics.h"

namespace tld_follower::sim {

geometry_msgs::Vector3 ToVector3(const btVector3& v);
geometry_msgs::Quaternion ToQuaternion(const btMatrix3x3& rotation);
geometry_msgs::Pose ToPose(const btTransform& pose);
geometry_msgs::Twist ToTwist(const btVector3& linear, const btVector3& angular);
geometry_msgs::TransformStamped ToTransform(const btTransform& pose, const ros::Time& stamp,
                                            const std::string& parent, const std::string& child);

/// True state of a body: pose in "world", twist in the body's axes.
nav_msgs::Odometry ToGroundTruth(const Body& body, const ros::Time& stamp,
                                 const std::string& child);

/// CameraInfo of one eye, without distortion. Both eyes share the left optical frame; P of the
/// right one holds -f * baseline (sensor_msgs/CameraInfo).
sensor_msgs::CameraInfo ToCameraInfo(const StereoCamera& camera, Eye eye, const std::string& frame);

/// An image of whole rows, of the camera that `info` describes.
template <typename Value>
sensor_msgs::Image ToImage(const sensor_msgs::CameraInfo& info, const std::string& encoding,
                           const std::vector<Value>& pixels) {
  sensor_msgs::Image image;
  image.header = info.header;
  image.width = info.width;
  image.height = info.height;
  image.encoding = encoding;
  image.step = uint32_t(pixels.size() * sizeof(Value) / info.height);
  const auto* bytes = reinterpret_cast<const uint8_t*>(pixels.data());
  image.data.assign(bytes, bytes + pixels.size() * sizeof(Value));
  return image;
}

}  // namespace tld_follower::sim
