// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "stereo/views.h"
#include "synthetic.h"

namespace tld_follower::stereo {
namespace {

constexpr double kF = 250, kCx = 159.5, kCy = 119.5;
const cv::Size kSize(320, 240);

Calibration Rectified() { return MakeCalibration(kSize, kF, kCx, kCy, 0); }

// The rectified camera looks three columns further to the left.
Calibration Shifted() {
  Calibration calibration = Rectified();
  calibration.p(0, 2) += 3;
  return calibration;
}

TEST(Views, AMonochromeRectifiedCameraSharesItsPixelsInAllOfThem) {
  CameraViews views;
  const cv::Mat raw = MakeTexture(kSize, 1);
  views.Set(raw, Encoding::kMono, Rectified());
  for (const Texture* view :
       {&views.Grey(), &views.Colour(), &views.RectifiedGrey(), &views.RectifiedColour()}) {
    EXPECT_EQ(view->pixels.data, raw.data);
  }
}

TEST(Views, RectifiedOnesMoveAndRawOnesStay) {
  CameraViews views;
  cv::Mat raw;
  cv::cvtColor(MakeTexture(kSize, 2), raw, cv::COLOR_GRAY2RGB);
  views.Set(raw, Encoding::kRgb, Shifted());
  EXPECT_EQ(views.Colour().pixels.data, raw.data);
  EXPECT_TRUE(views.Colour().red_first && views.RectifiedColour().red_first);
  for (const auto& [view, rectified] : {std::pair(&views.Grey(), &views.RectifiedGrey()),
                                        std::pair(&views.Colour(), &views.RectifiedColour())}) {
    EXPECT_EQ(view->pixels.type(), rectified->pixels.type());
    EXPECT_EQ(cv::norm(view->pixels.colRange(0, kSize.width - 3),
                       rectified->pixels.colRange(3, kSize.width), cv::NORM_INF),
              0);
  }
}

TEST(Views, EachImageReplacesTheViewsOfTheLast) {
  CameraViews views;
  const cv::Mat first = MakeTexture(kSize, 3), second = MakeTexture(kSize, 4);
  views.Set(first, Encoding::kMono, Shifted());
  const cv::Mat before = views.RectifiedGrey().pixels.clone();
  views.Set(second, Encoding::kMono, Shifted());
  EXPECT_GT(cv::norm(views.RectifiedGrey().pixels, before, cv::NORM_INF), 50);
  EXPECT_EQ(views.Grey().pixels.data, second.data);
}

TEST(Views, SixteenBitImagesAreSeenWithEight) {
  CameraViews views;
  views.Set(cv::Mat(kSize, CV_16UC1, cv::Scalar(128 * 257)), Encoding::kMono, Rectified());
  EXPECT_EQ(views.RectifiedGrey().pixels.type(), CV_8UC1);
  EXPECT_EQ(views.RectifiedGrey().pixels.at<uchar>(5, 5), 128);
}

TEST(Views, OnlyRectifiedOnesNeedACalibration) {
  CameraViews views;
  const cv::Mat raw = MakeTexture(kSize, 5);
  views.Set(raw, Encoding::kMono, Calibration());
  EXPECT_EQ(views.Grey().pixels.data, raw.data);
  EXPECT_EQ(views.Colour().pixels.data, raw.data);
  EXPECT_THROW(views.RectifiedGrey(), std::invalid_argument);
  EXPECT_THROW(views.RectifiedColour(), std::invalid_argument);
}

}  // namespace
}  // namespace tld_follower::stereo
