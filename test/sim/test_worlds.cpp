// SPDX-License-Identifier: BSD-3-Clause
// The worlds of the package: what they promise, and terrain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/distance.h"
#include "support.h"

namespace tld_follower::sim {
namespace {

World Load(const std::string& name) {
  const std::string file = WorldFile(name);
  return LoadWorld(file, Resources::ForWorld(file), ThrowWarning);
}

// Distance of a box from everything in a world but its ground.
double FreeSpace(const Physics& physics, const btVector3& edges, const btVector3& middle) {
  const btBoxShape box(edges / 2);
  const btTransform pose(btQuaternion::getIdentity(), middle);
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < physics.objects().size(); ++i) {
    const btCollisionObject& object = *physics.objects()[i];
    if (object.getCollisionShape()->isConcave()) continue;
    nearest = std::min(
        nearest, Distance(box, pose, *object.getCollisionShape(), object.getWorldTransform()));
  }
  return nearest;
}

TEST(Worlds, AllStartOneMetreBehindTheTargetWithinTheirTriangles) {
  for (const char* name : {"citadel.world", "corridor.world", "empty.world", "target_drone.world",
                           "testing_grounds.world", "ugv.world"}) {
    Simulation simulation(FlightConfig(name), ThrowWarning);
    EXPECT_LE(simulation.triangles(), 15000) << name;
    RunUntil(5, &simulation);
    const Truth truth = simulation.Measure();
    EXPECT_NEAR(truth.distance, 1.0, 0.01) << name;
    EXPECT_EQ(truth.collisions, 0u) << name;
  }
}

TEST(Worlds, TestingGroundsHasAGateToFlyThrough) {
  const World world = Load("testing_grounds.world");
  const Physics physics(world);
  EXPECT_GT(FreeSpace(physics, {2, 5, btScalar(2.5)}, {17, 0, btScalar(1.5)}), 0);
  EXPECT_LT(FreeSpace(physics, {2, 6, btScalar(2.5)}, {17, 0, btScalar(1.5)}), 0);
}

TEST(Worlds, CorridorLetsAHuskyThroughAndNothingBeside) {
  const World world = Load("corridor.world");
  const Physics physics(world);
  for (double x = -3; x < 29; x += 0.25) {
    const double y = std::abs(x - 20) < 2 ? 0.35 : 0.0;
    EXPECT_GT(FreeSpace(physics, {btScalar(0.99), btScalar(0.69), btScalar(1.5)},
                        {btScalar(x), btScalar(y), btScalar(0.8)}),
              0.1)
        << x;
    EXPECT_LT(FreeSpace(physics, {btScalar(0.99), 4, btScalar(1.5)},
                        {btScalar(x), btScalar(y), btScalar(0.8)}),
              0)
        << x;
  }
}

TEST(Worlds, HuskyDrivesUpToTheCitadelAndThroughItsGate) {
  SimulationConfig config = FlightConfig("citadel.world");
  config.cast.target_place = Placement{-24, 0, 0};
  Simulation simulation(config, ThrowWarning);
  RunUntil(22, &simulation, [&] { simulation.target().Command({1, 0, 0}, 0, simulation.time()); });
  const btTransform pose = simulation.target().body().Pose();
  EXPECT_GT(pose.getOrigin().x(), -5);
  EXPECT_NEAR(pose.getOrigin().y(), 0, 0.7);
  EXPECT_NEAR(pose.getOrigin().z(), 3.5 + 0.1325, 0.02) << "it stands in or above the ground";
  EXPECT_GT(pose.getBasis()[2][2], 0.99);
}

TEST(Worlds, StartsOnTheHillAreAboveItsGround) {
  SimulationConfig config = FlightConfig("citadel.world");
  config.cast.vehicle_place = Placement{-13, 0, 0};
  Simulation simulation(config, ThrowWarning);
  RunUntil(6, &simulation);
  EXPECT_TRUE(simulation.vehicle().ready());
  EXPECT_EQ(simulation.Measure().collisions, 0u);
  // 0.65 m above the highest ground around it, on a slope of a fifth.
  const double height = simulation.ReadRange();
  EXPECT_NEAR(height, 0.65 + 0.6 * 0.2, 0.06);
  // Half the drone's height is 0.04 m; the slope beside it is nearer than what is below.
  EXPECT_LT(simulation.Measure().clearance, height - 0.04);
  EXPECT_GT(simulation.Measure().clearance, 0.6);
}

TEST(Terrain, HasTheHeightsOfItsImageForPhysicsAndPictureAlike) {
  // 16 bits, as its largest value says.
  const TemporaryFile file(
      "terrain.pgm", "P2 4 3 65535 60000 20000 100 30000 500 65535 40000 0 9000 7 50000 33000\n");
  const auto terrain = std::make_shared<const Terrain>(LoadTerrain(file.path(), {6, 4, 2}));
  EXPECT_NEAR(terrain->Height(-3, 2), 2 * 60000 / 65535.0, 1e-5);
  EXPECT_NEAR(terrain->Height(-1, 0), 2.0, 1e-5);
  EXPECT_NEAR(terrain->Height(3, -2), 2 * 33000 / 65535.0, 1e-5);
  EXPECT_EQ(terrain->Height(3.1, 0), 0);

  World world;
  Model model;
  Collision collision;
  collision.geometry.type = Geometry::Type::kTerrain;
  collision.geometry.size = terrain->size;
  collision.geometry.terrain = terrain;
  model.collisions.push_back(collision);
  world.models.push_back(model);
  const Physics physics(world);
  const Mesh mesh = MakePrimitive(collision.geometry, 1);
  EXPECT_EQ(mesh.indices.size(), size_t(3 * 2 * 3 * 2));
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {  // The middle of each triangle drawn.
    btVector3 middle(0, 0, 0);
    for (size_t corner = i; corner < i + 3; ++corner) {
      const float* p = mesh.vertices[mesh.indices[corner]].position;
      middle += btVector3(p[0], p[1], p[2]) / 3;
    }
    EXPECT_NEAR(terrain->Height(middle.x(), middle.y()), middle.z(), 1e-4);
    const btVector3 above(middle.x(), middle.y(), 5);
    EXPECT_NEAR(5 - physics.CastRay(above, {0, 0, -1}, 10, nullptr), middle.z(), 1e-3);
  }
  const btCollisionObject& ground = *physics.objects()[0];
  btSphereShape ball(btScalar(0.1));
  const auto distance_at = [&](const btVector3& place) {
    return Distance(ball, btTransform(btQuaternion::getIdentity(), place),
                    *ground.getCollisionShape(), ground.getWorldTransform());
  };
  const btVector3 corner(-3, 2, btScalar(terrain->Height(-3, 2)));
  EXPECT_NEAR(distance_at(corner + btVector3(-1, 0, 0)), 0.9, 0.01);
  EXPECT_EQ(distance_at({0, 0, 30}), std::numeric_limits<double>::infinity());
}

TEST(Terrain, UnreadableHeightmapsAreOneSentence) {
  const auto error_of = [](const std::string& heightmap) -> std::string {
    const TemporaryFile file(
        "terrain.world",
        "<sdf version='1.6'><world name='w'><model name='hill'><static>true"
        "</static><link name='l'><collision name='c'><geometry><heightmap>" +
            heightmap + "</heightmap></geometry></collision></link></model></world></sdf>");
    try {
      LoadWorld(file.path(), Resources({"/"}), ThrowWarning);
    } catch (const std::exception& problem) {
      return problem.what();
    }
    return "";
  };
  const TemporaryFile text("no_image.png", "no image");
  EXPECT_NE(error_of("<uri>no_such.png</uri><size>1 1 1</size>").find("no_such.png"),
            std::string::npos);
  EXPECT_NE(error_of("<uri>" + text.path() + "</uri><size>1 1 1</size>").find("no grey image"),
            std::string::npos);
  EXPECT_NE(error_of("<uri>" + text.path() + "</uri><size>1 0 1</size>").find("size"),
            std::string::npos);
}

}  // namespace
}  // namespace tld_follower::sim
