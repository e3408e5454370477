// SPDX-License-Identifier: BSD-3-Clause
// Block matching on the processor's widest vectors.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace tld_follower::stereo {

struct BlockMatcherParameters {
  int prefilter_cap = 31;      ///< Bound on the prefiltered gradient, 1..63 [grey level].
  int window = 15;             ///< Side of the matched window, odd [pixel].
  int min_disparity = 0;       ///< First disparity searched [pixel].
  int range = 64;              ///< Disparities searched, a multiple of 16 [pixel].
  int uniqueness_ratio = 15;   ///< Margin of the best match over the next [%].
  int texture_threshold = 10;  ///< Least sum of absolute gradients in the left window.
};

/// Finds where a window of the left image has the least sum of absolute differences of horizontal
/// gradients to the right one, with a parabola through the sums beside it (K. Konolige, "Small
/// vision systems: hardware and implementation", 1997). Gives the disparities of cv::StereoBM, bit
/// for bit.
class BlockMatcher {
 public:
  /// Matches two CV_8UC1 images of one size into `disparity` (CV_16SC1, 1/16 pixel):
  /// 16 (min_disparity - 1) where the window or the search leaves an image, where there is too
  /// little texture or where the best match is not unique.
  void Match(const cv::Mat& left, const cv::Mat& right, const BlockMatcherParameters& parameters,
             cv::Mat* disparity);

 private:
  // Buffers that outlive a frame: the prefiltered images, and the sums with 16 or 32 bit.
  cv::Mat left_, right_;
  std::vector<int16_t> short_sums_;
  std::vector<int32_t> long_sums_;
};

}  // namespace tld_follower::stereo
