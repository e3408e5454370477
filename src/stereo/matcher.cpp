// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/matcher.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace tld_follower::stereo {

Matcher::Matcher(const MatcherParameters& parameters) { SetParameters(parameters); }

void Matcher::SetParameters(const MatcherParameters& parameters) {
  MatcherParameters p = parameters;
  p.correlation_window_size |= 1;
  p.disparity_range -= p.disparity_range % 16;
  if (p.correlation_window_size < 5 || p.disparity_range < 16) {
    throw std::invalid_argument("correlation_window_size must be at least 5, disparity_range 16");
  }
  semi_global_matcher_ = cv::StereoSGBM::create(
      p.min_disparity, p.disparity_range, p.correlation_window_size, static_cast<int>(p.p1),
      static_cast<int>(p.p2), p.disp12_max_diff, p.prefilter_cap,
      static_cast<int>(p.uniqueness_ratio), p.speckle_size, p.speckle_range,
      p.full_dp ? cv::StereoSGBM::MODE_HH : cv::StereoSGBM::MODE_SGBM);
  parameters_ = p;
}

void Matcher::MatchBlocks(const cv::Mat& left, const cv::Mat& right) {
  BlockMatcherParameters p;
  p.prefilter_cap = parameters_.prefilter_cap;
  p.window = parameters_.correlation_window_size;
  p.min_disparity = parameters_.min_disparity;
  p.range = parameters_.disparity_range;
  p.uniqueness_ratio = static_cast<int>(parameters_.uniqueness_ratio);
  p.texture_threshold = parameters_.texture_threshold;
  block_matcher_.Match(left, right, p, &disparity_);
  if (parameters_.speckle_size > 0) {
    cv::filterSpeckles(disparity_, Invalid(), parameters_.speckle_size, parameters_.speckle_range,
                       speckle_buffer_);
  }
}

const cv::Mat& Matcher::Match(const cv::Mat& left, const cv::Mat& right) {
  if (left.empty() || right.empty()) throw std::invalid_argument("an image of the pair is empty");
  if (left.type() != CV_8UC1 || right.type() != CV_8UC1) {
    throw std::invalid_argument("images to match must be grey, 8 bit");
  }
  if (left.size() != right.size()) {
    std::ostringstream text;
    text << "left and right image differ in size: " << left.size() << " and " << right.size();
    throw std::invalid_argument(text.str());
  }
  if (std::min(left.cols, left.rows) <= parameters_.correlation_window_size) {
    std::ostringstream text;
    text << "images of " << left.size() << " pixels are too small for a correlation window of "
         << parameters_.correlation_window_size;
    throw std::invalid_argument(text.str());
  }
  if (parameters_.algorithm == Algorithm::kSemiGlobal) {
    semi_global_matcher_->compute(left, right, disparity_);
  } else {
    MatchBlocks(left, right);
  }
  return disparity_;
}

cv::Rect Matcher::ValidWindow(cv::Size image) const {
  const int border = parameters_.correlation_window_size / 2;
  const int max_disparity = parameters_.min_disparity + parameters_.disparity_range - 1;
  const cv::Point first(border + std::max(0, max_disparity), border);
  const cv::Point end(image.width - border - std::max(0, -parameters_.min_disparity),
                      image.height - border);
  return first.x < end.x && first.y < end.y ? cv::Rect(first, end) : cv::Rect();
}

void ToPixels(const cv::Mat& disparity, double offset, cv::Mat* pixels) {
  disparity.convertTo(*pixels, CV_32F, 1.0 / kSteps, -offset);
}

}  // namespace tld_follower::stereo
