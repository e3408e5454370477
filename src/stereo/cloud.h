// SPDX-License-Identifier: BSD-3-Clause
// Points of a disparity image.
#pragma once

#include <pcl/PCLPointCloud2.h>

#include <opencv2/core.hpp>
#include <vector>

#include "stereo/camera.h"
#include "stereo/image.h"

namespace tld_follower::stereo {

/// Reprojects disparity images into clouds of pcl::PointXYZRGB.
class CloudMaker {
 public:
  /// Fills `cloud` with one point a pixel of `disparity` (CV_16SC1, 1/16 pixel), row by row: fields
  /// x, y, z (left optical frame [m]) and rgb, laid out as pcl::PointXYZRGB. With
  /// d = x_l - x_r - geometry.offset,
  ///   z = fx * baseline / d,  x = (u - cx) * z / fx,  y = (v - cy) * z / fy;
  /// pixels under `min_disparity` [pixel] or without a positive d get NaN for x, y and z and keep
  /// their colour. `texture` holds the colours of the rectified left image, in the disparity's
  /// size. The header is left as it is; memory that `cloud` holds is used again. Throws
  /// std::invalid_argument if type or size do not fit.
  void Make(const cv::Mat& disparity, int min_disparity, const Texture& texture,
            const StereoGeometry& geometry, pcl::PCLPointCloud2* cloud);

 private:
  std::vector<float> depth_;   // z of every fixed-point disparity from the lowest one on [m].
  std::vector<float> slopes_;  // (u - cx) / fx of every column.
};

}  // namespace tld_follower::stereo
