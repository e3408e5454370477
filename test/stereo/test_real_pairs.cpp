// SPDX-License-Identifier: BSD-3-Clause
// Middlebury pairs (aloe 2006, cones 2003) against their true disparity, which is in pixels, 0
// where it is unknown. They are read from $TLD_FOLLOWER_DATA/stereo.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "stereo/matcher.h"

namespace tld_follower::stereo {
namespace {

struct Pair {
  const char *left, *right, *truth;
  int range;
  double max_off;      // Of the matched pixels, the share off by more than 1 pixel.
  double min_matched;  // Of the pixels whose truth is known.
};

struct Score {
  double off = 0, matched = 0;  // As Pair bounds them.
};

Score Compare(const cv::Mat& disparity, int invalid, const cv::Mat& truth) {
  int known = 0, matched = 0, off = 0;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const float d = truth.at<float>(v, u);
      if (!(d > 0)) continue;
      ++known;
      const int fixed = disparity.at<int16_t>(v, u);
      if (fixed == invalid) continue;
      ++matched;
      off += std::abs(static_cast<float>(fixed) / kSteps - d) > 1;
    }
  }
  return {static_cast<double>(off) / matched, static_cast<double>(matched) / known};
}

// What stereo_image_proc asks OpenCV for.
cv::Ptr<cv::StereoMatcher> MakePeer(const MatcherParameters& p) {
  if (p.algorithm == Algorithm::kSemiGlobal) {
    return cv::StereoSGBM::create(p.min_disparity, p.disparity_range, p.correlation_window_size,
                                  static_cast<int>(p.p1), static_cast<int>(p.p2), p.disp12_max_diff,
                                  p.prefilter_cap, static_cast<int>(p.uniqueness_ratio),
                                  p.speckle_size, p.speckle_range);
  }
  const auto peer = cv::StereoBM::create(p.disparity_range, p.correlation_window_size);
  peer->setMinDisparity(p.min_disparity);
  peer->setPreFilterSize(9);
  peer->setPreFilterCap(p.prefilter_cap);
  peer->setUniquenessRatio(static_cast<int>(p.uniqueness_ratio));
  peer->setTextureThreshold(p.texture_threshold);
  peer->setSpeckleWindowSize(p.speckle_size);
  peer->setSpeckleRange(p.speckle_range);
  return peer;
}

void Check(const Pair& pair, Algorithm algorithm) {
  const char* data = std::getenv("TLD_FOLLOWER_DATA");
  if (!data) GTEST_SKIP() << "TLD_FOLLOWER_DATA is not set: no real pairs to match";
  const std::string folder = std::string(data) + "/stereo/";
  const cv::Mat left = cv::imread(folder + pair.left, cv::IMREAD_GRAYSCALE);
  const cv::Mat right = cv::imread(folder + pair.right, cv::IMREAD_GRAYSCALE);
  const cv::Mat truth = cv::imread(folder + pair.truth, cv::IMREAD_UNCHANGED);
  ASSERT_FALSE(left.empty() || right.empty() || truth.empty()) << "missing in " << folder;
  cv::Mat expected;
  truth.convertTo(expected, CV_32F);

  MatcherParameters parameters;
  parameters.algorithm = algorithm;
  parameters.disparity_range = pair.range;
  Matcher matcher(parameters);
  const Score ours = Compare(matcher.Match(left, right), matcher.Invalid(), expected);
  cv::Mat disparity;
  MakePeer(parameters)->compute(left, right, disparity);
  const Score peers = Compare(disparity, matcher.Invalid(), expected);
  std::printf(
      "%s: matched %.3f, of these off by more than 1 pixel %.4f; stereo_image_proc %.3f, %.4f\n",
      pair.left, ours.matched, ours.off, peers.matched, peers.off);
  EXPECT_LT(ours.off, pair.max_off);
  EXPECT_GT(ours.matched, pair.min_matched);
  EXPECT_LE(ours.off, peers.off);
  EXPECT_GE(ours.matched, peers.matched);
}

const Pair kAloe{"aloe/aloeL.jpg", "aloe/aloeR.jpg", "aloe/aloeGT.png", 256, 0, 0};
const Pair kCones{"cones/left.tif", "cones/right.tif", "cones/left_disp_gt.tif", 64, 0, 0};

Pair Bounded(Pair pair, double max_off, double min_matched) {
  pair.max_off = max_off;
  pair.min_matched = min_matched;
  return pair;
}

TEST(RealPairs, AloeBlockMatching) {
  Check(Bounded(kAloe, 0.062, 0.57), Algorithm::kBlockMatching);
}
TEST(RealPairs, AloeSemiGlobal) { Check(Bounded(kAloe, 0.081, 0.66), Algorithm::kSemiGlobal); }
TEST(RealPairs, ConesBlockMatching) {
  Check(Bounded(kCones, 0.056, 0.71), Algorithm::kBlockMatching);
}
TEST(RealPairs, ConesSemiGlobal) { Check(Bounded(kCones, 0.077, 0.79), Algorithm::kSemiGlobal); }

}  // namespace
}  // namespace tld_follower::stereo
