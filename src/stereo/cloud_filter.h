// SPDX-License-Identifier: BSD-3-Clause
// A cloud made small and clean: cropped, thinned and freed of outliers.
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace tld_follower::stereo {

enum class OutlierRemoval { kNone, kStatistical, kRadius };

struct CloudFilterParameters {
  /// Points outside of this box (left optical frame: x right, y down, z forward [m]) are left out.
  Eigen::Vector3f crop_min{-10, -10, 0}, crop_max{10, 10, 10};
  float voxel_size = 0.05f;  ///< Points of a cube of this side [m] become their mean; 0: all stay.
  OutlierRemoval outlier_removal = OutlierRemoval::kStatistical;
  int mean_k = 20;         ///< Statistical: neighbours to which the mean distance is taken.
  double deviations = 2;   ///< Statistical: how far above its mean over the cloud that may lie.
  double radius = 0.2;     ///< Radius: of the ball that is searched for neighbours [m].
  int min_neighbours = 5;  ///< Radius: as many must be in it.
};

/// Filters `count` points laid out as pcl::PointXYZRGB, NaN where there is none: crops them, thins
/// them to one a voxel, then removes outliers (R. B. Rusu et al., "Towards 3D point cloud based
/// object maps for household environments", 2008, for the statistical kind). The result is
/// unorganised and dense, empty if nothing remains. Throws std::invalid_argument for a crop box
/// without inside, or a voxel too small to be numbered over the cropped cloud.
pcl::PointCloud<pcl::PointXYZRGB> FilterCloud(const uint8_t* points, size_t count,
                                              const CloudFilterParameters& parameters);

}  // namespace tld_follower::stereo
