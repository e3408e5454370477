// SPDX-License-Identifier: BSD-3-Clause
#include "sim/battery.h"

#include <algorithm>
#include <cmath>

namespace tld_follower::sim {

Battery::Battery(const BatteryParameters& parameters)
    : parameters_(parameters), charge_(parameters.initial_charge), voltage_(RestVoltage()) {}

double Battery::RestVoltage() const {
  return parameters_.empty_voltage +
         charge_ * (parameters_.full_voltage - parameters_.empty_voltage);
}

void Battery::Drain(double power, double dt) {
  if (charge_ <= 0) power = 0;
  // U = E - R I and P = U I; at most the power at which half the voltage is lost.
  const double rest = RestVoltage(), half = rest / 2;
  voltage_ = half + std::sqrt(std::max(0.0, half * half - parameters_.resistance * power));
  current_ = std::min(power / voltage_, half / parameters_.resistance);
  charge_ = std::max(0.0, charge_ - current_ * dt / 3600 / parameters_.capacity);
}

}  // namespace tld_follower::sim
