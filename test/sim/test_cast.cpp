// SPDX-License-Identifier: BSD-3-Clause
// The other casts: a drone as target, a ground vehicle that carries the cameras.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support.h"

namespace tld_follower::sim {
namespace {

btVector3 PlaceOf(const MobileRobot& robot) { return robot.body().Pose().getOrigin(); }

TEST(TargetDrone, HoversWhereItStartsOneMetreAheadInView) {
  SimulationConfig config;
  config.world_file = WorldFile("target_drone.world");
  Simulation simulation(config, ThrowWarning);
  const btVector3 start = PlaceOf(simulation.target());
  double off = 0;
  RunUntil(8, &simulation,
           [&] { off = std::max<double>(off, (PlaceOf(simulation.target()) - start).length()); });
  EXPECT_LT(off, 0.01);
  EXPECT_TRUE(simulation.target().ready());
  EXPECT_NEAR(simulation.Measure().distance, 1.0, 0.01);
  StereoImages images;
  TargetMask mask;
  simulation.Render(&images, &mask);
  EXPECT_NEAR(mask.x + mask.width / 2.0, 320, 25);
  EXPECT_GT(mask.width, 180);
  EXPECT_GT(mask.height, 80);
  EXPECT_GT(mask.pixels, 8000);
}

TEST(TargetDrone, ObeysAllFourCommandsInItsYawFrame) {
  SimulationConfig config = FlightConfig("target_drone.world");
  config.cast.target_place = Placement{0, 0, M_PI / 2};
  Simulation simulation(config, ThrowWarning);
  RunUntil(2, &simulation);
  const btVector3 start = PlaceOf(simulation.target());
  RunUntil(4, &simulation, [&] {
    simulation.target().Command({0.5, 0.2, 0.3}, 0, simulation.time());
  });
  const btVector3 moved = PlaceOf(simulation.target()) - start;
  EXPECT_NEAR(moved.x(), -0.4, 0.15);
  EXPECT_NEAR(moved.y(), 1.0, 0.25);
  EXPECT_NEAR(moved.z(), 0.6, 0.1);
  RunUntil(6, &simulation, [&] { simulation.target().Command({0, 0, 0}, 0.5, simulation.time()); });
  EXPECT_NEAR(Heading(simulation.target().body().Pose().getBasis()), M_PI / 2 + 1, 0.3);
  // Its own odometry is in the frame of its start.
  const OdometrySample odometry = simulation.target().Odometry();
  EXPECT_GT(odometry.pose.getOrigin().x(), 0.8);
  EXPECT_NEAR(odometry.angular_velocity.z(), 0.5, 0.05);
}

TEST(TargetDrone, DoesNotDisturbTheOther) {
  Simulation simulation(FlightConfig("target_drone.world"), ThrowWarning);
  RunUntil(5, &simulation);
  EXPECT_TRUE(simulation.vehicle().ready());
  const btVector3 start = PlaceOf(simulation.vehicle());
  RunUntil(7, &simulation, [&] { simulation.target().Command({1, 0, 0}, 0, simulation.time()); });
  EXPECT_LT((PlaceOf(simulation.vehicle()) - start).length(), 0.01);
  EXPECT_GT(simulation.Measure().distance, 2.0);
}

class GroundVehicle : public testing::Test {
 protected:
  static SimulationConfig Config() {
    SimulationConfig config = FlightConfig("ugv.world");
    config.camera.width = 320;
    config.camera.height = 240;
    return config;
  }

  Simulation simulation_{Config(), ThrowWarning};
};

TEST_F(GroundVehicle, SeesTheTargetOneMetreAheadAndNothingOfItself) {
  RunUntil(3, &simulation_);
  const Truth truth = simulation_.Measure();
  EXPECT_NEAR(truth.distance, 1.0, 0.01);
  // Bumper to bumper: what it stands on does not count.
  EXPECT_NEAR(truth.clearance, 1.72 - 0.9874, 0.01);
  EXPECT_EQ(truth.collisions, 0u);
  StereoImages images;
  TargetMask mask;
  simulation_.Render(&images, &mask);
  EXPECT_NEAR(mask.x + mask.width / 2.0, 160, 12);
  EXPECT_GT(mask.width, 125);
  EXPECT_GT(mask.y, 20);
  EXPECT_LT(mask.y + mask.height, 220);

  SimulationConfig bare = Config();  // The same picture from a drone in its place has no vehicle.
  bare.world_file = WorldFile("empty.world");
  bare.image_noise = 0;
  SimulationConfig carried = Config();
  carried.image_noise = 0;
  bare.cast.vehicle_place = Placement{-1.72 + 0.30 - 0.08, -0.005, 0};
  bare.cast.spiri.take_off_altitude = 0.1325 + 0.50 + 0.0165;
  Simulation drone(bare, ThrowWarning), rover(carried, ThrowWarning);
  RunUntil(8, &drone);
  RunUntil(8, &rover);
  StereoImages from_air, from_ground;
  drone.Render(&from_air, nullptr);
  rover.Render(&from_ground, nullptr);
  size_t differing = 0;  // In the lowest rows, where its own deck would be.
  const size_t first = size_t(200 * 320 * 3);
  for (size_t i = first; i < from_air.left.size(); ++i) {
    differing += std::abs(int(from_air.left[i]) - int(from_ground.left[i])) > 60;
  }
  EXPECT_LT(double(differing) / double(from_air.left.size() - first), 0.05);
}

TEST_F(GroundVehicle, ObeysSpeedAndYawRateAlone) {
  RunUntil(1, &simulation_);
  const btVector3 start = PlaceOf(simulation_.vehicle());
  RunUntil(3, &simulation_, [&] {
    simulation_.vehicle().Command({-0.5, 0.7, 0.9}, 0, simulation_.time());
  });
  const btVector3 moved = PlaceOf(simulation_.vehicle()) - start;
  EXPECT_NEAR(moved.x(), -0.95, 0.06);
  EXPECT_NEAR(moved.y(), 0, 0.05);
  EXPECT_NEAR(moved.z(), 0, 0.01);
  const btVector3 measured = simulation_.sensors().odometry().pose.getOrigin();
  EXPECT_NEAR(measured.x(), moved.x(), 0.2);
  EXPECT_NE(measured.x(), moved.x());
  EXPECT_FALSE(simulation_.vehicle().Command({std::nan(""), 0, 0}, 0, simulation_.time()));
}

TEST_F(GroundVehicle, CountsRunningIntoTheTarget) {
  RunUntil(4, &simulation_, [&] {
    simulation_.vehicle().Command({0.6, 0, 0}, 0, simulation_.time());
  });
  const Truth truth = simulation_.Measure();
  EXPECT_GE(truth.collisions, 1u);
  EXPECT_LT(truth.clearance, 0.02);
}

TEST(Cast, AWorldNamesOneVehicleAndOneTarget) {
  const auto world = [](std::initializer_list<const char*> names) {
    std::string text = "<sdf version='1.6'><world name='w'>";
    for (const std::string name : names) {
      text +=
          "<include><uri>" + WorldFile("husky.urdf") + "</uri><name>" + name + "</name></include>";
    }
    return text + "</world></sdf>";
  };
  const auto error_of = [](const std::string& text) -> std::string {
    const TemporaryFile file("cast.world", text);
    SimulationConfig config = FlightConfig();
    config.world_file = file.path();
    try {
      Simulation simulation(config, ThrowWarning);
    } catch (const std::exception& problem) {
      return problem.what();
    }
    return "";
  };
  EXPECT_EQ(error_of(world({"ugv", "husky"})), "");
  EXPECT_NE(error_of(world({"husky"})).find("'spiri' or 'ugv'"), std::string::npos);
  EXPECT_NE(error_of(world({"ugv"})).find("'target' or 'husky'"), std::string::npos);
  EXPECT_NE(error_of(world({"ugv", "spiri", "husky"})).find("both"), std::string::npos);
}

}  // namespace
}  // namespace tld_follower::sim
