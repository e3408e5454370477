// SPDX-License-Identifier: BSD-3-Clause
// Disparity of a rectified pair.
#pragma once

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "stereo/block_matcher.h"

namespace tld_follower::stereo {

/// Disparities are fixed-point numbers with this many steps a pixel.
constexpr int kSteps = 16;

enum class Algorithm { kBlockMatching, kSemiGlobal };

/// Names and defaults are those of stereo_image_proc.
struct MatcherParameters {
  Algorithm algorithm = Algorithm::kBlockMatching;
  int prefilter_cap = 31;            ///< Bound on the prefiltered gradient [grey level].
  int correlation_window_size = 15;  ///< Side of the matched window [pixel]; made odd.
  int min_disparity = 0;             ///< First disparity searched [pixel].
  int disparity_range = 64;          ///< Disparities searched [pixel]; rounded down to 16s.
  double uniqueness_ratio = 15;      ///< Margin of the best match over the next [%].
  int texture_threshold = 10;        ///< Least sum of gradients in a window (block matching).
  int speckle_size = 100;            ///< Regions up to this size are rejected [pixel].
  /// Largest step of disparity inside a region, as OpenCV counts it: in 1/16 pixel for block
  /// matching, in pixels for semi-global.
  int speckle_range = 4;
  bool full_dp = false;       ///< Two-pass dynamic programming (semi-global).
  double p1 = 200, p2 = 400;  ///< Penalties of small and of larger steps (semi-global).
  int disp12_max_diff = 0;    ///< Largest left-right disagreement [pixel] (semi-global).
};

/// Finds the disparity x_l - x_r of every pixel of a rectified left image.
class Matcher {
 public:
  explicit Matcher(const MatcherParameters& parameters = {});

  /// Takes effect with the next pair. Throws std::invalid_argument for a window under 5 or a range
  /// under 16 pixels.
  void SetParameters(const MatcherParameters& parameters);

  /// The parameters in force, rounded as their comments say.
  const MatcherParameters& parameters() const { return parameters_; }

  /// Matches two CV_8UC1 images of one size. The result is CV_16SC1 in 1/16 pixel, `Invalid()`
  /// where no match is trusted; it stays valid until the next call. Throws std::invalid_argument if
  /// the images are empty, differ in size, are not grey or are smaller than the correlation window.
  const cv::Mat& Match(const cv::Mat& left, const cv::Mat& right);

  /// The value of pixels without a match, one pixel under the first disparity searched.
  int Invalid() const { return (parameters_.min_disparity - 1) * kSteps; }

  /// Pixels of the left image whose window lies inside both images over the whole search.
  cv::Rect ValidWindow(cv::Size image) const;

 private:
  void MatchBlocks(const cv::Mat& left, const cv::Mat& right);

  MatcherParameters parameters_;
  BlockMatcher block_matcher_;
  cv::Ptr<cv::StereoSGBM> semi_global_matcher_;
  cv::Mat disparity_, speckle_buffer_;
};

/// Fills `pixels` (CV_32FC1) with the disparity [pixel], with the cameras' `offset` taken off as
/// stereo_msgs/DisparityImage wants it: d = x_l - x_r - (cx_l - cx_r).
void ToPixels(const cv::Mat& disparity, double offset, cv::Mat* pixels);

}  // namespace tld_follower::stereo
