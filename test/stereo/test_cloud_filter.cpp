// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "stereo/cloud_filter.h"

namespace tld_follower::stereo {
namespace {

using Point = pcl::PointXYZRGB;
using Points = std::vector<Point, Eigen::aligned_allocator<Point>>;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

Point At(float x, float y, float z) {
  Point point;
  point.x = x;
  point.y = y;
  point.z = z;
  point.r = 10;
  point.g = 20;
  point.b = 30;
  return point;
}

// A wall of 2 m x 1 m, 2 m away, one point a centimetre.
Points MakeWall() {
  Points points;
  for (int i = -100; i < 100; ++i) {
    for (int j = -50; j < 50; ++j) points.push_back(At(0.01f * i + 0.005f, 0.01f * j + 0.005f, 2));
  }
  return points;
}

// As a pixel without depth comes from the matcher.
Point Nowhere() { return At(kNaN, kNaN, kNaN); }

CloudFilterParameters Only(OutlierRemoval removal, float voxel_size = 0) {
  CloudFilterParameters parameters;
  parameters.outlier_removal = removal;
  parameters.voxel_size = voxel_size;
  return parameters;
}

pcl::PointCloud<Point> Filter(const Points& points, const CloudFilterParameters& parameters) {
  return FilterCloud(reinterpret_cast<const uint8_t*>(points.data()), points.size(), parameters);
}

TEST(CloudFilter, OutliersGoAndThePlaneStays) {
  for (const auto removal : {OutlierRemoval::kStatistical, OutlierRemoval::kRadius}) {
    for (const float voxel_size : {0.0f, 0.05f}) {
      Points points = MakeWall();
      const size_t wall = Filter(points, Only(OutlierRemoval::kNone, voxel_size)).size();
      for (int i = 0; i < 20; ++i) points.push_back(At(0.1f * i - 1, 0.4f, 0.5f + 0.05f * i));
      const auto cloud = Filter(points, Only(removal, voxel_size));
      size_t on_wall = 0;
      for (const auto& point : cloud) on_wall += std::abs(point.z - 2) < 1e-4;
      EXPECT_EQ(on_wall, cloud.size()) << voxel_size;
      EXPECT_GT(on_wall, 0.97 * wall) << voxel_size;
    }
  }
}

TEST(CloudFilter, VoxelsHoldOnePointEach) {
  const auto cloud = Filter(MakeWall(), Only(OutlierRemoval::kNone, 0.1f));
  EXPECT_EQ(cloud.size(), 20u * 10u);
  for (const auto& point : cloud) {
    // The mean of a voxel's points, on the centre of its side.
    EXPECT_NEAR(std::remainder(point.x - 0.05f, 0.1f), 0, 1e-4);
    EXPECT_NEAR(std::remainder(point.y - 0.05f, 0.1f), 0, 1e-4);
    EXPECT_NEAR(point.z, 2, 1e-5);
    EXPECT_EQ(point.r, 10);
    EXPECT_EQ(point.g, 20);
    EXPECT_EQ(point.b, 30);
  }
}

TEST(CloudFilter, TheBoxLimitsEveryAxis) {
  auto parameters = Only(OutlierRemoval::kNone);
  parameters.crop_min = {-1, -2, 1};
  parameters.crop_max = {3, 4, 5};
  const Points points{At(-1, -2, 1),   At(3, 4, 5),      At(0, 0, 2),     At(-1.01f, 0, 2),
                      At(3.01f, 0, 2), At(0, -2.01f, 2), At(0, 4.01f, 2), At(0, 0, 0.99f),
                      At(0, 0, 5.01f), Nowhere()};
  const auto cloud = Filter(points, parameters);
  ASSERT_EQ(cloud.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(cloud[i].x, points[i].x);
}

TEST(CloudFilter, IsUnorganisedAndDense) {
  Points points = MakeWall();
  std::fill(points.begin(), points.begin() + 500, Nowhere());
  const auto cloud = Filter(points, {});
  EXPECT_TRUE(cloud.is_dense);
  EXPECT_EQ(cloud.height, 1u);
  EXPECT_EQ(cloud.width, cloud.size());
  EXPECT_GT(cloud.size(), 0u);
  for (const auto& point : cloud) EXPECT_TRUE(std::isfinite(point.x + point.y + point.z));
}

TEST(CloudFilter, NothingInNothingOut) {
  for (const auto removal :
       {OutlierRemoval::kNone, OutlierRemoval::kStatistical, OutlierRemoval::kRadius}) {
    EXPECT_TRUE(Filter({}, Only(removal, 0.05f)).empty());
    EXPECT_TRUE(Filter(Points(64, Nowhere()), Only(removal, 0.05f)).empty());
  }
}

TEST(CloudFilter, FewerPointsThanNeighboursAskedForAreNoError) {
  auto parameters = Only(OutlierRemoval::kStatistical);
  EXPECT_EQ(Filter({At(0, 0, 1)}, parameters).size(), 1u);
  EXPECT_EQ(Filter({At(0, 0, 1), At(0, 0, 1.1f), At(0, 0, 1.2f)}, parameters).size(), 3u);
  parameters.outlier_removal = OutlierRemoval::kRadius;
  EXPECT_TRUE(Filter({At(0, 0, 1), At(0, 0, 1.1f)}, parameters).empty());
  parameters.min_neighbours = 1;
  EXPECT_EQ(Filter({At(0, 0, 1), At(0, 0, 1.1f), At(0, 0, 2)}, parameters).size(), 2u);
}

TEST(CloudFilter, RefusesWhatCannotBeDone) {
  CloudFilterParameters parameters;
  parameters.crop_min.y() = parameters.crop_max.y();
  EXPECT_THROW(Filter(MakeWall(), parameters), std::invalid_argument);
  const Points far{At(-9, -9, 0), At(9, 9, 9)};
  EXPECT_THROW(Filter(far, Only(OutlierRemoval::kNone, 0.001f)), std::invalid_argument);
  EXPECT_EQ(Filter(far, Only(OutlierRemoval::kNone, 0.05f)).size(), 2u);
}

}  // namespace
}  // namespace tld_follower::stereo
