// SPDX-License-Identifier: BSD-3-Clause
// The whole: worlds, timing, truth, determinism, reset.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "sim/distance.h"
#include "support.h"

namespace tld_follower::sim {
namespace {

// Everything that one run shows: images of some frames, and the last poses, byte by byte.
std::vector<uint8_t> Record(Simulation* simulation) {
  std::vector<uint8_t> record;
  StereoImages images;
  const auto append = [&record](const void* data, size_t size) {
    const auto* bytes = static_cast<const uint8_t*>(data);
    record.insert(record.end(), bytes, bytes + size);
  };
  while (simulation->frame() < 150) {
    if (!simulation->Advance().frame) continue;
    const double wave = std::sin(double(simulation->frame()) * 0.1);
    simulation->vehicle().Command({0.8 * wave, 0, 0}, 0.3 * wave, simulation->time());
    simulation->target().Command({0.7, 0, 0}, 0.5 * wave, simulation->time());
    if (simulation->frame() % 30 == 0) {
      simulation->Render(&images, nullptr);
      append(images.left.data(), images.left.size());
      append(images.right.data(), images.right.size());
    }
  }
  for (const Body& body : {simulation->vehicle().body(), simulation->target().body()}) {
    const btTransform pose = body.Pose();
    append(&pose.getOrigin(), 3 * sizeof(btScalar));
    const btVector3 velocity = body.Velocity();
    append(&velocity, 3 * sizeof(btScalar));
  }
  const btVector3 odometry = simulation->sensors().odometry().pose.getOrigin();
  append(&odometry, 3 * sizeof(btScalar));
  return record;
}

TEST(Simulation, RunsAreBitIdenticalAlsoAfterAReset) {
  SimulationConfig config;
  config.world_file = WorldFile("testing_grounds.world");
  config.camera.width = 320;
  config.camera.height = 240;
  config.seed = 5;
  Simulation first(config, ThrowWarning);
  const std::vector<uint8_t> record = Record(&first);
  Simulation second(config, ThrowWarning);
  EXPECT_EQ(Record(&second), record) << "a fresh simulation differs";
  first.Reset();
  EXPECT_EQ(first.time_ns(), 0);
  EXPECT_EQ(Record(&first), record) << "a reset simulation differs";
  config.seed = 6;
  Simulation other(config, ThrowWarning);
  EXPECT_NE(Record(&other), record) << "the seed does nothing";
}

TEST(Simulation, FramesFallOnTheNearestPhysicsStep) {
  Simulation simulation(FlightConfig(), ThrowWarning);
  int ticks = 0;
  while (simulation.time() < 2) {
    const Moment moment = simulation.Advance();
    ticks += moment.tick;
    if (moment.frame) {
      EXPECT_NEAR(simulation.time(), double(simulation.frame()) / 30, 0.001 + 1e-9);
    }
  }
  EXPECT_EQ(simulation.frame(), 60u);
  EXPECT_EQ(ticks, 200);
}

TEST(Simulation, StartsOneMetreBehindTheTarget) {
  Simulation simulation(FlightConfig("testing_grounds.world"), ThrowWarning);
  RunUntil(8, &simulation);
  const Truth truth = simulation.Measure();
  EXPECT_NEAR(truth.distance, 1.0, 0.01);
  EXPECT_NEAR(truth.clearance, 0.61, 0.01);  // The ground; half the drone's height is 0.04 m.
}

TEST(Simulation, TargetFillsTheMiddleOfTheFirstView) {
  SimulationConfig config;
  config.world_file = WorldFile("testing_grounds.world");
  Simulation simulation(config, ThrowWarning);
  RunUntil(6, &simulation);
  StereoImages images;
  TargetMask mask;
  simulation.Render(&images, &mask);
  EXPECT_NEAR(mask.x + mask.width / 2.0, 320, 25);
  EXPECT_GT(mask.width, 250);
  EXPECT_LT(mask.width, 400);
  EXPECT_GT(mask.pixels, mask.width * mask.height / 2);
}

TEST(Simulation, LaneStaysFree) {
  const std::string file = WorldFile("testing_grounds.world");
  const World world = LoadWorld(file, Resources::ForWorld(file), ThrowWarning);
  const Physics physics(world);
  btBoxShape lane({17, btScalar(2.5), btScalar(1.45)});
  const btTransform middle(btQuaternion::getIdentity(), {13, 0, btScalar(1.5)});
  for (int i = 0; i < physics.objects().size(); ++i) {
    const btCollisionObject* object = physics.objects()[i];
    EXPECT_GT(Distance(lane, middle, *object->getCollisionShape(), object->getWorldTransform()), 0);
  }
}

TEST(Simulation, CountsTouchesOfTheDrone) {
  SimulationConfig config = FlightConfig();
  config.cast.target_place = Placement{1.5, 0, 0};
  config.cast.vehicle_place = Placement{0, 0, 0};
  config.cast.spiri.take_off_altitude = 0.2;  // Low enough to run into the body.
  Simulation simulation(config, ThrowWarning);
  RunUntil(5, &simulation);
  EXPECT_EQ(simulation.Measure().collisions, 0u);
  RunUntil(9, &simulation, [&] { simulation.vehicle().Command({1, 0, 0}, 0, simulation.time()); });
  const Truth truth = simulation.Measure();
  EXPECT_GE(truth.collisions, 1u);
  EXPECT_LT(truth.clearance, 0.1);
}

TEST(Distance, IsExactForKnownArrangements) {
  btBoxShape box({btScalar(0.5), btScalar(0.25), btScalar(0.1)});
  box.setMargin(btScalar(0.002));
  btCollisionObject object;
  object.setCollisionShape(&box);
  object.setWorldTransform(btTransform(btQuaternion::getIdentity(), {1, 0, 0}));
  EXPECT_NEAR(Distance({-1, 0, 0}, object), 1.5, 0.002);
  EXPECT_NEAR(Distance({btScalar(-0.5), btScalar(1.25), 0}, object), std::sqrt(2.0), 0.003);
  EXPECT_LE(Distance({1, 0, 0}, object), 0);
  btStaticPlaneShape ground({0, 0, 1}, 0);
  const btTransform tilted(btQuaternion(btVector3(0, 1, 0), btScalar(M_PI / 2)), {0, 0, 2});
  EXPECT_NEAR(Distance(ground, btTransform::getIdentity(), box, tilted), 1.5, 0.002);
}

std::string ErrorOf(const std::string& world_file) {
  SimulationConfig config = FlightConfig();
  config.world_file = world_file;
  try {
    Simulation simulation(config, ThrowWarning);
  } catch (const std::exception& problem) {
    return problem.what();
  }
  return "";
}

TEST(World, ProblemsAreOneClearSentence) {
  EXPECT_NE(ErrorOf("/no/such.world").find("no such file"), std::string::npos);
  const TemporaryFile text("text.world", "this is no SDF");
  EXPECT_NE(ErrorOf(text.path()).find("cannot read the world"), std::string::npos);
  const TemporaryFile no_world("model.world", "<sdf version='1.6'></sdf>");
  EXPECT_NE(ErrorOf(no_world.path()).find("no <world>"), std::string::npos);
  const TemporaryFile no_robots("bare.world",
                                "<sdf version='1.6'><world name='bare'></world></sdf>");
  EXPECT_NE(ErrorOf(no_robots.path()).find("spiri"), std::string::npos);
  const TemporaryFile unknown(
      "unknown.world",
      "<sdf version='1.6'><world name='w'><include><uri>model://no_robot.urdf</uri></include>"
      "</world></sdf>");
  EXPECT_NE(ErrorOf(unknown.path()).find("no_robot"), std::string::npos);
}

// A world of one box, and what is wrong in it.
std::string BoxWorld(const std::string& gravity, const std::string& pose, const std::string& size) {
  return "<sdf version='1.6'><world name='w'><gravity>" + gravity +
         "</gravity><model name='m'><static>true</static><pose>" + pose +
         "</pose><link name='l'><collision name='c'><geometry><box><size>" + size +
         "</size></box></geometry></collision></link></model></world></sdf>";
}

TEST(World, NumbersThatCannotBeMeantAreOneSentenceThatNamesTheFile) {
  const std::string down = "0 0 -9.81", origin = "0 0 0 0 0 0", cube = "1 1 1";
  const std::pair<const char*, std::string> cases[] = {
      {"include", BoxWorld(down, origin, cube)},  // Nothing but the robots is missing.
      {"gravity", BoxWorld("0 0 nan", origin, cube)},
      {"gravity", BoxWorld("0 0", origin, cube)},
      {"pose", BoxWorld(down, "0 nan 0 0 0 0", cube)},
      {"pose", BoxWorld(down, "0 0 0 0 inf 0", cube)},
      {"pose", BoxWorld(down, "0 0 0", cube)},
      {"size", BoxWorld(down, origin, "1 nan 1")},
      {"size", BoxWorld(down, origin, "1 1")},
      {"size", BoxWorld(down, origin, "1 0 1")},
      {"size", BoxWorld(down, origin, "1 -1 1")},
  };
  for (const auto& [word, text] : cases) {
    const TemporaryFile file("numbers.world", text);
    testing::internal::CaptureStderr();
    const std::string error = ErrorOf(file.path());
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << text;
    EXPECT_NE(error.find(file.path()), std::string::npos) << text << ": " << error;
    EXPECT_NE(error.find(word), std::string::npos) << text << ": " << error;
  }
}

TEST(World, ReadsPosesMaterialsAndRobots) {
  const std::string file = WorldFile("testing_grounds.world");
  Warnings warnings;
  const World world = LoadWorld(file, Resources::ForWorld(file), warnings.Sink());
  EXPECT_TRUE(warnings.lines.empty());
  EXPECT_GT(world.models.size(), 20u);
  EXPECT_EQ(world.models[0].visuals[0].material.texture_size, 3.0);
  EXPECT_EQ(world.models[0].visuals[0].material.light_map, "media/ground_map.png");
  EXPECT_NEAR(world.Robot({"spiri"}).pose.getOrigin().x(), -1.5, 1e-6);
  EXPECT_THROW(world.Robot({"rover"}), std::runtime_error);
}

TEST(World, MayLieAnywhere) {
  std::ifstream original(WorldFile("empty.world"));
  std::stringstream text;
  text << original.rdbuf();
  const TemporaryFile copy("anywhere.world", text.str());
  EXPECT_EQ(ErrorOf(copy.path()), "");
}

TEST(World, ReadsFrictionAndColourAndFillsInWhatIsLeftOut) {
  const std::string text = R"(<sdf version='1.6'><world name='w'>
      <model name='m'><static>true</static><pose>1 2 0 0 0 1.5707963</pose><link name='l'>
        <pose>1 0 0 0 0 0</pose>
        <collision name='c'><geometry><box><size>1 2 3</size></box></geometry>
          <surface><friction><ode><mu>0.25</mu></ode></friction></surface></collision>
        <collision name='d'><geometry><sphere><radius>0.5</radius></sphere></geometry></collision>
        <visual name='v'><geometry><box><size>1 2 3</size></box></geometry>
          <material><diffuse>1 0.5 0 1</diffuse></material></visual>
        <visual name='u'><geometry><cylinder><radius>0.1</radius><length>2</length></cylinder>
          </geometry><material><pbr><metal><albedo_map>a.png</albedo_map></metal></pbr></material>
        </visual></link></model></world></sdf>)";
  const TemporaryFile file("w.world", text);
  const World world = LoadWorld(file.path(), Resources({}), ThrowWarning);
  const Model& model = world.models.at(0);
  EXPECT_NEAR(model.collisions[0].friction, 0.25, 1e-9);
  EXPECT_NEAR(model.collisions[1].friction, 1.0, 1e-9);
  EXPECT_LT((model.collisions[0].pose.getOrigin() - btVector3(1, 3, 0)).length(), 1e-5);
  EXPECT_NEAR(model.visuals[0].material.colour[1], 0.5, 1e-6);
  EXPECT_EQ(model.visuals[1].material.colour[1], 1.f);
  EXPECT_EQ(model.visuals[1].material.texture, "a.png");

  Warnings warnings;
  const std::string loose =
      "<sdf version='1.6'><world name='w'><model name='m'><link name='l'/>"
      "</model></world></sdf>";
  const TemporaryFile moving("loose.world", loose);
  LoadWorld(moving.path(), Resources({}), warnings.Sink());
  EXPECT_EQ(warnings.lines.size(), 1u);
}

std::string MovingWorld(const std::string& waypoints) {
  return "<sdf version='1.6' xmlns:tld='urn:tld_follower'><world name='w'><model name='slab'>" +
         waypoints +
         "<link name='l'><collision name='c'><geometry><box><size>0.2 1 1</size></box></geometry>"
         "</collision></link></model><include><uri>" +
         WorldFile("spiri.urdf") +
         "</uri><name>spiri</name><pose>0 0 0.0405 0 0 0</pose></include><include><uri>" +
         WorldFile("husky.urdf") +
         "</uri><name>husky</name><pose>5 0 0.1325 0 0 0</pose></include></world></sdf>";
}

TEST(World, ScriptsLeadFromWaypointToWaypoint) {
  const TemporaryFile file("script.world",
                           MovingWorld("<tld:waypoint>1 2 0 0 0 0 0</tld:waypoint>"
                                       "<tld:waypoint>3 4 -6 1 0 0 1.5707963</tld:waypoint>"));
  const World world = LoadWorld(file.path(), Resources({}), ThrowWarning);
  const Model& slab = world.models.at(0);
  const auto expect_at = [&slab](double time, const btVector3& place, double yaw) {
    const btTransform pose = slab.PoseAt(time);
    EXPECT_LT((pose.getOrigin() - place).length(), 1e-5) << "at " << time << " s";
    const btVector3 ahead = pose.getBasis() * btVector3(1, 0, 0);
    EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), yaw, 1e-5) << "at " << time << " s";
  };
  expect_at(0, {2, 0, 0}, 0);
  expect_at(1, {2, 0, 0}, 0);
  expect_at(2, {3, -3, 0.5}, 0.78539816);
  expect_at(3, {4, -6, 1}, 1.5707963);
  expect_at(9, {4, -6, 1}, 1.5707963);
}

TEST(World, ScriptsThatCannotBeMeantAreRefused) {
  for (const char* waypoints :
       {"<tld:waypoint>1 2 0 0 0 0</tld:waypoint>", "<tld:waypoint>1 2 0 0 0 0 0 0</tld:waypoint>",
        "<tld:waypoint>soon</tld:waypoint>",
        "<tld:waypoint>1 0 0 0 0 0 0</tld:waypoint><tld:waypoint>1 1 0 0 0 0 0</tld:waypoint>"}) {
    const TemporaryFile file("script.world", MovingWorld(waypoints));
    EXPECT_NE(ErrorOf(file.path()).find("slab"), std::string::npos) << waypoints;
  }
}

TEST(Simulation, WhatMovesOnAScriptIsThereForClearanceAndContacts) {
  const TemporaryFile file("script.world",
                           MovingWorld("<tld:waypoint>4 2 0 0.65 0 0 0</tld:waypoint>"
                                       "<tld:waypoint>6 0.2 0 0.65 0 0 0</tld:waypoint>"));
  SimulationConfig config = FlightConfig();
  config.world_file = file.path();
  Simulation simulation(config, ThrowWarning);
  RunUntil(4, &simulation);
  const double before = simulation.Measure().clearance;
  RunUntil(5, &simulation);
  EXPECT_NEAR(before - simulation.Measure().clearance, 0.9, 0.05);
  RunUntil(6, &simulation);
  EXPECT_EQ(simulation.Measure().collisions, 1u);
}

TEST(Robot, HuskyHasItsWheelsAndMass) {
  const Robot robot = LoadRobot(WorldFile("husky.urdf"));
  double mass = 0;
  for (const RobotLink& link : robot.links) mass += link.mass;
  EXPECT_NEAR(mass, 46.034 + 4 * 2.637, 1e-6);
  EXPECT_NEAR(robot.MovedBy("rear_right_wheel").pose.getOrigin().y(), -0.2854, 1e-6);
  EXPECT_THROW(robot.MovedBy("fifth_wheel"), std::runtime_error);
  EXPECT_THROW(LoadRobot("/no/such.urdf"), std::runtime_error);
  const TemporaryFile broken("broken.urdf", "<robot name='r'><link name='a'>");
  EXPECT_THROW(LoadRobot(broken.path()), std::runtime_error);
}

}  // namespace
}  // namespace tld_follower::sim
