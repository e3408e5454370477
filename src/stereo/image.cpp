// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/image.h"

#include <array>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace tld_follower::stereo {
namespace {

// OpenCV names a Bayer pattern by the second row's second and third pixel, ROS by the first row.
struct EncodingTraits {
  const char* name;
  int channels;
  int to_grey, to_bgr;  // cv::ColorConversionCodes; -1 if there is nothing to convert.
};
constexpr std::array<EncodingTraits, 9> kTraits{{
    {"mono8", 1, -1, -1},
    {"bgr8", 3, cv::COLOR_BGR2GRAY, -1},
    {"rgb8", 3, cv::COLOR_RGB2GRAY, -1},
    {"bgra8", 4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    {"rgba8", 4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    {"bayer_rggb8", 1, cv::COLOR_BayerBG2GRAY, cv::COLOR_BayerBG2BGR},
    {"bayer_bggr8", 1, cv::COLOR_BayerRG2GRAY, cv::COLOR_BayerRG2BGR},
    {"bayer_gbrg8", 1, cv::COLOR_BayerGR2GRAY, cv::COLOR_BayerGR2BGR},
    {"bayer_grbg8", 1, cv::COLOR_BayerGB2GRAY, cv::COLOR_BayerGB2BGR},
}};

const EncodingTraits& Traits(Encoding encoding) { return kTraits[static_cast<size_t>(encoding)]; }

cv::Mat Convert(const cv::Mat& raw, int code, cv::Mat* buffer) {
  if (code < 0) return raw;
  cv::cvtColor(raw, *buffer, code);
  return *buffer;
}

}  // namespace

Encoding ParseEncoding(const std::string& name) {
  if (name == "8UC1") return Encoding::kMono;
  if (name == "8UC3") return Encoding::kBgr;
  for (size_t i = 0; i < kTraits.size(); ++i) {
    if (name == kTraits[i].name) return static_cast<Encoding>(i);
  }
  throw std::invalid_argument("image encoding '" + name +
                              "' is not one of mono8, 8UC1, bgr8, 8UC3, rgb8, bgra8, rgba8, "
                              "bayer_{rggb,bggr,gbrg,grbg}8");
}

int Channels(Encoding encoding) { return Traits(encoding).channels; }

cv::Mat ToGrey(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer) {
  return Convert(raw, Traits(encoding).to_grey, buffer);
}

Texture ToTexture(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer) {
  return {Convert(raw, Traits(encoding).to_bgr, buffer), encoding == Encoding::kRgb};
}

}  // namespace tld_follower::stereo
