// SPDX-License-Identifier: BSD-3-Clause
// What a drone lives in and on: wind, ground effect, thrust and battery.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support.h"

namespace tld_follower::sim {
namespace {

SimulationConfig HoverConfig() {
  SimulationConfig config = FlightConfig();
  config.cast.vehicle_place = Placement{0, 0, 0};
  config.cast.target_place = Placement{0, 20, 0};
  return config;
}

btVector3 PlaceOf(const Simulation& simulation) {
  return simulation.vehicle().body().Pose().getOrigin();
}

const Spiri& SpiriOf(const Simulation& simulation) {
  return dynamic_cast<const Spiri&>(simulation.vehicle());
}

// Thrust of all rotors far from the ground [N].
double Thrust(const Simulation& simulation, const SpiriParameters& parameters) {
  double sum = 0;
  for (const double speed : SpiriOf(simulation).rotor_speeds()) {
    sum += parameters.motor_constant * speed * speed;
  }
  return sum;
}

TEST(Hover, HoldsItsPlaceForTenMinutesAndDrainsWhatItsRotorsTake) {
  const SimulationConfig config = HoverConfig();
  const SpiriParameters& spiri = config.cast.spiri;
  Simulation simulation(config, ThrowWarning);
  RunUntil(5, &simulation);
  const double before = simulation.vehicle().battery()->charge();
  double off = 0;
  RunUntil(605, &simulation, [&] {
    off = std::max<double>(off, (PlaceOf(simulation) - btVector3(0, 0, btScalar(0.65))).length());
  });
  EXPECT_LT(off, 0.02);
  EXPECT_TRUE(simulation.vehicle().ready());
  // Momentum theory by hand: each rotor carries a quarter of the weight.
  const double thrust = 0.399875 * 9.81 / 4;
  const double disc = 2 * 1.225 * M_PI * 0.1 * 0.1;
  const double power = 6 + 4 * thrust * std::sqrt(thrust / disc) / 0.5;
  const double charge = simulation.vehicle().battery()->charge();
  const double voltage = 9.9 + 2.7 * (before + charge) / 2 - 0.06 * 3.0;
  EXPECT_NEAR(before - charge, power / voltage * 600 / 3600 / spiri.battery.capacity, 0.01);
  EXPECT_NEAR(simulation.vehicle().battery()->current(), power / voltage, 0.25);
}

TEST(Rotors, NeverPushHarderThanTheirLimitAndReachIt) {
  SimulationConfig config = HoverConfig();
  config.cast.spiri.max_speed_z = 20;
  const SpiriParameters& spiri = config.cast.spiri;
  const double limit = 4 * spiri.motor_constant * spiri.max_rotor_speed * spiri.max_rotor_speed;
  Simulation simulation(config, ThrowWarning);
  RunUntil(5, &simulation);
  double most = 0, power = 0;
  RunUntil(7, &simulation, [&] {
    simulation.vehicle().Command({20, 0, 20}, 2, simulation.time());
    most = std::max(most, Thrust(simulation, spiri));
    const Battery& battery = *simulation.vehicle().battery();
    power = std::max(power, battery.current() * battery.voltage());
  });
  EXPECT_LE(most, limit);
  EXPECT_GT(most, 0.95 * limit);
  const double rotor = limit / 4;
  const double ideal = 4 * rotor * std::sqrt(rotor / (2 * 1.225 * M_PI * 0.01));
  EXPECT_LE(power, 6 + ideal / spiri.rotor_efficiency + 1e-6);
  EXPECT_GT(power, 0.9 * (6 + ideal / spiri.rotor_efficiency));
}

TEST(Wind, PushesTheDroneWhichComesBackAndLeansAgainstIt) {
  Simulation simulation(HoverConfig(), ThrowWarning);
  RunUntil(5, &simulation);
  ASSERT_TRUE(simulation.SetWind({2, 0, 0}));
  double farthest = 0;
  RunUntil(95, &simulation,
           [&] { farthest = std::max<double>(farthest, PlaceOf(simulation).x()); });
  EXPECT_GT(farthest, 0.1);
  EXPECT_LT(farthest, 0.4);
  EXPECT_LT((PlaceOf(simulation) - btVector3(0, 0, btScalar(0.65))).length(), 0.05);
  // Quadratic drag of the air that passes: 0.12 x 2^2 N against the weight.
  const btVector3 up = simulation.vehicle().body().Pose().getBasis().getColumn(2);
  EXPECT_NEAR(std::atan2(-up.x(), up.z()), std::atan(0.12 * 4 / (0.399875 * 9.81)), 0.02);
}

TEST(Wind, OfTheDronesOwnSpeedTakesItsDragAway) {
  SimulationConfig config = HoverConfig();
  config.cast.spiri.velocity_xy_i = 0;
  const auto tilt_at = [&config](const btVector3& wind) {
    Simulation simulation(config, ThrowWarning);
    RunUntil(5, &simulation);
    simulation.SetWind(wind);
    RunUntil(9, &simulation, [&] {
      simulation.vehicle().Command({2, 0, 0}, 0, simulation.time());
    });
    return simulation.vehicle().body().Pose().getBasis()[0][2];
  };
  EXPECT_GT(tilt_at({0, 0, 0}), 0.1);
  const double with_it = tilt_at({2, 0, 0});
  EXPECT_LT(std::abs(with_it), 0.02);
}

TEST(Wind, IsRefusedIfNotFiniteAndCalmAfterAReset) {
  Simulation simulation(HoverConfig(), ThrowWarning);
  EXPECT_FALSE(simulation.SetWind({btScalar(std::nan("")), 0, 0}));
  EXPECT_FALSE(simulation.SetWind({0, 1000, 0}));
  EXPECT_TRUE(simulation.SetWind({0, 5, 0}));
  simulation.Reset();
  RunUntil(5, &simulation);
  EXPECT_LT(std::abs(PlaceOf(simulation).y()), 0.01);
}

TEST(GroundEffect, CarriesPartOfTheWeightNearTheGround) {
  const auto thrust_at = [](double altitude) {
    SimulationConfig config = HoverConfig();
    config.cast.spiri.take_off_altitude = altitude;
    Simulation simulation(config, ThrowWarning);
    RunUntil(12, &simulation);
    EXPECT_NEAR(PlaceOf(simulation).z(), altitude, 0.01);
    return Thrust(simulation, config.cast.spiri);
  };
  const double weight = 0.399875 * 9.81;
  EXPECT_NEAR(thrust_at(1.0), weight, 0.005 * weight);
  const double ratio = 0.1 / (4 * 0.12);
  EXPECT_NEAR(thrust_at(0.12), weight * (1 - ratio * ratio), 0.005 * weight);
}

TEST(Battery, LosesVoltageByChargeAndLoad) {
  Battery battery(BatteryParameters{});
  EXPECT_NEAR(battery.voltage(), 12.6, 1e-9);
  battery.Drain(60, 0.002);
  EXPECT_NEAR(battery.voltage() * battery.current(), 60, 1e-6);
  EXPECT_NEAR(battery.voltage(), 12.6 - 0.06 * battery.current(), 1e-6);
  for (int second = 0; second < 2000; ++second) battery.Drain(60, 1);
  EXPECT_EQ(battery.charge(), 0);
  EXPECT_EQ(battery.current(), 0);
  EXPECT_NEAR(battery.voltage(), 9.9, 1e-9);
  Battery weak(BatteryParameters{});
  weak.Drain(1e9, 0.002);
  EXPECT_TRUE(std::isfinite(weak.voltage()));
  EXPECT_GT(weak.charge(), 0.99);
}

TEST(Battery, LandsTheDroneOnItsReserve) {
  SimulationConfig config = HoverConfig();
  config.cast.spiri.battery.initial_charge = 0.106;
  Simulation simulation(config, ThrowWarning);
  RunUntil(5, &simulation);
  EXPECT_TRUE(simulation.vehicle().ready());
  double fastest = 0;
  RunUntil(20, &simulation, [&] {
    simulation.vehicle().Command({1, 0, 1}, 0, simulation.time());
    if (!simulation.vehicle().ready()) {
      fastest = std::min<double>(fastest, simulation.vehicle().body().Velocity().z());
    }
  });
  EXPECT_FALSE(simulation.vehicle().ready());
  EXPECT_NEAR(PlaceOf(simulation).z(), 0.04, 0.01);
  EXPECT_GT(fastest, -0.8) << "it fell";
  EXPECT_NEAR(Thrust(simulation, config.cast.spiri), 0, 0.01);
  EXPECT_LT(simulation.vehicle().body().Velocity().length(), 0.01);
  EXPECT_GT(simulation.vehicle().body().Pose().getBasis()[2][2], 0.999);
  EXPECT_EQ(simulation.Measure().collisions, 0u) << "landing is none";
}

}  // namespace
}  // namespace tld_follower::sim
