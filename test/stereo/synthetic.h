// SPDX-License-Identifier: BSD-3-Clause
// Pairs of which the disparity is known.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo/camera.h"

namespace tld_follower::stereo {

/// Grey noise, smooth enough to be sampled between pixels.
inline cv::Mat MakeTexture(cv::Size size, uint64_t seed) {
  cv::RNG rng(seed);
  cv::Mat noise(size, CV_8UC1);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {0, 0}, 1.2);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  return noise;
}

/// The right image of a left one whose disparity is base + along_x * x + along_y * y [pixel].
inline cv::Mat MakeRight(const cv::Mat& left, double base, double along_x = 0, double along_y = 0) {
  cv::Mat_<cv::Vec2f> map(left.size());
  for (int y = 0; y < left.rows; ++y) {
    for (int x = 0; x < left.cols; ++x) {
      map(y, x) = cv::Vec2f(static_cast<float>((x + base + along_y * y) / (1 - along_x)),
                            static_cast<float>(y));
    }
  }
  cv::Mat right;
  cv::remap(left, right, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return right;
}

/// A rectified camera; `shift` is P[3] = -f * baseline [pixel m].
inline Calibration MakeCalibration(cv::Size size, double f, double cx, double cy, double shift) {
  Calibration calibration;
  calibration.size = size;
  calibration.distortion_model = "plumb_bob";
  calibration.d.assign(5, 0.0);
  calibration.k = cv::Matx33d(f, 0, cx, 0, f, cy, 0, 0, 1);
  calibration.p = cv::Matx34d(f, 0, cx, shift, 0, f, cy, 0, 0, 0, 1, 0);
  return calibration;
}

}  // namespace tld_follower::stereo
