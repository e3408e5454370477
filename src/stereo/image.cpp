// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/image.h"

#include <array>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace tld_follower::stereo {
namespace {

// OpenCV names a Bayer pattern by the second row's second and third pixel, ROS by the first row.
struct EncodingTraits {
  const char* name;  // Without the number of bits.
  int channels;
  int to_grey, to_bgr;  // cv::ColorConversionCodes; -1 if there is nothing to convert.
};
constexpr std::array<EncodingTraits, 10> kTraits{{
    {"mono", 1, -1, -1},
    {"bgr", 3, cv::COLOR_BGR2GRAY, -1},
    {"rgb", 3, cv::COLOR_RGB2GRAY, -1},
    {"bgra", 4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    {"rgba", 4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    {"yuv422", 2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    {"bayer_rggb", 1, cv::COLOR_BayerBG2GRAY, cv::COLOR_BayerBG2BGR},
    {"bayer_bggr", 1, cv::COLOR_BayerRG2GRAY, cv::COLOR_BayerRG2BGR},
    {"bayer_gbrg", 1, cv::COLOR_BayerGR2GRAY, cv::COLOR_BayerGR2BGR},
    {"bayer_grbg", 1, cv::COLOR_BayerGB2GRAY, cv::COLOR_BayerGB2BGR},
}};

const EncodingTraits& Traits(Encoding encoding) { return kTraits[static_cast<size_t>(encoding)]; }

cv::Mat Convert(const cv::Mat& raw, int code, cv::Mat* buffer) {
  if (code < 0) return raw;
  cv::cvtColor(raw, *buffer, code);
  return *buffer;
}

}  // namespace

PixelFormat ParseEncoding(const std::string& name) {
  for (const int depth : {CV_8U, CV_16U}) {
    const std::string bits = depth == CV_8U ? "8" : "16";
    if (name == bits + "UC1") return {Encoding::kMono, CV_MAKETYPE(depth, 1)};
    if (name == bits + "UC3") return {Encoding::kBgr, CV_MAKETYPE(depth, 3)};
    for (size_t i = 0; i < kTraits.size(); ++i) {
      const auto encoding = static_cast<Encoding>(i);
      const bool is_yuv = encoding == Encoding::kYuv422;
      if (is_yuv && depth != CV_8U) continue;
      if (name == kTraits[i].name + (is_yuv ? "" : bits)) {
        return {encoding, CV_MAKETYPE(depth, kTraits[i].channels)};
      }
    }
  }
  throw std::invalid_argument("image encoding '" + name +
                              "' is not one of {mono,bgr,rgb,bgra,rgba}{8,16}, {8,16}UC{1,3}, "
                              "yuv422, bayer_{rggb,bggr,gbrg,grbg}{8,16}");
}

cv::Mat To8Bit(const cv::Mat& raw, cv::Mat* buffer) {
  if (raw.depth() == CV_8U) return raw;
  raw.convertTo(*buffer, CV_8U, 255.0 / 65535.0);
  return *buffer;
}

cv::Mat ToGrey(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer) {
  return Convert(raw, Traits(encoding).to_grey, buffer);
}

Texture ToTexture(const cv::Mat& raw, Encoding encoding, cv::Mat* buffer) {
  return {Convert(raw, Traits(encoding).to_bgr, buffer), encoding == Encoding::kRgb};
}

}  // namespace tld_follower::stereo
