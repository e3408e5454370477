// SPDX-License-Identifier: BSD-3-Clause
// The image encodings of ROS as the matcher (grey) and the cloud (colour) want them.
#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace tld_follower::stereo {

enum class Encoding {
  kMono,
  kBgr,
  kRgb,
  kBgra,
  kRgba,
  kYuv422,
  kBayerRggb,
  kBayerBggr,
  kBayerGbrg,
  kBayerGrbg
};

/// What a raw image holds: its encoding, and the OpenCV type of its pixels (8 or 16 bit).
struct PixelFormat {
  Encoding encoding = Encoding::kMono;
  int type = CV_8UC1;
};

/// Reads a ROS encoding: mono, bgr, rgb, bgra, rgba or bayer_{rggb,bggr,gbrg,grbg}, each with 8 or
/// 16 bit (mono8, bayer_rggb16), or yuv422 (UYVY, 8 bit); {8,16}UC1 and {8,16}UC3 are read as mono
/// and bgr. Throws std::invalid_argument for any other.
PixelFormat ParseEncoding(const std::string& name);

/// The image with 8 bit a channel: itself, or scaled from 16 bit (65535 becomes 255) in `buffer`.
cv::Mat To8Bit(const cv::Mat& raw, cv::Mat* buffer);

/// Grey image (CV_8UC1) of a raw 8-bit one. Shares its pixels if it is grey; else `buffer` holds
/// them.
cv::Mat ToGrey(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer);

/// Colour of every pixel: CV_8UC1 (grey) or CV_8UC3, blue first unless `red_first`.
struct Texture {
  cv::Mat pixels;
  bool red_first = false;
};

/// Colours of a raw 8-bit image. Shares its pixels unless they must be converted into `buffer`: a
/// Bayer pattern, YUV or an alpha channel.
Texture ToTexture(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer);

}  // namespace tld_follower::stereo
