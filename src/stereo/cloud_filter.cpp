// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/cloud_filter.h"

#include <pcl/common/common.h>
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace tld_follower::stereo {
namespace {

using Point = pcl::PointXYZRGB;
using Cloud = pcl::PointCloud<Point>;

// NaN fails every comparison, so the box drops points without depth as well.
Cloud::Ptr Crop(const uint8_t* points, size_t count, const Eigen::Vector3f& low,
                const Eigen::Vector3f& high) {
  if (!(low.array() < high.array()).all()) {
    throw std::invalid_argument("the crop box is empty: each crop_min must be below its crop_max");
  }
  auto cropped = Cloud::Ptr(new Cloud);
  Point point;
  for (size_t i = 0; i < count; ++i) {
    std::memcpy(static_cast<void*>(&point), points + i * sizeof point, sizeof point);
    const auto xyz = point.getArray3fMap();
    if ((xyz >= low.array()).all() && (xyz <= high.array()).all()) cropped->push_back(point);
  }
  return cropped;
}

Cloud::Ptr Thin(const Cloud::Ptr& cloud, float side) {
  // pcl::VoxelGrid numbers voxels with 32 bits; beyond it would hand the cloud back as it is.
  Eigen::Vector4f low, high;
  pcl::getMinMax3D(*cloud, low, high);
  const Eigen::Array3d voxels = ((high - low).head<3>().cast<double>().array() / side) + 2;
  if (voxels.prod() > std::numeric_limits<int32_t>::max()) {
    std::ostringstream text;
    text << "voxel_size " << side << " m is too small for a cloud of this extent; crop it or use a "
         << "larger one";
    throw std::invalid_argument(text.str());
  }
  pcl::VoxelGrid<Point> grid;
  grid.setInputCloud(cloud);
  grid.setLeafSize(side, side, side);
  auto thinned = Cloud::Ptr(new Cloud);
  grid.filter(*thinned);
  return thinned;
}

template <typename Filter>
Cloud Filtered(const Cloud::Ptr& cloud, Filter* filter) {
  Cloud kept;
  filter->setInputCloud(cloud);
  filter->filter(kept);
  return kept;
}

}  // namespace

Cloud FilterCloud(const uint8_t* points, size_t count, const CloudFilterParameters& parameters) {
  Cloud::Ptr cloud = Crop(points, count, parameters.crop_min, parameters.crop_max);
  if (!cloud->empty() && parameters.voxel_size > 0) cloud = Thin(cloud, parameters.voxel_size);
  if (parameters.outlier_removal == OutlierRemoval::kStatistical && cloud->size() > 1) {
    pcl::StatisticalOutlierRemoval<Point> statistical;
    statistical.setMeanK(std::min(parameters.mean_k, static_cast<int>(cloud->size()) - 1));
    statistical.setStddevMulThresh(parameters.deviations);
    return Filtered(cloud, &statistical);
  }
  if (parameters.outlier_removal == OutlierRemoval::kRadius && !cloud->empty()) {
    pcl::RadiusOutlierRemoval<Point> radius;
    radius.setRadiusSearch(parameters.radius);
    radius.setMinNeighborsInRadius(parameters.min_neighbours);
    return Filtered(cloud, &radius);
  }
  return *cloud;
}

}  // namespace tld_follower::stereo
