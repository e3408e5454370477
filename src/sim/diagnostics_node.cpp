// SPDX-License-Identifier: BSD-3-Clause
#include "sim/diagnostics_node.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <sensor_msgs/BatteryState.h>

#include <cstdio>

namespace tld_follower::sim {
namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr double kSlow = 0.95;  // A real-time factor below this is worth a warning.

void Add(const std::string& key, const char* format, double number, DiagnosticStatus* status) {
  char text[32];
  std::snprintf(text, sizeof text, format, number);
  diagnostic_msgs::KeyValue value;
  value.key = key;
  value.value = text;
  status->values.push_back(value);
}

DiagnosticStatus OfPace(const Simulation& simulation, const Pace& pace, Mode mode) {
  DiagnosticStatus status;
  status.name = "gazebo: pace";
  status.hardware_id = "gazebo";
  const bool slow =
      mode == Mode::kRealtime && pace.real_time_factor > 0 && pace.real_time_factor < kSlow;
  if (slow) {
    status.level = DiagnosticStatus::WARN;
    status.message = "slower than real time";
  } else if (pace.unanswered_frames > 0) {
    status.level = DiagnosticStatus::WARN;
    status.message = "lockstep went on without commands: not reproducible";
  } else {
    status.level = DiagnosticStatus::OK;
    status.message = "keeps up";
  }
  Add("real-time factor", "%.3f", pace.real_time_factor, &status);
  Add("frames", "%.0f", double(simulation.frame()), &status);
  Add("skipped frames", "%.0f", 0, &status);  // It slips rather than skip one.
  Add("late frames", "%.0f", double(pace.late_frames), &status);
  Add("lost time [s]", "%.3f", pace.lost_time, &status);
  Add("unanswered frames", "%.0f", double(pace.unanswered_frames), &status);
  return status;
}

DiagnosticStatus OfBattery(const Battery& battery, bool flies_on, const std::string& vehicle) {
  DiagnosticStatus status;
  status.name = "gazebo: battery";
  status.hardware_id = vehicle;
  status.level = flies_on ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  status.message = flies_on ? "good" : "on the ground, taking off or landing";
  if (battery.charge() <= 0) {
    status.level = DiagnosticStatus::ERROR;
    status.message = "empty";
  }
  Add("charge [%]", "%.1f", 100 * battery.charge(), &status);
  Add("voltage [V]", "%.2f", battery.voltage(), &status);
  Add("current [A]", "%.2f", battery.current(), &status);
  return status;
}

sensor_msgs::BatteryState ToMessage(const Battery& battery, const ros::Time& stamp) {
  sensor_msgs::BatteryState message;
  message.header.stamp = stamp;
  message.header.frame_id = "base_link";
  message.voltage = float(battery.voltage());
  message.current = -float(battery.current());  // Negative when discharging.
  message.charge = float(battery.charge() * battery.parameters().capacity);
  message.capacity = message.design_capacity = float(battery.parameters().capacity);
  message.percentage = float(battery.charge());
  message.power_supply_status = sensor_msgs::BatteryState::POWER_SUPPLY_STATUS_DISCHARGING;
  message.power_supply_health = sensor_msgs::BatteryState::POWER_SUPPLY_HEALTH_GOOD;
  message.power_supply_technology = sensor_msgs::BatteryState::POWER_SUPPLY_TECHNOLOGY_LIPO;
  message.present = true;
  return message;
}

}  // namespace

Diagnostics::Diagnostics(ros::NodeHandle handle, const Simulation& simulation, Mode mode)
    : mode_(mode),
      diagnostics_(handle.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10)) {
  if (simulation.vehicle().battery() == nullptr) return;
  battery_ = handle.advertise<sensor_msgs::BatteryState>(
      simulation.cast().vehicle().name + "/battery_state", 10);
}

void Diagnostics::Publish(const Simulation& simulation, const Pace& pace,
                          const ros::Time& stamp) const {
  diagnostic_msgs::DiagnosticArray message;
  message.header.stamp = stamp;
  message.status.push_back(OfPace(simulation, pace, mode_));
  const MobileRobot& vehicle = simulation.vehicle();
  if (const Battery* battery = vehicle.battery()) {
    message.status.push_back(
        OfBattery(*battery, vehicle.ready(), simulation.cast().vehicle().name));
    battery_.publish(ToMessage(*battery, stamp));
  }
  diagnostics_.publish(message);
}

}  // namespace tld_follower::sim
