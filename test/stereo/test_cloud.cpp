// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/conversions.h>
#include <pcl/point_types.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "stereo/cloud.h"
#include "stereo/matcher.h"
#include "synthetic.h"

namespace tld_follower::stereo {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZRGB>;
constexpr double kF = 502.3, kFy = 498.7, kCx = 319.5, kCy = 20.25, kBaseline = 0.049;

StereoGeometry MakeGeometry(double offset = 0) { return {kF, kFy, kCx, kCy, kBaseline, offset}; }

Cloud MakeCloud(const cv::Mat& disparity, int minimum, const Texture& texture,
                const StereoGeometry& geometry) {
  pcl::PCLPointCloud2 blob;
  CloudMaker().Make(disparity, minimum, texture, geometry, &blob);
  Cloud cloud;
  pcl::fromPCLPointCloud2(blob, cloud);
  return cloud;
}

// Every fixed-point disparity of the default search, one after the other.
cv::Mat MakeRamp() {
  cv::Mat_<int16_t> ramp(16, 65);
  for (int i = 0; i < ramp.rows * ramp.cols; ++i) ramp(i / ramp.cols, i % ramp.cols) = i - 16;
  return ramp;
}

void ExpectExact(const Cloud& cloud, const cv::Mat& disparity, int minimum, double offset) {
  int finite = 0;
  for (int v = 0; v < disparity.rows; ++v) {
    for (int u = 0; u < disparity.cols; ++u) {
      const auto& point = cloud.at(u, v);
      const double raw = disparity.at<int16_t>(v, u) / 16.0;
      if (raw < minimum || raw <= offset) {
        EXPECT_TRUE(std::isnan(point.x) && std::isnan(point.y) && std::isnan(point.z)) << raw;
        continue;
      }
      ++finite;
      const double z = kF * kBaseline / (raw - offset);
      EXPECT_NEAR(point.z, z, 1e-6 * z);
      EXPECT_NEAR(point.x, (u - kCx) * z / kF, 1e-6 * z);
      EXPECT_NEAR(point.y, (v - kCy) * z / kFy, 1e-6 * z);
    }
  }
  EXPECT_GT(finite, 0);
}

TEST(Cloud, ReprojectsEveryDisparityExactly) {
  const cv::Mat ramp = MakeRamp();
  const Texture grey{cv::Mat(ramp.size(), CV_8UC1, cv::Scalar(7))};
  ExpectExact(MakeCloud(ramp, 0, grey, MakeGeometry()), ramp, 0, 0);
  ExpectExact(MakeCloud(ramp, -1, grey, MakeGeometry()), ramp, -1, 0);
}

TEST(Cloud, TakesTheDifferenceOfPrincipalPointsOffOnce) {
  const cv::Mat ramp = MakeRamp();
  const Texture grey{cv::Mat(ramp.size(), CV_8UC1, cv::Scalar(7))};
  for (double offset : {5.0, -3.25}) {
    ExpectExact(MakeCloud(ramp, 0, grey, MakeGeometry(offset)), ramp, 0, offset);
  }
}

TEST(Cloud, KeepsTheMinimumDisparityAndDropsWhatIsBelow) {
  cv::Mat disparity(4, 5, CV_16SC1, cv::Scalar(16 * kSteps));
  disparity.at<int16_t>(1, 2) = 15 * kSteps;  // The matcher's mark of a pixel without a match.
  const Texture grey{cv::Mat(disparity.size(), CV_8UC1, cv::Scalar(7))};
  const Cloud cloud = MakeCloud(disparity, 16, grey, MakeGeometry());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(std::isnan(cloud.points[i].z), i == 7) << i;
}

TEST(Cloud, HasTheLayoutOfTheContract) {
  const cv::Mat disparity(3, 5, CV_16SC1, cv::Scalar(100));
  pcl::PCLPointCloud2 blob;
  CloudMaker().Make(disparity, 0, {cv::Mat(3, 5, CV_8UC1, cv::Scalar(9))}, MakeGeometry(), &blob);
  EXPECT_EQ(blob.width, 5u);
  EXPECT_EQ(blob.height, 3u);
  EXPECT_EQ(blob.point_step, 32u);
  EXPECT_EQ(blob.row_step, 160u);
  EXPECT_EQ(blob.data.size(), 480u);
  EXPECT_FALSE(blob.is_dense);
  EXPECT_FALSE(blob.is_bigendian);
  const std::vector<std::pair<std::string, uint32_t>> expected{
      {"x", 0}, {"y", 4}, {"z", 8}, {"rgb", 16}};
  ASSERT_EQ(blob.fields.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(blob.fields[i].name, expected[i].first);
    EXPECT_EQ(blob.fields[i].offset, expected[i].second);
    EXPECT_EQ(blob.fields[i].datatype, pcl::PCLPointField::FLOAT32);
    EXPECT_EQ(blob.fields[i].count, 1u);
  }
}

TEST(Cloud, ColoursEveryPixelWithOrWithoutDepth) {
  const cv::Mat disparity = (cv::Mat_<int16_t>(1, 2) << -kSteps, 100);
  cv::Mat bgr(1, 2, CV_8UC3, cv::Scalar(10, 20, 30));
  const cv::Mat grey(1, 2, CV_8UC1, cv::Scalar(77));
  const auto check = [&](const Texture& texture, int r, int g, int b) {
    const Cloud cloud = MakeCloud(disparity, 0, texture, MakeGeometry());
    for (const auto& point : cloud.points) {
      EXPECT_EQ(cv::Vec3i(point.r, point.g, point.b), cv::Vec3i(r, g, b));
    }
    EXPECT_TRUE(std::isnan(cloud.points[0].x));
    EXPECT_FALSE(std::isnan(cloud.points[1].x));
  };
  check({bgr, false}, 30, 20, 10);
  check({bgr, true}, 10, 20, 30);
  check({grey, false}, 77, 77, 77);
}

TEST(Cloud, UsesItsMemoryAgainAndTakesAnotherSize) {
  CloudMaker maker;
  pcl::PCLPointCloud2 blob;
  for (const cv::Size size : {cv::Size(8, 6), cv::Size(8, 6), cv::Size(4, 4), cv::Size(9, 7)}) {
    const uint8_t* before = blob.data.data();
    const bool fits = blob.data.capacity() >= size.area() * 32u;
    maker.Make(cv::Mat(size, CV_16SC1, cv::Scalar(160)), 0, {cv::Mat(size, CV_8UC1, cv::Scalar(1))},
               MakeGeometry(), &blob);
    EXPECT_EQ(blob.data.data() == before, fits);
    EXPECT_EQ(blob.data.size(), size.area() * 32u);
    EXPECT_EQ(blob.fields.size(), 4u);
  }
}

TEST(Cloud, RefusesWhatDoesNotFit) {
  pcl::PCLPointCloud2 blob;
  const cv::Mat disparity(4, 4, CV_16SC1, cv::Scalar(0));
  CloudMaker maker;
  EXPECT_THROW(maker.Make(disparity, 0, {cv::Mat(4, 5, CV_8UC1)}, MakeGeometry(), &blob),
               std::invalid_argument);
  EXPECT_THROW(maker.Make(disparity, 0, {cv::Mat(4, 4, CV_8UC4)}, MakeGeometry(), &blob),
               std::invalid_argument);
  EXPECT_THROW(
      maker.Make(cv::Mat(4, 4, CV_32FC1), 0, {cv::Mat(4, 4, CV_8UC1)}, MakeGeometry(), &blob),
      std::invalid_argument);
}

// A wall seen through both steps: n . X = h for every point.
TEST(Cloud, PointsOfAPlaneLieOnThatPlane) {
  const cv::Size size(320, 240);
  const double f = 250, base = 12, along_x = 0.03, along_y = 0.02;
  const StereoGeometry geometry{f, f, 159.5, 119.5, kBaseline, 0};
  const cv::Mat left = MakeTexture(size, 11);
  Matcher matcher;
  const cv::Mat& disparity = matcher.Match(left, MakeRight(left, base, along_x, along_y));
  const Cloud cloud = MakeCloud(disparity, 0, {left}, geometry);
  // d = base + along_x u + along_y v, times z: f B = (base + along_x cx + along_y cy) z + ...
  const double at_centre = base + along_x * geometry.cx + along_y * geometry.cy;
  int on_plane = 0, finite = 0;
  for (const auto& point : cloud.points) {
    if (std::isnan(point.z)) continue;
    ++finite;
    const double sum = at_centre * point.z + along_x * f * point.x + along_y * f * point.y;
    on_plane += std::abs(sum / (f * kBaseline) - 1) < 0.02;
  }
  EXPECT_GT(finite, 0.7 * size.area());
  EXPECT_GT(on_plane, 0.97 * finite);
}

}  // namespace
}  // namespace tld_follower::stereo
