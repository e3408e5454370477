// SPDX-License-Identifier: BSD-3-Clause
#include "sim/conversions_node.h"

#include <sensor_msgs/distortion_models.h>

namespace tld_follower::sim {

geometry_msgs::Vector3 ToVector3(const btVector3& v) {
  geometry_msgs::Vector3 result;
  result.x = v.x();
  result.y = v.y();
  result.z = v.z();
  return result;
}

geometry_msgs::Quaternion ToQuaternion(const btMatrix3x3& rotation) {
  btQuaternion q;
  rotation.getRotation(q);
  // Bullet's matrices drift a little from orthonormal; tf wants unit quaternions.
  q.normalize();
  geometry_msgs::Quaternion result;
  result.x = q.x();
  result.y = q.y();
  result.z = q.z();
  result.w = q.w();
  return result;
}

geometry_msgs::Pose ToPose(const btTransform& pose) {
  geometry_msgs::Pose result;
  result.position.x = pose.getOrigin().x();
  result.position.y = pose.getOrigin().y();
  result.position.z = pose.getOrigin().z();
  result.orientation = ToQuaternion(pose.getBasis());
  return result;
}

geometry_msgs::Twist ToTwist(const btVector3& linear, const btVector3& angular) {
  geometry_msgs::Twist result;
  result.linear = ToVector3(linear);
  result.angular = ToVector3(angular);
  return result;
}

geometry_msgs::TransformStamped ToTransform(const btTransform& pose, const ros::Time& stamp,
                                            const std::string& parent, const std::string& child) {
  geometry_msgs::TransformStamped result;
  result.header.stamp = stamp;
  result.header.frame_id = parent;
  result.child_frame_id = child;
  result.transform.translation = ToVector3(pose.getOrigin());
  result.transform.rotation = ToQuaternion(pose.getBasis());
  return result;
}

nav_msgs::Odometry ToGroundTruth(const Body& body, const ros::Time& stamp,
                                 const std::string& child) {
  const btTransform pose = body.Pose();
  const btMatrix3x3 to_body = pose.getBasis().transpose();
  nav_msgs::Odometry result;
  result.header.stamp = stamp;
  result.header.frame_id = "world";
  result.child_frame_id = child;
  result.pose.pose = ToPose(pose);
  result.twist.twist = ToTwist(to_body * body.Velocity(), to_body * body.AngularVelocity());
  return result;
}

sensor_msgs::CameraInfo ToCameraInfo(const StereoCamera& camera, Eye eye,
                                     const std::string& frame) {
  const double f = camera.FocalLength(), cx = camera.Cx(), cy = camera.Cy();
  const double shift = eye == Eye::kRight ? -f * camera.baseline : 0.0;
  sensor_msgs::CameraInfo info;
  info.header.frame_id = frame;
  info.width = uint32_t(camera.width);
  info.height = uint32_t(camera.height);
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D.assign(5, 0.0);
  info.K = {f, 0, cx, 0, f, cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {f, 0, cx, shift, 0, f, cy, 0, 0, 0, 1, 0};
  return info;
}

}  // namespace tld_follower::sim
