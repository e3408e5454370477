// SPDX-License-Identifier: BSD-3-Clause
// The 8-bit image encodings of ROS as the matcher (grey) and the cloud (colour) want them.
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
  kBayerRggb,
  kBayerBggr,
  kBayerGbrg,
  kBayerGrbg
};

/// Reads a ROS encoding: mono8, bgr8, rgb8, bgra8, rgba8 or bayer_{rggb,bggr,gbrg,grbg}8; 8UC1 and
/// 8UC3 are read as mono8 and bgr8. Throws std::invalid_argument for any other.
Encoding ParseEncoding(const std::string& name);

/// Bytes of one raw pixel.
int Channels(Encoding encoding);

/// Grey image (CV_8UC1) of a raw one. Shares its pixels if it is grey; else `buffer` holds them.
cv::Mat ToGrey(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer);

/// Colour of every pixel: CV_8UC1 (grey) or CV_8UC3, blue first unless `red_first`.
struct Texture {
  cv::Mat pixels;
  bool red_first = false;
};

/// Colours of a raw image. Shares its pixels unless a Bayer pattern must be unfolded into `buffer`
/// or an alpha channel left out there.
Texture ToTexture(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer);

}  // namespace tld_follower::stereo
