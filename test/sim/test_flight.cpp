// SPDX-License-Identifier: BSD-3-Clause
// The drone alone: take-off, hover, steps, limits, bad commands, sensors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support.h"

namespace tld_follower::sim {
namespace {

class Flight : public testing::Test {
 protected:
  static SimulationConfig Config() {
    SimulationConfig config = FlightConfig();
    config.cast.target_place = Placement{0, 20, 0};
    config.cast.vehicle_place = Placement{0, 0, 0.5};
    return config;
  }

  btVector3 Place() const { return simulation_.vehicle().body().Pose().getOrigin(); }
  btVector3 Velocity() const { return simulation_.vehicle().body().Velocity(); }
  double Yaw() const { return Heading(simulation_.vehicle().body().Pose().getBasis()); }
  void Command(double x, double y, double z, double yaw_rate) {
    simulation_.vehicle().Command({x, y, z}, yaw_rate, simulation_.time());
  }
  /// Velocity along the heading at take-off.
  double Forward() const { return Velocity().x() * std::cos(0.5) + Velocity().y() * std::sin(0.5); }

  Simulation simulation_{Config(), ThrowWarning};
};

TEST_F(Flight, TakesOffAndHoversInPlace) {
  RunUntil(5, &simulation_);
  ASSERT_TRUE(simulation_.vehicle().ready());
  double off = 0;
  RunUntil(15, &simulation_, [&] {
    off = std::max<double>(off, (Place() - btVector3(0, 0, btScalar(0.65))).length());
  });
  EXPECT_LT(off, 0.01);
  EXPECT_NEAR(Yaw(), 0.5, 0.002);
  EXPECT_EQ(simulation_.Measure().collisions, 0u);
}

TEST_F(Flight, DoesNotObeyBeforeItHasTakenOff) {
  RunUntil(1, &simulation_, [&] { Command(1, 0, 0, 0); });
  EXPECT_FALSE(simulation_.vehicle().ready());
  EXPECT_LT(std::hypot(Place().x(), Place().y()), 0.01);
}

TEST_F(Flight, AnswersAVelocityStepQuicklyAndWithoutSwinging) {
  RunUntil(6, &simulation_);
  double rise = 0, peak = 0, low = 1, high = 0;
  RunUntil(10, &simulation_, [&] {
    Command(1, 0, 0, 0);
    if (rise == 0 && Forward() >= 0.9) rise = simulation_.time() - 6;
    peak = std::max(peak, Forward());
    low = std::min<double>(low, Place().z());
    high = std::max<double>(high, Place().z());
  });
  EXPECT_GT(rise, 0.2);  // Faster would need more tilt than the limit allows.
  EXPECT_LT(rise, 0.7);
  EXPECT_LT(peak, 1.06);
  EXPECT_NEAR(Forward(), 1.0, 0.02);
  EXPECT_GT(low, 0.62);
  EXPECT_LT(high, 0.68);
}

TEST_F(Flight, TiltsNoFurtherThanItsLimit) {
  RunUntil(6, &simulation_);
  double tilt = 0;
  RunUntil(8, &simulation_, [&] {
    Command(100, 0, 0, 0);
    tilt = std::max<double>(tilt, std::acos(simulation_.vehicle().body().Pose().getBasis()[2][2]));
  });
  EXPECT_GT(tilt, 0.3);
  EXPECT_LT(tilt, 0.38);
  EXPECT_GT(Place().z(), 0.55);
}

TEST_F(Flight, TurnsAndClimbsAsCommanded) {
  RunUntil(6, &simulation_);
  RunUntil(8, &simulation_, [&] { Command(0, 0, 0.3, -0.4); });
  EXPECT_NEAR(Velocity().z(), 0.3, 0.03);
  RunUntil(11, &simulation_);
  EXPECT_NEAR(Yaw(), 0.5 - 2 * 0.4, 0.25);  // Turns on until the command is too old.
  EXPECT_NEAR(Place().z(), 0.65 + 2 * 0.3, 0.2);
  EXPECT_LT(Velocity().length(), 0.05);
}

TEST_F(Flight, HoversWhenCommandsStop) {
  RunUntil(6, &simulation_);
  RunUntil(8, &simulation_, [&] { Command(1, 0, 0, 0); });
  RunUntil(8.4, &simulation_);
  EXPECT_GT(Forward(), 0.9) << "the last command holds for half a second";
  RunUntil(11, &simulation_);
  const btVector3 place = Place();
  RunUntil(16, &simulation_);
  EXPECT_LT((Place() - place).length(), 0.1);
  EXPECT_LT(Velocity().length(), 0.01);
}

TEST_F(Flight, RefusesCommandsThatAreNotFinite) {
  RunUntil(6, &simulation_);
  RunUntil(8, &simulation_, [&] { Command(1, 0, 0, 0); });
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  MobileRobot& spiri = simulation_.vehicle();
  EXPECT_FALSE(spiri.Command({nan, 0, 0}, 0, simulation_.time()));
  EXPECT_FALSE(spiri.Command({0, 0, inf}, 0, simulation_.time()));
  EXPECT_TRUE(spiri.Command({1e300, -1e300, 1e300}, 1e300, simulation_.time())) << "clipped";
  EXPECT_FALSE(spiri.Command({0, 0, 0}, nan, simulation_.time()));
  RunUntil(10.5, &simulation_);
  EXPECT_LT(Velocity().length(), 0.05);
  EXPECT_NEAR(Place().z(), 0.65, 0.02);
}

TEST_F(Flight, SensorsAreNoisyButRight) {
  RunUntil(6, &simulation_);
  RunUntil(10, &simulation_, [&] { Command(0.5, 0, 0, 0); });
  const btTransform start(btQuaternion(btVector3(0, 0, 1), btScalar(0.5)), {0, 0, 0});
  const btVector3 travelled = start.inverse() * Place();
  const btVector3 measured = simulation_.sensors().odometry().pose.getOrigin();
  EXPECT_NEAR(measured.x(), travelled.x(), 0.25);
  EXPECT_NEAR(measured.y(), travelled.y(), 0.25);
  EXPECT_NE(measured.x(), travelled.x());
  double range = 0;
  for (int i = 0; i < 50; ++i) range += simulation_.ReadRange() / 50;
  EXPECT_NEAR(range, Place().z(), 0.02);

  btVector3 mean(0, 0, 0);
  int count = 0;
  RunUntil(14, &simulation_);
  RunUntil(18, &simulation_, [&] {
    mean += simulation_.sensors().imu().acceleration;
    ++count;
  });
  mean /= btScalar(count);
  EXPECT_NEAR(mean.z(), 9.81, 0.1);
  EXPECT_NEAR(mean.x(), 0, 0.1);
}

TEST(FlightSetup, RotorsThatCannotLiftAreAnError) {
  SimulationConfig config = FlightConfig();
  config.cast.spiri.max_rotor_speed = 300;
  EXPECT_THROW(Simulation(config, ThrowWarning), std::runtime_error);
}

}  // namespace
}  // namespace tld_follower::sim
