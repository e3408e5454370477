// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>

#include "stereo/block_matcher.h"
#include "stereo/matcher.h"
#include "synthetic.h"

namespace tld_follower::stereo {
namespace {

// A pair in which much matches, some does not, and a part has no texture.
void MakePair(cv::Size size, uint64_t seed, cv::Mat* left, cv::Mat* right) {
  *left = MakeTexture(size, seed);
  *right = MakeRight(*left, 7 + static_cast<double>(seed % 5), 0.05, 0.03);
  MakeTexture({size.width / 4, size.height / 4}, seed + 1)
      .copyTo((*right)(cv::Rect(size.width / 2, size.height / 3, size.width / 4, size.height / 4)));
  left->rowRange(0, size.height / 5).setTo(90);
}

// Pixels that differ from cv::StereoBM's. With a positive minimum that writes matches of a row's
// end into the next row's beginning, where the search leaves the right image: there it is not
// asked.
int Differing(const cv::Mat& left, const cv::Mat& right, const MatcherParameters& p) {
  const auto peer = cv::StereoBM::create(p.disparity_range, p.correlation_window_size);
  peer->setMinDisparity(p.min_disparity);
  peer->setPreFilterCap(p.prefilter_cap);
  peer->setUniquenessRatio(static_cast<int>(p.uniqueness_ratio));
  peer->setTextureThreshold(p.texture_threshold);
  peer->setSpeckleWindowSize(p.speckle_size);
  peer->setSpeckleRange(p.speckle_range);
  cv::Mat expected;
  peer->compute(left, right, expected);
  const int first = p.min_disparity <= 0 ? 0 : p.min_disparity + p.disparity_range - 1;
  if (first >= left.cols) return 0;
  const cv::Range compared(first, left.cols);
  const cv::Mat found = Matcher(p).Match(left, right);
  return cv::countNonZero(found.colRange(compared) != expected.colRange(compared));
}

TEST(BlockMatcher, GivesTheDisparitiesOfOpenCV) {
  cv::RNG rng(1);
  cv::Mat left, right;
  int matched = 0;
  for (int i = 0; i < 60; ++i) {
    MatcherParameters p;
    p.correlation_window_size = 5 + 2 * rng.uniform(0, 16);  // From 23 on sums need 32 bits.
    p.disparity_range = 16 * rng.uniform(1, 7);
    p.min_disparity = rng.uniform(-40, 10);
    p.prefilter_cap = rng.uniform(1, 64);
    p.uniqueness_ratio = rng.uniform(0, 40);
    p.texture_threshold = rng.uniform(0, 2000);
    p.speckle_size = 0;
    const cv::Size size(rng.uniform(60, 330), rng.uniform(40, 130));
    MakePair(size, i, &left, &right);
    ASSERT_EQ(Differing(left, right, p), 0)
        << size << " window " << p.correlation_window_size << " minimum " << p.min_disparity
        << " range " << p.disparity_range << " cap " << p.prefilter_cap << " uniqueness "
        << p.uniqueness_ratio << " texture " << p.texture_threshold;
    Matcher matcher(p);
    matched += cv::countNonZero(matcher.Match(left, right) != matcher.Invalid());
  }
  EXPECT_GT(matched, 100000);
}

TEST(BlockMatcher, RemovesTheSpecklesOfOpenCV) {
  cv::Mat left, right;
  MakePair({320, 240}, 3, &left, &right);
  MatcherParameters p;
  cv::Mat without;
  for (const int size : {0, 20, 100, 1000}) {
    for (const int range : {0, 4, 31}) {
      p.speckle_size = size;
      p.speckle_range = range;
      EXPECT_EQ(Differing(left, right, p), 0) << size << " " << range;
    }
  }
}

}  // namespace
}  // namespace tld_follower::stereo
