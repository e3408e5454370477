// SPDX-License-Identifier: BSD-3-Clause
// What pictures show beyond textures: shadows, exposure, motion blur; depth and labels of pixels.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support.h"

namespace tld_follower::sim {
namespace {

SimulationConfig PictureConfig(const std::string& world = "testing_grounds.world") {
  SimulationConfig config = FlightConfig(world);
  config.camera.width = 320;
  config.camera.height = 240;
  config.image_noise = 0;
  return config;
}

double Mean(const std::vector<uint8_t>& values) {
  double sum = 0;
  for (const uint8_t value : values) sum += value;
  return sum / double(values.size());
}

double MeanDifference(const StereoImages& a, const StereoImages& b) {
  double sum = 0;
  for (size_t i = 0; i < a.left.size(); ++i) sum += std::abs(int(a.left[i]) - int(b.left[i]));
  return sum / double(a.left.size());
}

// Pictures of some frames of a flight with a target that drives.
std::vector<StereoImages> Film(const SimulationConfig& config) {
  Simulation simulation(config, ThrowWarning);
  std::vector<StereoImages> film;
  while (simulation.frame() < 150) {
    if (!simulation.Advance().frame) continue;
    simulation.vehicle().Command({0.5, 0, 0}, 0.8, simulation.time());
    simulation.target().Command({0.5, 0, 0}, 0, simulation.time());
    if (simulation.frame() % 30 != 0) continue;
    film.emplace_back();
    simulation.Render(&film.back(), nullptr);
  }
  return film;
}

bool Same(const std::vector<StereoImages>& a, const std::vector<StereoImages>& b) {
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].left != b[i].left || a[i].right != b[i].right) return false;
  }
  return true;
}

TEST(Effects, AreRepeatableAndOffByDefault) {
  const std::function<void(CameraEffects*)> effects[] = {
      [](CameraEffects* effect) { effect->shadow_map = true; },
      [](CameraEffects* effect) { effect->exposure_change = 0.5; },
      [](CameraEffects* effect) { effect->blur_pictures = 3; },
  };
  const std::vector<StereoImages> plain = Film(PictureConfig());
  for (const auto& effect : effects) {
    SimulationConfig config = PictureConfig();
    effect(&config.effects);
    const std::vector<StereoImages> first = Film(config);
    EXPECT_TRUE(Same(first, Film(config)));
    EXPECT_FALSE(Same(first, plain));
  }
}

TEST(Effects, ExposureWandersBySeed) {
  SimulationConfig config = PictureConfig();
  config.effects.exposure_change = 0.5;
  const std::vector<StereoImages> plain = Film(PictureConfig()), film = Film(config);
  double least = 1e9, most = 0;
  for (size_t i = 0; i < film.size(); ++i) {
    const double gain = Mean(film[i].left) / Mean(plain[i].left);
    EXPECT_NEAR(Mean(film[i].right) / Mean(plain[i].right), gain, 0.02);
    least = std::min(least, gain);
    most = std::max(most, gain);
  }
  EXPECT_GT(most / least, 1.1);
  EXPECT_LT(most, 4);
  config.seed = 1;
  EXPECT_FALSE(Same(Film(config), film));
}

TEST(Effects, MotionBlursWhatMovesAlone) {
  const auto picture = [](int pictures, double yaw_rate) {
    SimulationConfig config = PictureConfig();
    config.effects.blur_pictures = pictures;
    config.effects.shutter_time = 0.03;
    Simulation simulation(config, ThrowWarning);
    RunUntil(7, &simulation, [&] {
      simulation.vehicle().Command({0, 0, 0}, yaw_rate, simulation.time());
    });
    StereoImages images;
    simulation.Render(&images, nullptr);
    return images;
  };
  EXPECT_LT(MeanDifference(picture(1, 0), picture(4, 0)), 1.5);
  EXPECT_GT(MeanDifference(picture(1, 1), picture(4, 1)), 6);
}

TEST(Effects, ShadowMapDarkensWhatStandsInTheShade) {
  // A wall's shade on a box behind it, which ground shadows leave lit.
  const auto brightness = [](bool shadow_map, bool with_wall) {
    World world;
    world.sun_direction = btVector3(btScalar(0.6), 0, btScalar(-0.8));
    Scene scene;
    SceneNode box, wall;
    box.visual.geometry.size.setValue(1, 1, 1);
    box.visual.pose.setOrigin({5, 0, btScalar(0.5)});
    wall.visual.geometry.size.setValue(btScalar(0.2), 6, btScalar(0.2));
    wall.visual.pose.setOrigin({btScalar(3.5), 0, btScalar(2.5)});  // Above the picture.
    scene.visuals.push_back(box);
    if (with_wall) scene.visuals.push_back(wall);
    StereoCamera camera;
    camera.width = camera.height = 64;
    camera.hfov = 0.1;
    camera.pitch = 0;
    camera.position.setValue(0, 0, 0);
    Renderer renderer(camera, world, scene, shadow_map, Resources({}), ThrowWarning);
    StereoImages images;
    renderer.Render(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(0.8)}), {}, &images,
                    nullptr);
    return Mean(images.left);
  };
  EXPECT_NEAR(brightness(true, false), brightness(false, false), 1);
  EXPECT_NEAR(brightness(false, true), brightness(false, false), 1);
  EXPECT_LT(brightness(true, true), 0.9 * brightness(true, false));
}

TEST(TrueView, DepthAndLabelsAreThoseOfKnownShapes) {
  StereoCamera camera;
  camera.pitch = 0;
  camera.position.setValue(0, 0, 0);
  Scene scene;
  SceneNode wall, ball;
  wall.visual.geometry.size.setValue(btScalar(0.1), 20, 2);
  wall.visual.pose.setOrigin({btScalar(4.05), 0, 0});
  wall.label = 7;
  ball.visual.geometry.type = Geometry::Type::kSphere;
  ball.visual.geometry.size.setValue(btScalar(0.3), btScalar(0.3), btScalar(0.3));
  ball.visual.pose.setOrigin({2, camera.Optical(Eye::kLeft).getOrigin().y(), 0});
  ball.label = kTargetLabel;
  scene.visuals = {wall, ball};
  Renderer renderer(camera, World(), scene, false, Resources({}), ThrowWarning);
  StereoImages images;
  TargetMask mask;
  renderer.Render(btTransform::getIdentity(), {}, &images, &mask);
  std::vector<float> depth;
  std::vector<uint8_t> labels;
  renderer.ReadDepth(&depth);
  renderer.ReadLabels(&labels);
  const auto at = [](int x, int y) { return size_t(y * 640 + x); };
  EXPECT_NEAR(depth[at(320, 240)], 1.7, 0.002);
  EXPECT_EQ(labels[at(320, 240)], kTargetLabel);
  EXPECT_NEAR(depth[at(30, 240)], 4.0, 0.001) << "along the axis, not along the ray";
  EXPECT_EQ(labels[at(30, 240)], 7);
  EXPECT_EQ(depth[at(320, 5)], std::numeric_limits<float>::infinity());
  EXPECT_EQ(labels[at(320, 5)], kSkyLabel);
  EXPECT_EQ(std::count(labels.begin(), labels.end(), kTargetLabel), mask.pixels);
}

TEST(TrueView, ShadowsDoNotChangeLabels) {
  Simulation simulation(PictureConfig(), ThrowWarning);
  RunUntil(5, &simulation);
  StereoImages images;
  simulation.Render(&images, nullptr);
  std::vector<uint8_t> labels;
  simulation.ReadLabels(&labels);
  // Target, ground (the first model), some obstacles, sky; nothing of the drone itself.
  EXPECT_EQ(std::count(labels.begin(), labels.end(), kVehicleLabel), 0);
  EXPECT_GT(std::count(labels.begin(), labels.end(), kTargetLabel), 5000);
  EXPECT_GT(std::count(labels.begin(), labels.end(), kFirstModelLabel), 20000);
  for (const uint8_t label : labels) ASSERT_LT(label, kFirstModelLabel + 31);
}

}  // namespace
}  // namespace tld_follower::sim
