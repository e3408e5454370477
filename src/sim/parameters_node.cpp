// SPDX-License-Identifier: BSD-3-Clause
#include "sim/parameters_node.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

constexpr double kFarthest = 1e4;  // Bound on the numbers of a place [m, rad].

[[noreturn]] void Fail(const std::string& name, const std::string& what) {
  throw std::invalid_argument("parameter ~" + name + " must be " + what);
}

template <typename T>
void Read(const ros::NodeHandle& handle, const std::string& name, const std::string& what,
          T* value) {
  if (handle.hasParam(name) && !handle.getParam(name, *value)) Fail(name, what);
}

void ReadFinite(const ros::NodeHandle& handle, const std::string& name, double* value) {
  Read(handle, name, "a number", value);
  if (!std::isfinite(*value)) Fail(name, "finite");
}

void ReadPositive(const ros::NodeHandle& handle, const std::string& name, double* value) {
  ReadFinite(handle, name, value);
  if (!(*value > 0)) Fail(name, "positive");
}

void ReadNotNegative(const ros::NodeHandle& handle, const std::string& name, double* value) {
  ReadFinite(handle, name, value);
  if (*value < 0) Fail(name, "0 or more");
}

void ReadShare(const ros::NodeHandle& handle, const std::string& name, double* value) {
  ReadFinite(handle, name, value);
  if (!(*value >= 0 && *value <= 1)) Fail(name, "from 0 to 1");
}

// ROS itself would round a fraction to the next whole number.
int ReadWhole(const ros::NodeHandle& handle, const std::string& name, int value) {
  const std::string what = "a whole number, 0 or more";
  double number = value;
  Read(handle, name, what, &number);
  if (!(number >= 0 && number <= std::numeric_limits<int>::max()) || number != std::floor(number)) {
    Fail(name, what);
  }
  return int(number);
}

// Three numbers, or none.
std::vector<double> ReadPlace(const ros::NodeHandle& handle, const std::string& name,
                              const std::string& list) {
  const std::string what = "a list " + list + ", each from -10000 to 10000, or empty";
  std::vector<double> numbers;
  Read(handle, name, what, &numbers);
  if (!numbers.empty() && numbers.size() != 3) Fail(name, what);
  for (const double number : numbers) {
    if (!(std::abs(number) <= kFarthest)) Fail(name, what);
  }
  return numbers;
}

void ReadPlacement(const ros::NodeHandle& handle, const std::string& name,
                   std::optional<Placement>* place) {
  const std::vector<double> numbers = ReadPlace(handle, name, "[x, y, yaw] in m and rad");
  if (!numbers.empty()) *place = Placement{numbers[0], numbers[1], numbers[2]};
}

void ReadCamera(const ros::NodeHandle& handle, StereoCamera* camera) {
  camera->width = ReadWhole(handle, "width", camera->width);
  camera->height = ReadWhole(handle, "height", camera->height);
  ReadPositive(handle, "hfov", &camera->hfov);
  ReadPositive(handle, "baseline", &camera->baseline);
  ReadFinite(handle, "camera_pitch", &camera->pitch);
  const std::vector<double> position = ReadPlace(handle, "camera_position", "[x, y, z] in m");
  if (position.empty()) return;
  camera->position = {btScalar(position[0]), btScalar(position[1]), btScalar(position[2])};
}

void ReadEffects(const ros::NodeHandle& handle, CameraEffects* effects) {
  std::string shadows = "ground";
  Read(handle, "shadows", "ground or map", &shadows);
  if (shadows != "ground" && shadows != "map") Fail("shadows", "ground or map");
  effects->shadow_map = shadows == "map";
  ReadNotNegative(handle, "exposure_change", &effects->exposure_change);
  ReadPositive(handle, "exposure_time", &effects->exposure_time);
  effects->blur_pictures = ReadWhole(handle, "blur_pictures", effects->blur_pictures);
  ReadNotNegative(handle, "shutter_time", &effects->shutter_time);
}

void ReadSpiri(const ros::NodeHandle& handle, SpiriParameters* p) {
  ReadPositive(handle, "spiri/arm", &p->arm);
  ReadPositive(handle, "spiri/motor_constant", &p->motor_constant);
  ReadPositive(handle, "spiri/moment_constant", &p->moment_constant);
  ReadPositive(handle, "spiri/max_rotor_speed", &p->max_rotor_speed);
  ReadPositive(handle, "spiri/time_constant_up", &p->time_constant_up);
  ReadPositive(handle, "spiri/time_constant_down", &p->time_constant_down);
  ReadNotNegative(handle, "spiri/drag_xy", &p->drag_xy);
  ReadNotNegative(handle, "spiri/drag_z", &p->drag_z);
  ReadNotNegative(handle, "spiri/drag_roll_pitch", &p->drag_roll_pitch);
  ReadNotNegative(handle, "spiri/drag_yaw", &p->drag_yaw);
  ReadNotNegative(handle, "spiri/velocity_xy_p", &p->velocity_xy_p);
  ReadNotNegative(handle, "spiri/velocity_xy_i", &p->velocity_xy_i);
  ReadNotNegative(handle, "spiri/velocity_z_p", &p->velocity_z_p);
  ReadNotNegative(handle, "spiri/velocity_z_i", &p->velocity_z_i);
  ReadNotNegative(handle, "spiri/position_p", &p->position_p);
  ReadNotNegative(handle, "spiri/attitude_p", &p->attitude_p);
  ReadNotNegative(handle, "spiri/attitude_d", &p->attitude_d);
  ReadNotNegative(handle, "spiri/heading_p", &p->heading_p);
  ReadNotNegative(handle, "spiri/yaw_rate_p", &p->yaw_rate_p);
  ReadPositive(handle, "spiri/max_tilt", &p->max_tilt);
  if (!(p->max_tilt < M_PI / 2)) Fail("spiri/max_tilt", "less than pi/2");
  ReadNotNegative(handle, "spiri/max_speed_xy", &p->max_speed_xy);
  ReadNotNegative(handle, "spiri/max_speed_z", &p->max_speed_z);
  ReadNotNegative(handle, "spiri/max_yaw_rate", &p->max_yaw_rate);
  ReadPositive(handle, "spiri/command_timeout", &p->command_timeout);
  ReadPositive(handle, "spiri/take_off_speed", &p->take_off_speed);
  ReadPositive(handle, "spiri/rotor_radius", &p->rotor_radius);
  ReadShare(handle, "spiri/rotor_efficiency", &p->rotor_efficiency);
  if (!(p->rotor_efficiency > 0)) Fail("spiri/rotor_efficiency", "positive");
  ReadNotNegative(handle, "spiri/electronics_power", &p->electronics_power);
  ReadShare(handle, "spiri/reserve", &p->reserve);
  ReadPositive(handle, "spiri/battery/capacity", &p->battery.capacity);
  ReadPositive(handle, "spiri/battery/full_voltage", &p->battery.full_voltage);
  ReadPositive(handle, "spiri/battery/empty_voltage", &p->battery.empty_voltage);
  ReadPositive(handle, "spiri/battery/resistance", &p->battery.resistance);
  ReadShare(handle, "spiri/battery/initial_charge", &p->battery.initial_charge);
  ReadPositive(handle, "take_off_altitude", &p->take_off_altitude);
}

void ReadSensors(const ros::NodeHandle& handle, SensorParameters* p) {
  ReadNotNegative(handle, "spiri/sensors/acceleration_noise", &p->acceleration_noise);
  ReadNotNegative(handle, "spiri/sensors/gyroscope_noise", &p->gyroscope_noise);
  ReadNotNegative(handle, "spiri/sensors/gyroscope_drift", &p->gyroscope_drift);
  ReadNotNegative(handle, "spiri/sensors/range_noise", &p->range_noise);
  ReadPositive(handle, "spiri/sensors/range_max", &p->range_max);
  ReadNotNegative(handle, "spiri/sensors/tilt_noise", &p->tilt_noise);
  ReadNotNegative(handle, "spiri/sensors/velocity_noise", &p->velocity_noise);
  ReadNotNegative(handle, "spiri/sensors/velocity_drift", &p->velocity_drift);
  ReadNotNegative(handle, "spiri/sensors/altitude_noise", &p->altitude_noise);
  ReadNotNegative(handle, "spiri/sensors/yaw_rate_drift", &p->yaw_rate_drift);
  ReadPositive(handle, "spiri/sensors/drift_time", &p->drift_time);
}

void ReadHusky(const ros::NodeHandle& handle, HuskyParameters* p) {
  ReadPositive(handle, "husky/separation_multiplier", &p->separation_multiplier);
  ReadNotNegative(handle, "husky/max_speed", &p->max_speed);
  ReadPositive(handle, "husky/max_acceleration", &p->max_acceleration);
  ReadNotNegative(handle, "husky/max_yaw_rate", &p->max_yaw_rate);
  ReadPositive(handle, "husky/max_yaw_acceleration", &p->max_yaw_acceleration);
  ReadPositive(handle, "husky/command_timeout", &p->command_timeout);
  ReadPositive(handle, "husky/max_wheel_torque", &p->max_wheel_torque);
}

void ReadMast(const ros::NodeHandle& handle, Mast* mast) {
  ReadFinite(handle, "ugv/camera_forward", &mast->forward);
  ReadPositive(handle, "ugv/camera_height", &mast->height);
  ReadFinite(handle, "ugv/camera_pitch", &mast->pitch);
}

Mode ReadMode(const ros::NodeHandle& handle) {
  std::string mode = "realtime";
  Read(handle, "mode", "realtime, fast or lockstep", &mode);
  if (mode == "realtime") return Mode::kRealtime;
  if (mode == "fast") return Mode::kFast;
  if (mode == "lockstep") return Mode::kLockstep;
  Fail("mode", "realtime, fast or lockstep, not '" + mode + "'");
}

}  // namespace

NodeParameters ReadParameters(const ros::NodeHandle& handle) {
  NodeParameters result;
  SimulationConfig& simulation = result.simulation;
  Read(handle, "world", "the path of an SDF world", &simulation.world_file);
  if (simulation.world_file.empty()) Fail("world", "the path of an SDF world");
  result.mode = ReadMode(handle);
  Read(handle, "paused", "true or false", &result.paused);
  Read(handle, "lockstep_target", "true or false", &result.lockstep_target);
  ReadPositive(handle, "lockstep_timeout", &result.lockstep_timeout);
  simulation.seed = uint64_t(ReadWhole(handle, "seed", 0));
  ReadPositive(handle, "rate", &simulation.frame_rate);
  ReadNotNegative(handle, "image_noise", &simulation.image_noise);
  ReadPlacement(handle, "vehicle_pose", &simulation.cast.vehicle_place);
  ReadPlacement(handle, "target_pose", &simulation.cast.target_place);
  ReadCamera(handle, &simulation.camera);
  ReadEffects(handle, &simulation.effects);
  ReadSpiri(handle, &simulation.cast.spiri);
  ReadSensors(handle, &simulation.sensors);
  ReadHusky(handle, &simulation.cast.husky);
  ReadMast(handle, &simulation.cast.mast);
  return result;
}

}  // namespace tld_follower::sim
