// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "stereo/matcher.h"
#include "synthetic.h"

namespace tld_follower::stereo {
namespace {

const cv::Size kSize(320, 240);

struct Agreement {
  double matched = 0;     // Share of the pixels with a disparity.
  double right = 0;       // Share of these within half a pixel of the truth.
  double mean_error = 0;  // Of these [pixel].
};

template <typename Truth>
Agreement Compare(const cv::Mat& disparity, int invalid, const cv::Rect& window, Truth truth) {
  int matched = 0, right = 0;
  double sum = 0;
  for (int y = window.y; y < window.br().y; ++y) {
    for (int x = window.x; x < window.br().x; ++x) {
      const int fixed = disparity.at<int16_t>(y, x);
      if (fixed == invalid) continue;
      const double error = static_cast<double>(fixed) / kSteps - truth(x, y);
      ++matched;
      right += std::abs(error) <= 0.5;
      sum += error;
    }
  }
  return {static_cast<double>(matched) / window.area(), static_cast<double>(right) / matched,
          sum / matched};
}

class EveryAlgorithm : public testing::TestWithParam<Algorithm> {
 protected:
  MatcherParameters Parameters() const {
    MatcherParameters parameters;
    parameters.algorithm = GetParam();
    return parameters;
  }
};
INSTANTIATE_TEST_SUITE_P(Matcher, EveryAlgorithm,
                         testing::Values(Algorithm::kBlockMatching, Algorithm::kSemiGlobal));

TEST_P(EveryAlgorithm, FindsAShiftOverTheWholeSearchMinimumIncluded) {
  const cv::Mat left = MakeTexture(kSize, 1);
  Matcher matcher(Parameters());
  for (int shift : {0, 1, 12, 40, 62}) {
    const cv::Mat& disparity = matcher.Match(left, MakeRight(left, shift));
    const auto result = Compare(disparity, matcher.Invalid(), matcher.ValidWindow(kSize),
                                [&](int, int) { return shift; });
    EXPECT_GT(result.matched, 0.99) << shift;
    EXPECT_GT(result.right, 0.99) << shift;
    EXPECT_NEAR(result.mean_error, 0, 0.07) << shift;
  }
}

TEST_P(EveryAlgorithm, FindsASlantedPlaneBetweenPixels) {
  const cv::Mat left = MakeTexture(kSize, 2);
  const double base = 10.3, along_x = 0.05, along_y = 0.04;
  Matcher matcher(Parameters());
  const cv::Mat& disparity = matcher.Match(left, MakeRight(left, base, along_x, along_y));
  const auto result = Compare(disparity, matcher.Invalid(), matcher.ValidWindow(kSize),
                              [&](int x, int y) { return base + along_x * x + along_y * y; });
  EXPECT_GT(result.matched, 0.95);
  EXPECT_GT(result.right, 0.97);
  EXPECT_NEAR(result.mean_error, 0, 0.07);
}

TEST_P(EveryAlgorithm, SearchesFromAnyMinimum) {
  const cv::Mat left = MakeTexture(kSize, 3);
  for (int minimum : {-48, -16, 16}) {
    auto p = Parameters();
    p.min_disparity = minimum;
    Matcher matcher(p);
    EXPECT_EQ(matcher.Invalid(), (minimum - 1) * kSteps);
    for (int shift : {minimum, minimum + 20}) {
      const cv::Mat& disparity = matcher.Match(left, MakeRight(left, shift));
      const auto result = Compare(disparity, matcher.Invalid(), matcher.ValidWindow(kSize),
                                  [&](int, int) { return shift; });
      EXPECT_GT(result.matched, 0.99) << minimum << " " << shift;
      EXPECT_GT(result.right, 0.99) << minimum << " " << shift;
    }
  }
}

TEST_P(EveryAlgorithm, GivesLittleForUnrelatedImages) {
  Matcher matcher(Parameters());
  const cv::Mat& disparity = matcher.Match(MakeTexture(kSize, 4), MakeTexture(kSize, 5));
  EXPECT_LT(cv::countNonZero(disparity != matcher.Invalid()), 0.1 * kSize.area());
}

TEST_P(EveryAlgorithm, TakesAnotherSizeInMidFlight) {
  Matcher matcher(Parameters());
  for (const cv::Size size : {kSize, cv::Size(640, 480), cv::Size(161, 121)}) {
    const cv::Mat left = MakeTexture(size, 6);
    const cv::Mat& disparity = matcher.Match(left, MakeRight(left, 9));
    EXPECT_EQ(disparity.size(), size);
    EXPECT_EQ(disparity.type(), CV_16SC1);
    const auto result = Compare(disparity, matcher.Invalid(), matcher.ValidWindow(size),
                                [](int, int) { return 9; });
    EXPECT_GT(result.right, 0.99);
  }
}

TEST_P(EveryAlgorithm, RefusesWhatItCannotMatch) {
  Matcher matcher(Parameters());
  const cv::Mat good = MakeTexture(kSize, 7);
  EXPECT_THROW(matcher.Match({}, good), std::invalid_argument);
  EXPECT_THROW(matcher.Match(good, MakeTexture({320, 239}, 7)), std::invalid_argument);
  EXPECT_THROW(matcher.Match(good, cv::Mat(kSize, CV_8UC3)), std::invalid_argument);
  const cv::Mat small = MakeTexture({40, 15}, 7);
  EXPECT_THROW(matcher.Match(small, small), std::invalid_argument);
  const cv::Mat narrow = MakeTexture({40, 40}, 7);  // Narrower than the search: no match, no error.
  EXPECT_EQ(cv::countNonZero(matcher.Match(narrow, narrow) != matcher.Invalid()), 0);
  EXPECT_GT(cv::countNonZero(matcher.Match(good, MakeRight(good, 9)) != matcher.Invalid()), 0);
}

TEST(Matcher, RoundsItsParameters) {
  MatcherParameters parameters;
  parameters.correlation_window_size = 12;
  parameters.disparity_range = 100;
  const Matcher matcher(parameters);
  EXPECT_EQ(matcher.parameters().correlation_window_size, 13);
  EXPECT_EQ(matcher.parameters().disparity_range, 96);
  parameters.disparity_range = 15;
  EXPECT_THROW(Matcher{parameters}, std::invalid_argument);
  parameters.disparity_range = 64;
  parameters.correlation_window_size = 3;
  EXPECT_THROW(Matcher{parameters}, std::invalid_argument);
}

TEST(Matcher, NewParametersTakeEffect) {
  const cv::Mat left = MakeTexture(kSize, 8), right = MakeRight(left, 70);
  Matcher matcher;
  EXPECT_LT(cv::countNonZero(matcher.Match(left, right) == 70 * kSteps), 100);
  MatcherParameters parameters;
  parameters.disparity_range = 96;
  matcher.SetParameters(parameters);
  const auto result = Compare(matcher.Match(left, right), matcher.Invalid(),
                              matcher.ValidWindow(kSize), [](int, int) { return 70; });
  EXPECT_GT(result.right, 0.99);
}

TEST(Matcher, ValidWindowIsWhereTheSearchStaysInside) {
  MatcherParameters parameters;
  EXPECT_EQ(Matcher(parameters).ValidWindow(kSize), cv::Rect(70, 7, 320 - 7 - 70, 240 - 14));
  parameters.min_disparity = -16;
  EXPECT_EQ(Matcher(parameters).ValidWindow(kSize), cv::Rect(54, 7, 320 - 7 - 16 - 54, 240 - 14));
  EXPECT_EQ(Matcher().ValidWindow({70, 240}), cv::Rect());
}

TEST(Matcher, PixelsHaveTheOffsetTakenOff) {
  const cv::Mat fixed = (cv::Mat_<int16_t>(1, 3) << -16, 0, 12 * kSteps + 3);
  cv::Mat pixels;
  ToPixels(fixed, 2.5, &pixels);
  ASSERT_EQ(pixels.type(), CV_32FC1);
  EXPECT_FLOAT_EQ(pixels.at<float>(0), -3.5f);
  EXPECT_FLOAT_EQ(pixels.at<float>(1), -2.5f);
  EXPECT_FLOAT_EQ(pixels.at<float>(2), 9.6875f);
}

}  // namespace
}  // namespace tld_follower::stereo
