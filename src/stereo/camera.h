// SPDX-License-Identifier: BSD-3-Clause
// What camera_info says about a stereo pair: the rectification of each image and the geometry of
// the pair.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace tld_follower::stereo {

/// One camera as sensor_msgs/CameraInfo describes it, for the pixels of the image at hand (after
/// binning and region of interest).
struct Calibration {
  cv::Size size;                       ///< Of the image [pixel].
  std::string distortion_model;        ///< plumb_bob, rational_polynomial or equidistant.
  std::vector<double> d;               ///< Distortion coefficients; empty for none.
  cv::Matx33d k = cv::Matx33d::eye();  ///< Intrinsics of the raw image [pixel].
  cv::Matx33d r = cv::Matx33d::eye();  ///< Rotation of the camera into the rectified frame.
  /// Projection of the rectified image [pixel]; p(0, 3) = -f * baseline [pixel m].
  cv::Matx34d p = cv::Matx34d::zeros();

  bool operator==(const Calibration& other) const;
  bool operator!=(const Calibration& other) const { return !(*this == other); }

  /// True if the raw image already is the rectified one: no distortion, no rotation, K = P.
  bool IsRectified() const;
};

/// Geometry of a rectified pair. For a disparity x_l - x_r [pixel] the depth along the left
/// optical axis is z = fx * baseline / (x_l - x_r - offset) [m].
struct StereoGeometry {
  double fx = 0, fy = 0;  ///< Focal lengths of both rectified cameras [pixel].
  double cx = 0, cy = 0;  ///< Principal point of the left rectified camera [pixel].
  double baseline = 0;    ///< From the left to the right optical centre [m].
  double offset = 0;      ///< cx of the left minus cx of the right camera [pixel].

  /// Reads the geometry from both projections. Throws std::invalid_argument if a camera is
  /// uncalibrated, the pair has no positive baseline or the rectified cameras differ in anything
  /// but cx.
  static StereoGeometry From(const Calibration& left, const Calibration& right);
};

/// Maps raw images of one camera to rectified ones; keeps the maps until the calibration changes.
class Rectifier {
 public:
  /// Returns the rectified image (8 bit, any channels): `raw` itself where nothing has to be done,
  /// else a buffer that stays valid until the next call. Throws std::invalid_argument for an image
  /// that differs in size from the calibration, NaN, an unknown distortion model or a number of
  /// coefficients which that model does not have.
  cv::Mat Rectify(const cv::Mat& raw, const Calibration& calibration);

 private:
  Calibration calibration_;
  // CV_16SC2 and CV_16UC1, as cv::remap takes them; empty if there is nothing to do.
  cv::Mat map_xy_, map_fraction_;
  cv::Mat rectified_;
};

}  // namespace tld_follower::stereo
