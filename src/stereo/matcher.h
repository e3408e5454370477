// SPDX-License-Identifier: BSD-3-Clause
// Disparity of a rectified pair.
#pragma once

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace tld_stereo {

/// Disparities are fixed-point numbers with this many steps a pixel.
constexpr int kSteps = 16;

enum class Algorithm { kBlockMatching, kSemiGlobal };

/// Names and defaults are those of stereo_image_proc.
struct MatcherParameters {
  Algorithm algorithm = Algorithm::kBlockMatching;
  int prefilter_cap = 31;            ///< bound on the prefiltered gradient, grey levels
  int correlation_window_size = 15;  ///< side of the matched window, pixels; made odd
  int min_disparity = 0;             ///< first disparity searched, pixels
  int disparity_range = 64;          ///< disparities searched, pixels; rounded down to 16s
  double uniqueness_ratio = 15;      ///< margin of the best match over the next, per cent
  int texture_threshold = 10;        ///< least sum of gradients in a window (block matching)
  int speckle_size = 100;            ///< regions up to this size are rejected, pixels
  int speckle_range = 4;             ///< largest step of disparity inside a region, pixels
  bool full_dp = false;              ///< two-pass dynamic programming (semi-global)
  double p1 = 200, p2 = 400;         ///< penalties of small and of larger steps (semi-global)
  int disp12_max_diff = 0;           ///< largest left-right disagreement, pixels (semi-global)
};

/// Finds the disparity x_l - x_r of every pixel of a rectified left image.
class Matcher {
 public:
  explicit Matcher(const MatcherParameters& parameters = {});

  /// Takes effect with the next pair.
  /// @throws std::invalid_argument for a window under 5 or a range under 16 pixels.
  void setParameters(const MatcherParameters& parameters);

  /// The parameters in force, rounded as their comments say.
  const MatcherParameters& parameters() const { return parameters_; }

  /// Matches two CV_8UC1 images of one size. The result is CV_16SC1 in 1/16 pixel, `invalid()`
  /// where no match is trusted; it stays valid until the next call.
  /// @throws std::invalid_argument if the images are empty, differ in size, aren't grey or are
  ///   smaller than the correlation window.
  const cv::Mat& match(const cv::Mat& left, const cv::Mat& right);

  /// The value of pixels without a match, one pixel under the first disparity searched.
  int invalid() const { return (parameters_.min_disparity - 1) * kSteps; }

  /// Pixels of the left image whose window lies inside both images over the whole search.
  cv::Rect validWindow(cv::Size image) const;

 private:
  MatcherParameters parameters_;
  cv::Ptr<cv::StereoMatcher> matcher_;
  cv::Mat disparity_;
};

/// Disparity in pixels (CV_32FC1, into `pixels`), with the cameras' `offset` taken off as
/// stereo_msgs/DisparityImage wants it: d = x_l - x_r - (cx_l - cx_r).
void toPixels(const cv::Mat& disparity, double offset, cv::Mat& pixels);

}  // namespace tld_stereo
