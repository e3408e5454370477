// SPDX-License-Identifier: BSD-3-Clause
// The target alone: straight drive, skid steer, ramps, time-out, odometry.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support.h"

namespace tld_follower::sim {
namespace {

class Drive : public testing::Test {
 protected:
  static SimulationConfig Config() {
    SimulationConfig config = FlightConfig();
    config.cast.vehicle_place = Placement{-10, 10, 0};
    return config;
  }

  btTransform Pose() const { return simulation_.target().body().Pose(); }
  double Speed() const {
    return simulation_.target().body().Velocity().dot(Pose().getBasis().getColumn(0));
  }
  double YawRate() const { return simulation_.target().body().AngularVelocity().z(); }
  void DriveUntil(double time, double speed, double yaw_rate) {
    RunUntil(time, &simulation_, [&] {
      simulation_.target().Command({speed, 0, 0}, yaw_rate, simulation_.time());
    });
  }

  Simulation simulation_{Config(), ThrowWarning};
};

TEST_F(Drive, StaysWhereItStands) {
  RunUntil(3, &simulation_);
  EXPECT_LT(std::hypot(Pose().getOrigin().x(), Pose().getOrigin().y()), 0.005);
  EXPECT_NEAR(Pose().getOrigin().z(), 0.1323, 0.002);
}

TEST_F(Drive, TwelveSecondsStraightAtOneMetrePerSecond) {
  DriveUntil(2, 1, 0);
  double slowest = 2, fastest = 0;
  const double start = Pose().getOrigin().x();
  RunUntil(12, &simulation_, [&] {
    simulation_.target().Command({1, 0, 0}, 0, simulation_.time());
    slowest = std::min(slowest, Speed());
    fastest = std::max(fastest, Speed());
  });
  EXPECT_NEAR(Pose().getOrigin().x() - start, 10, 0.05);
  EXPECT_NEAR(Pose().getOrigin().y(), 0, 0.1);
  EXPECT_GT(slowest, 0.98);
  EXPECT_LT(fastest, 1.02);
}

TEST_F(Drive, RampsUpAndStopsWhenCommandsStop) {
  RunUntil(1, &simulation_);
  DriveUntil(1.2, 1, 0);
  EXPECT_NEAR(Speed(), 0.6, 0.08);  // 3 m/s^2
  DriveUntil(3, 5, 0);
  EXPECT_NEAR(Speed(), 1.0, 0.02) << "commands are clipped to the limit";
  RunUntil(3.2, &simulation_);
  EXPECT_NEAR(Speed(), 1.0, 0.02) << "the last command holds for a quarter of a second";
  RunUntil(4, &simulation_);
  EXPECT_NEAR(Speed(), 0.0, 0.02);
}

TEST_F(Drive, TurnsAtTheCommandedRateAlthoughItSkids) {
  DriveUntil(2, 0, 1);
  double rate = 0;
  int count = 0;
  RunUntil(8, &simulation_, [&] {
    simulation_.target().Command({0, 0, 0}, 1, simulation_.time());
    rate += YawRate();
    ++count;
  });
  EXPECT_NEAR(rate / count, 1.0, 0.06);
  // Without the multiplier it would turn 1.875 times too slowly: wheels do 1.875 times the path.
  const double rim =
      0.1651 * (simulation_.target().Joints()[1].speed - simulation_.target().Joints()[0].speed) /
      2;
  EXPECT_NEAR(rim, 1.875 * 0.5708 / 2, 0.03);
}

TEST_F(Drive, WheelOdometryFollowsAnArc) {
  DriveUntil(6, 0.8, 0.4);
  const OdometrySample wheels = simulation_.target().Odometry();
  EXPECT_NEAR(wheels.velocity.x(), 0.8, 0.01);
  EXPECT_NEAR(wheels.angular_velocity.z(), 0.4, 0.01);
  EXPECT_NEAR(wheels.pose.getOrigin().x(), Pose().getOrigin().x(), 0.25);
  EXPECT_NEAR(wheels.pose.getOrigin().y(), Pose().getOrigin().y(), 0.25);
  EXPECT_NEAR(
      std::remainder(Heading(wheels.pose.getBasis()) - Heading(Pose().getBasis()), 2 * M_PI), 0,
      0.15);
  EXPECT_GT(simulation_.target().Joints()[0].angle, 2 * M_PI) << "wheel angles are not wrapped";
}

TEST_F(Drive, StopsOnACommandThatIsNotFinite) {
  DriveUntil(3, 1, 0);
  EXPECT_FALSE(simulation_.target().Command({std::nan(""), 0, 0}, 0, simulation_.time()));
  RunUntil(4, &simulation_);
  EXPECT_NEAR(Speed(), 0, 0.02);
}

}  // namespace
}  // namespace tld_follower::sim
