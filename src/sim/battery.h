// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tld_follower::sim {

/// A pack of lithium cells; config/spiri.yaml gives each number's source.
struct BatteryParameters {
  double capacity = 1.3;        ///< [A h]
  double full_voltage = 12.6;   ///< At rest [V].
  double empty_voltage = 9.9;   ///< At rest [V].
  double resistance = 0.06;     ///< [Ohm]
  double initial_charge = 1.0;  ///< Share of the capacity at the start, 0..1.
};

/// A voltage that falls evenly with the charge, behind a resistance.
class Battery {
 public:
  explicit Battery(const BatteryParameters& parameters);

  /// Delivers `power` [W] for `dt` [s]: as much of it as there is.
  void Drain(double power, double dt);

  const BatteryParameters& parameters() const { return parameters_; }
  double charge() const { return charge_; }    ///< Share of the capacity that is left, 0..1.
  double current() const { return current_; }  ///< [A]
  double voltage() const { return voltage_; }  ///< Under load [V].

 private:
  double RestVoltage() const;

  BatteryParameters parameters_;
  double charge_, current_ = 0, voltage_;
};

}  // namespace tld_follower::sim
