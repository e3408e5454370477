// SPDX-License-Identifier: BSD-3-Clause
// Points of a disparity image.
#pragma once

#include <pcl/PCLPointCloud2.h>

#include <opencv2/core.hpp>
#include <vector>

#include "stereo/camera.h"
#include "stereo/image.h"

namespace tld_stereo {

/// Reprojects disparity images into clouds of pcl::PointXYZRGB.
class CloudMaker {
 public:
  /// Fills `cloud` with one point a pixel, row by row: fields x, y, z (metres, left optical frame)
  /// and rgb, laid out as pcl::PointXYZRGB. With d = x_l - x_r - geometry.offset,
  ///   z = fx * baseline / d,  x = (u - cx) * z / fx,  y = (v - cy) * z / fy;
  /// pixels under `min_disparity` (pixels) or without a positive d get NaN for x, y and z and keep
  /// their colour. The header is left as it is; memory that `cloud` holds is used again.
  /// @param disparity CV_16SC1, 1/16 pixel.
  /// @param texture colours of the rectified left image, of the disparity's size.
  /// @throws std::invalid_argument if type or size do not fit.
  void make(const cv::Mat& disparity, int min_disparity, const Texture& texture,
            const StereoGeometry& geometry, pcl::PCLPointCloud2& cloud);

 private:
  std::vector<float> depth_;   ///< z of every fixed-point disparity from the lowest one on, metres
  std::vector<float> slopes_;  ///< (u - cx) / fx of every column
};

}  // namespace tld_stereo
