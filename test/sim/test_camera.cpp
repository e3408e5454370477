// SPDX-License-Identifier: BSD-3-Clause
// What the cameras show: projection, occlusion, missing media.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/renderer.h"
#include "support.h"

namespace tld_follower::sim {
namespace {

struct Centroid {
  double u = 0, v = 0;
  int pixels = 0;
};

// Centre of the pixels that are red; the plain sky is not.
Centroid FindRed(const std::vector<uint8_t>& image, int width) {
  Centroid result;
  for (size_t i = 0; i < image.size() / 3; ++i) {
    if (image[3 * i] < image[3 * i + 2] + 40) continue;
    result.u += double(i % size_t(width));
    result.v += double(i / size_t(width));
    ++result.pixels;
  }
  result.u /= result.pixels;
  result.v /= result.pixels;
  return result;
}

SceneNode Ball(const btVector3& centre, double radius) {
  SceneNode node;
  node.visual.geometry.type = Geometry::Type::kSphere;
  node.visual.geometry.size.setValue(btScalar(radius), btScalar(radius), btScalar(radius));
  node.visual.pose.setOrigin(centre);
  node.visual.material.colour = {1.f, 0.f, 0.f};
  return node;
}

World BrightWorld() {
  World world;
  world.ambient = {1.f, 1.f, 1.f};
  world.sun_colour = {0.f, 0.f, 0.f};
  return world;
}

TEST(Camera, SpiriOpticsAreThoseOfItsSimulator) {
  const StereoCamera camera;
  EXPECT_NEAR(camera.FocalLength(), 502.3, 0.1);
  EXPECT_NEAR(camera.FocalLength() * camera.baseline / 1.0, 24.6, 0.05);
}

TEST(Camera, KnownPointsLandOnTheirPixelsInBothEyes) {
  const StereoCamera camera;
  const double radius = 0.05;
  // A drone somewhere, and balls given in its left optical frame.
  const btTransform drone(btQuaternion(btVector3(0, 0, 1), btScalar(0.7)), {3, -2, 1});
  const btTransform mount = drone * camera.Mount();
  for (const btVector3& point :
       {btVector3(0, 0, btScalar(1.5)), btVector3(btScalar(-0.6), btScalar(-0.4), btScalar(1.6)),
        btVector3(btScalar(0.7), btScalar(0.5), btScalar(1.7))}) {
    const btVector3 centre = mount * camera.Optical(Eye::kLeft) * point;
    Renderer renderer(camera, BrightWorld(), {{Ball(centre, radius)}, {}}, false, Resources({}),
                      ThrowWarning);
    StereoImages images;
    renderer.Render(mount, {}, &images, nullptr);
    for (const Eye eye : {Eye::kLeft, Eye::kRight}) {
      const btVector3 p = (mount * camera.Optical(eye)).inverse() * centre;
      // A ball's picture is an ellipse about (f X Z / (Z^2 - r^2), f Y Z / (Z^2 - r^2)).
      const double scale = camera.FocalLength() * p.z() / (p.z() * p.z() - radius * radius);
      const Centroid found = FindRed(eye == Eye::kLeft ? images.left : images.right, camera.width);
      ASSERT_GT(found.pixels, 500);
      EXPECT_NEAR(found.u, scale * p.x() + camera.Cx(), 0.1);
      EXPECT_NEAR(found.v, scale * p.y() + camera.Cy(), 0.1);
    }
  }
}

TEST(Camera, ShiftBetweenTheEyesIsFocalLengthTimesBaselineOverDepth) {
  StereoCamera camera;
  camera.pitch = 0;
  camera.position.setValue(0, 0, 0);
  Renderer renderer(camera, BrightWorld(), {{Ball({2, 0, 0}, 0.05)}, {}}, false, Resources({}),
                    ThrowWarning);
  StereoImages images;
  renderer.Render(btTransform::getIdentity(), {}, &images, nullptr);
  const Centroid left = FindRed(images.left, camera.width);
  const Centroid right = FindRed(images.right, camera.width);
  EXPECT_NEAR(left.u - right.u, camera.FocalLength() * camera.baseline / 2, 0.1);
  EXPECT_NEAR(left.v, right.v, 0.05);
}

TEST(Camera, TargetMaskCountsWhatIsSeenAlone) {
  StereoCamera camera;
  camera.pitch = 0;
  camera.position.setValue(0, 0, 0);
  Scene scene{{Ball({2, 0, 0}, 0.3)}, {}};
  scene.visuals[0].label = kTargetLabel;
  StereoImages images;
  TargetMask free, half;
  Renderer(camera, BrightWorld(), scene, false, Resources({}), ThrowWarning)
      .Render(btTransform::getIdentity(), {}, &images, &free);
  EXPECT_NEAR(free.width, 2 * 502.3 * 0.3 / 2, 4);
  EXPECT_NEAR(free.x + (free.width - 1) / 2.0, camera.Cx() + 502.3 * 0.0245 / 2, 1);

  SceneNode screen;  // Hides the left half of the ball.
  screen.visual.geometry.size.setValue(btScalar(0.1), 1, 2);
  screen.visual.pose.setOrigin({1, btScalar(0.5 + 0.0245 / 2), 0});
  scene.visuals.push_back(screen);
  Renderer(camera, BrightWorld(), scene, false, Resources({}), ThrowWarning)
      .Render(btTransform::getIdentity(), {}, &images, &half);
  EXPECT_NEAR(half.pixels, free.pixels / 2, free.pixels / 20);
  EXPECT_EQ(half.y, free.y);

  scene.visuals[1].visual.geometry.size.setValue(btScalar(0.1), 4, 4);
  Renderer(camera, BrightWorld(), scene, false, Resources({}), ThrowWarning)
      .Render(btTransform::getIdentity(), {}, &images, &half);
  EXPECT_EQ(half.pixels, 0);
  EXPECT_EQ(half.width, 0);
}

TEST(Camera, MissingTextureIsOneWarningAndAMagentaPattern) {
  Warnings warnings;
  Scene scene{{Ball({2, 0, 0}, 0.3), Ball({2, 1, 0}, 0.3)}, {}};
  for (SceneNode& node : scene.visuals) {
    node.visual.material.colour = {1.f, 1.f, 1.f};
    node.visual.material.texture = "media/no_such.png";
  }
  StereoCamera camera;
  Renderer renderer(camera, BrightWorld(), scene, false, Resources({}), warnings.Sink());
  StereoImages images;
  renderer.Render(camera.Mount(), {}, &images, nullptr);
  ASSERT_EQ(warnings.lines.size(), 1u);
  EXPECT_NE(warnings.lines[0].find("no_such.png"), std::string::npos);
  int magenta = 0;
  for (size_t i = 0; i < images.left.size(); i += 3) {
    magenta += images.left[i] > 150 && images.left[i + 1] < 60 && images.left[i + 2] > 150;
  }
  EXPECT_GT(magenta, 500);
}

TEST(Camera, MissingAndBrokenMeshesAreWarningsAndBoxes) {
  const TemporaryFile broken("broken.obj", "f 1/1/1 2/1/1 3/1/1\n");
  Warnings warnings;
  Scene scene{{Ball({2, 0, 0}, 1), Ball({2, 0, 0}, 1), Ball({2, 1, 0}, 1)}, {}};
  for (SceneNode& node : scene.visuals) {
    node.visual.geometry.type = Geometry::Type::kMesh;
    node.visual.geometry.mesh = "media/no_such.obj";
    node.label = kTargetLabel;
  }
  scene.visuals[2].visual.geometry.mesh = broken.path();
  scene.visuals[2].label = kSkyLabel;
  StereoCamera camera;
  camera.pitch = 0;
  camera.position.setValue(0, 0, 0);
  const Resources resources({std::filesystem::temp_directory_path().string()});
  Renderer renderer(camera, BrightWorld(), scene, false, resources, warnings.Sink());
  StereoImages images;
  TargetMask mask;
  renderer.Render(btTransform::getIdentity(), {}, &images, &mask);
  ASSERT_EQ(warnings.lines.size(), 2u);
  EXPECT_NE(warnings.lines[0].find("no_such.obj"), std::string::npos);
  EXPECT_NE(warnings.lines[1].find("broken.obj"), std::string::npos);
  EXPECT_NEAR(mask.width, camera.FocalLength() * 0.5 / 1.75, 3);
}

TEST(Camera, UnusableSizesAndMeshesAreErrors) {
  StereoCamera camera;
  camera.width = 0;
  EXPECT_THROW(camera.Check(), std::invalid_argument);
  camera = StereoCamera();
  camera.hfov = 3.2;
  EXPECT_THROW(camera.Check(), std::invalid_argument);

  const TemporaryFile mesh("broken.obj", "v 0 0 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1\n");
  EXPECT_THROW(LoadObj(mesh.path(), {1, 1, 1}), std::runtime_error);
  EXPECT_THROW(LoadObj("no_such.obj", {1, 1, 1}), std::runtime_error);
}

TEST(ImageNoise, HasItsDeviationAndDiffersBetweenFramesAndEyes) {
  const ImageNoise noise(2.0, 7);
  const std::vector<uint8_t> grey(300000, 128);
  std::vector<uint8_t> first = grey, again = grey, next = grey, right = grey;
  noise.Add(1, Eye::kLeft, &first);
  noise.Add(1, Eye::kLeft, &again);
  noise.Add(2, Eye::kLeft, &next);
  noise.Add(1, Eye::kRight, &right);
  EXPECT_EQ(first, again);
  EXPECT_NE(first, next);
  EXPECT_NE(first, right);
  double sum = 0, squares = 0;
  for (const uint8_t value : first) {
    sum += value - 128.0;
    squares += (value - 128.0) * (value - 128.0);
  }
  EXPECT_NEAR(sum / double(first.size()), 0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / double(first.size())), 2.0, 0.05);
  EXPECT_THROW(ImageNoise(-1, 0), std::invalid_argument);
}

}  // namespace
}  // namespace tld_follower::sim
