// SPDX-License-Identifier: BSD-3-Clause
#include "sim/publishers_node.h"

#include <nav_msgs/Odometry.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Range.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2_msgs/TFMessage.h>
#include <tld_follower/Truth.h>

#include <cmath>

#include "sim/conversions_node.h"

namespace tld_follower::sim {
namespace {

constexpr const char* kOpticalFrame = "stereo_left_optical_frame";

// Diagonal of a 3x3 or 6x6 covariance, row major.
template <typename Covariance>
void SetDiagonal(std::initializer_list<double> sigmas, Covariance* covariance) {
  size_t row = 0;
  for (const double sigma : sigmas) {
    (*covariance)[row * (sigmas.size() + 1)] = sigma * sigma;
    ++row;
  }
}

}  // namespace

Publishers::Publishers(ros::NodeHandle handle, ros::NodeHandle private_handle,
                       const Simulation& simulation)
    : clock_(handle.advertise<rosgraph_msgs::Clock>("/clock", 100)),
      left_image_(handle.advertise<sensor_msgs::Image>("stereo/left/image_raw", 5)),
      right_image_(handle.advertise<sensor_msgs::Image>("stereo/right/image_raw", 5)),
      left_info_(handle.advertise<sensor_msgs::CameraInfo>("stereo/left/camera_info", 5)),
      right_info_(handle.advertise<sensor_msgs::CameraInfo>("stereo/right/camera_info", 5)),
      imu_(handle.advertise<sensor_msgs::Imu>("raw_imu", 100)),
      ground_truth_(handle.advertise<nav_msgs::Odometry>("ground_truth/state", 100)),
      tf_(handle.advertise<tf2_msgs::TFMessage>("/tf", 100)),
      tf_static_(handle.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true)),
      truth_(private_handle.advertise<tld_follower::Truth>("truth", 10)),
      depth_(private_handle.advertise<sensor_msgs::Image>("depth", 5)),
      labels_(private_handle.advertise<sensor_msgs::Image>("labels", 5)),
      target_odometry_frame_(simulation.cast().target().name + "_odom"),
      target_frame_(simulation.cast().target().name + "_base_link"),
      left_camera_(ToCameraInfo(simulation.camera(), Eye::kLeft, kOpticalFrame)),
      right_camera_(ToCameraInfo(simulation.camera(), Eye::kRight, kOpticalFrame)) {
  const std::string& vehicle = simulation.cast().vehicle().name;
  const std::string& target = simulation.cast().target().name;
  odometry_ = handle.advertise<nav_msgs::Odometry>(vehicle + "/odometry", 100);
  target_odometry_ = handle.advertise<nav_msgs::Odometry>(target + "/odom", 50);
  target_ground_truth_ = handle.advertise<nav_msgs::Odometry>(target + "/ground_truth/state", 100);
  if (simulation.vehicle().flies()) range_ = handle.advertise<sensor_msgs::Range>("range", 10);
  if (!simulation.target().flies()) {
    joint_states_ = handle.advertise<sensor_msgs::JointState>(target + "/joint_states", 50);
  }
}

void Publishers::PublishStart(const Simulation& simulation, const ros::Time& stamp) {
  const StereoCamera& camera = simulation.camera();
  tf2_msgs::TFMessage message;
  message.transforms = {
      ToTransform(simulation.vehicle().body().Pose(), stamp, "world", "odom"),
      ToTransform(simulation.target().body().Pose(), stamp, "world", target_odometry_frame_),
      ToTransform(camera.Mount(), stamp, "base_link", "stereo_link"),
      ToTransform(camera.Optical(Eye::kLeft), stamp, "stereo_link", kOpticalFrame)};
  tf_static_.publish(message);
}

void Publishers::PublishClock(const ros::Time& stamp) {
  rosgraph_msgs::Clock clock;
  clock.clock = stamp;
  clock_.publish(clock);
}

void Publishers::Publish(Simulation* simulation, const Moment& moment, const ros::Time& stamp) {
  PublishClock(stamp);
  if (moment.tick) PublishTick(*simulation, stamp);
  if (moment.slow_tick) PublishSlowTick(*simulation, stamp);
  if (moment.frame) PublishFrame(simulation, stamp);
}

void Publishers::PublishTick(const Simulation& simulation, const ros::Time& stamp) {
  const Sensors& sensors = simulation.sensors();
  const SensorParameters& errors = sensors.parameters();
  sensor_msgs::Imu imu;
  imu.header.stamp = stamp;
  imu.header.frame_id = "base_link";
  imu.orientation = ToQuaternion(btMatrix3x3(sensors.imu().attitude));
  imu.angular_velocity = ToVector3(sensors.imu().angular_velocity);
  imu.linear_acceleration = ToVector3(sensors.imu().acceleration);
  const double gyroscope = std::hypot(errors.gyroscope_noise, errors.gyroscope_drift);
  const double yaw = errors.yaw_rate_drift * errors.drift_time;
  SetDiagonal({errors.tilt_noise, errors.tilt_noise, yaw}, &imu.orientation_covariance);
  SetDiagonal({gyroscope, gyroscope, gyroscope}, &imu.angular_velocity_covariance);
  SetDiagonal({errors.acceleration_noise, errors.acceleration_noise, errors.acceleration_noise},
              &imu.linear_acceleration_covariance);
  imu_.publish(imu);

  const OdometrySample& sample = sensors.odometry();
  nav_msgs::Odometry odometry;
  odometry.header.stamp = stamp;
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base_link";
  odometry.pose.pose = ToPose(sample.pose);
  odometry.twist.twist = ToTwist(sample.velocity, sample.angular_velocity);
  const double velocity = std::hypot(errors.velocity_noise, errors.velocity_drift);
  const double place = errors.velocity_drift * errors.drift_time;
  SetDiagonal({place, place, errors.altitude_noise, errors.tilt_noise, errors.tilt_noise, yaw},
              &odometry.pose.covariance);
  SetDiagonal({velocity, velocity, errors.velocity_noise, gyroscope, gyroscope, gyroscope},
              &odometry.twist.covariance);
  odometry_.publish(odometry);

  tf2_msgs::TFMessage tf;
  tf.transforms = {ToTransform(sample.pose, stamp, "odom", "base_link")};
  tf_.publish(tf);

  ground_truth_.publish(ToGroundTruth(simulation.vehicle().body(), stamp, "base_link"));
  target_ground_truth_.publish(ToGroundTruth(simulation.target().body(), stamp, target_frame_));
}

void Publishers::PublishSlowTick(const Simulation& simulation, const ros::Time& stamp) {
  const MobileRobot& target = simulation.target();
  if (joint_states_) {
    sensor_msgs::JointState joints;
    joints.header.stamp = stamp;
    for (const JointSample& joint : target.Joints()) {
      joints.name.push_back(joint.name);
      joints.position.push_back(joint.angle);
      joints.velocity.push_back(joint.speed);
    }
    joint_states_.publish(joints);
  }

  const OdometrySample sample = target.Odometry();
  nav_msgs::Odometry odometry;
  odometry.header.stamp = stamp;
  odometry.header.frame_id = target_odometry_frame_;
  odometry.child_frame_id = target_frame_;
  odometry.pose.pose = ToPose(sample.pose);
  odometry.twist.twist = ToTwist(sample.velocity, sample.angular_velocity);
  target_odometry_.publish(odometry);

  tf2_msgs::TFMessage tf;
  tf.transforms = {ToTransform(sample.pose, stamp, target_odometry_frame_, target_frame_)};
  tf_.publish(tf);
}

void Publishers::PublishFrame(Simulation* simulation, const ros::Time& stamp) {
  TakeTime(stamp);
  if (range_) PublishRange(simulation, stamp);
  const bool truth = truth_.getNumSubscribers() > 0;
  TargetMask mask;
  simulation->Render(&images_, truth ? &mask : nullptr);
  if (truth) PublishTruth(*simulation, mask, stamp);
  left_camera_.header.stamp = right_camera_.header.stamp = stamp;
  left_info_.publish(left_camera_);
  right_info_.publish(right_camera_);
  PublishPictures(simulation);
}

void Publishers::PublishPictures(Simulation* simulation) {
  using namespace sensor_msgs::image_encodings;
  if (depth_.getNumSubscribers() > 0) {
    std::vector<float> depth;
    simulation->ReadDepth(&depth);
    depth_.publish(ToImage(left_camera_, TYPE_32FC1, depth));
  }
  if (labels_.getNumSubscribers() > 0) {
    std::vector<uint8_t> labels;
    simulation->ReadLabels(&labels);
    labels_.publish(ToImage(left_camera_, MONO8, labels));
  }
  left_image_.publish(ToImage(left_camera_, RGB8, images_.left));
  right_image_.publish(ToImage(right_camera_, RGB8, images_.right));
}

void Publishers::PublishRange(Simulation* simulation, const ros::Time& stamp) {
  sensor_msgs::Range range;
  range.header.stamp = stamp;
  range.header.frame_id = "base_link";
  range.radiation_type = sensor_msgs::Range::INFRARED;
  range.min_range = 0.02f;
  range.max_range = float(simulation->sensors().parameters().range_max);
  range.range = float(simulation->ReadRange());
  range_.publish(range);
}

void Publishers::PublishTruth(const Simulation& simulation, const TargetMask& mask,
                              const ros::Time& stamp) {
  const Truth truth = simulation.Measure();
  const Body& drone = simulation.vehicle().body();
  const Body& target = simulation.target().body();
  tld_follower::Truth message;
  message.header.stamp = stamp;
  message.header.frame_id = "world";
  message.distance = truth.distance;
  message.clearance = truth.clearance;
  message.collisions = truth.collisions;
  message.target_box.x = float(mask.x);
  message.target_box.y = float(mask.y);
  message.target_box.width = float(mask.width);
  message.target_box.height = float(mask.height);
  message.target_box.visible = mask.pixels > 0;
  message.target_box.confidence = mask.pixels > 0 ? 1.f : 0.f;
  message.target_box.captured = stamp;
  message.target_pixels = uint32_t(mask.pixels);
  message.drone_pose = ToPose(drone.Pose());
  message.drone_twist = ToTwist(drone.Velocity(), drone.AngularVelocity());
  message.target_pose = ToPose(target.Pose());
  message.target_twist = ToTwist(target.Velocity(), target.AngularVelocity());
  message.real_time_factor = real_time_factor();
  truth_.publish(message);
}

void Publishers::TakeTime(const ros::Time& stamp) {
  stopwatch_.emplace_back(ros::WallTime::now().toSec(), stamp.toSec());
  while (stopwatch_.back().first - stopwatch_.front().first > 1.0) stopwatch_.pop_front();
}

double Publishers::real_time_factor() const {
  if (stopwatch_.size() < 2) return 0.0;
  return (stopwatch_.back().second - stopwatch_.front().second) /
         (stopwatch_.back().first - stopwatch_.front().first);
}

}  // namespace tld_follower::sim
