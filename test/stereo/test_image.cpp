// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>
#include <stdexcept>

#include "stereo/image.h"

namespace tld_follower::stereo {
namespace {

const cv::Vec3b kBgr(40, 120, 220);
constexpr int kGreyLevel = 141;  // 0.114 * 40 + 0.587 * 120 + 0.299 * 220

TEST(Image, KnowsTheEncodingsOfTheContractOnly) {
  const auto expect = [](const char* name, Encoding encoding, int type) {
    const PixelFormat format = ParseEncoding(name);
    EXPECT_EQ(format.encoding, encoding) << name;
    EXPECT_EQ(format.type, type) << name;
  };
  expect("mono8", Encoding::kMono, CV_8UC1);
  expect("8UC1", Encoding::kMono, CV_8UC1);
  expect("mono16", Encoding::kMono, CV_16UC1);
  expect("bgr8", Encoding::kBgr, CV_8UC3);
  expect("8UC3", Encoding::kBgr, CV_8UC3);
  expect("rgb16", Encoding::kRgb, CV_16UC3);
  expect("rgba8", Encoding::kRgba, CV_8UC4);
  expect("yuv422", Encoding::kYuv422, CV_8UC2);
  expect("bayer_grbg8", Encoding::kBayerGrbg, CV_8UC1);
  expect("bayer_rggb16", Encoding::kBayerRggb, CV_16UC1);
  for (const char* name : {"", "mono", "32FC1", "MONO8", "yuv4228", "yuv42216", "bayer_rgbg8"}) {
    EXPECT_THROW(ParseEncoding(name), std::invalid_argument) << name;
  }
}

TEST(Image, SixteenBitsAreScaledToEight) {
  cv::Mat buffer;
  const cv::Mat deep = (cv::Mat_<uint16_t>(1, 4) << 0, 257, 32896, 65535);
  const cv::Mat scaled = To8Bit(deep, &buffer);
  EXPECT_EQ(scaled.type(), CV_8UC1);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(scaled.at<uchar>(i), (std::array{0, 1, 128, 255}[i]));
  EXPECT_EQ(To8Bit(scaled, &buffer).data, scaled.data);
}

TEST(Image, YuvIsUyvy) {
  cv::Mat buffer;
  const cv::Mat raw(4, 6, CV_8UC2,
                    cv::Scalar(128, 90));  // No colour, so grey level 1.164 (90 - 16).
  EXPECT_EQ(ToGrey(raw, Encoding::kYuv422, &buffer).at<uchar>(2, 3), 90);
  EXPECT_EQ(ToTexture(raw, Encoding::kYuv422, &buffer).pixels.at<cv::Vec3b>(2, 3),
            cv::Vec3b(86, 86, 86));
}

TEST(Image, GreyIsSharedAndColourWeighted) {
  cv::Mat buffer;
  const cv::Mat grey(4, 6, CV_8UC1, cv::Scalar(kGreyLevel));
  EXPECT_EQ(ToGrey(grey, Encoding::kMono, &buffer).data, grey.data);
  const cv::Mat bgr(4, 6, CV_8UC3, cv::Scalar(kBgr));
  EXPECT_EQ(ToGrey(bgr, Encoding::kBgr, &buffer).at<uchar>(2, 3), kGreyLevel);
  const cv::Mat rgb(4, 6, CV_8UC3, cv::Scalar(kBgr[2], kBgr[1], kBgr[0]));
  EXPECT_EQ(ToGrey(rgb, Encoding::kRgb, &buffer).at<uchar>(2, 3), kGreyLevel);
}

TEST(Image, TextureSharesColourAndSaysItsOrder) {
  cv::Mat buffer;
  const cv::Mat pixels(4, 6, CV_8UC3, cv::Scalar(kBgr));
  const Texture rgb = ToTexture(pixels, Encoding::kRgb, &buffer);
  EXPECT_EQ(rgb.pixels.data, pixels.data);
  EXPECT_TRUE(rgb.red_first);
  EXPECT_FALSE(ToTexture(pixels, Encoding::kBgr, &buffer).red_first);
}

TEST(Image, AlphaIsLeftOut) {
  cv::Mat buffer;
  for (const std::string name : {"bgra8", "rgba8"}) {
    const cv::Scalar pixel(kBgr[name == "bgra8" ? 0 : 2], kBgr[1], kBgr[name == "bgra8" ? 2 : 0],
                           9);
    const cv::Mat raw(4, 6, CV_8UC4, pixel);
    const Encoding encoding = ParseEncoding(name).encoding;
    EXPECT_EQ(ToGrey(raw, encoding, &buffer).at<uchar>(2, 3), kGreyLevel) << name;
    const Texture texture = ToTexture(raw, encoding, &buffer);
    EXPECT_EQ(texture.pixels.at<cv::Vec3b>(2, 3), kBgr) << name;
    EXPECT_FALSE(texture.red_first);
  }
}

TEST(Image, EveryBayerPatternGivesItsColourBack) {
  for (const std::string pattern : {"rggb", "bggr", "gbrg", "grbg"}) {
    cv::Mat raw(8, 8, CV_8UC1), buffer;
    for (int y = 0; y < raw.rows; ++y) {
      for (int x = 0; x < raw.cols; ++x) {
        const char colour = pattern[2 * (y % 2) + x % 2];
        raw.at<uchar>(y, x) = colour == 'b' ? kBgr[0] : colour == 'g' ? kBgr[1] : kBgr[2];
      }
    }
    const Encoding encoding = ParseEncoding("bayer_" + pattern + "8").encoding;
    EXPECT_EQ(ToTexture(raw, encoding, &buffer).pixels.at<cv::Vec3b>(4, 4), kBgr) << pattern;
    EXPECT_NEAR(ToGrey(raw, encoding, &buffer).at<uchar>(4, 4), kGreyLevel, 1) << pattern;
  }
}

}  // namespace
}  // namespace tld_follower::stereo
