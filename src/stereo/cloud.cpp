// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/cloud.h"

#include <pcl/conversions.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "stereo/matcher.h"

namespace tld_follower::stereo {
namespace {

using Point = pcl::PointXYZRGB;

// Packs the colour of pixel u as PCL wants it in `rgb`: blue in the lowest byte.
struct Grey {
  static uint32_t Pack(const uchar* row, int u) { return row[u] * 0x010101u; }
};
template <int kRed, int kBlue>
struct Colour {
  static uint32_t Pack(const uchar* row, int u) {
    const uchar* pixel = row + 3 * u;
    return static_cast<uint32_t>(pixel[kRed]) << 16 | static_cast<uint32_t>(pixel[1]) << 8 |
           pixel[kBlue];
  }
};

// depth[i] is z of the disparity lowest + i; NaN comes through every product, so nothing branches.
template <typename Packing>
void Fill(const cv::Mat& disparity, int lowest, const float* depth, const float* slopes, double cy,
          double fy, const cv::Mat& texture, uint8_t* out) {
  for (int v = 0; v < disparity.rows; ++v) {
    const auto* fixed = disparity.ptr<int16_t>(v);
    const uchar* colour = texture.ptr(v);
    const auto slope = static_cast<float>((v - cy) / fy);
    for (int u = 0; u < disparity.cols; ++u, out += sizeof(Point)) {
      const float z = depth[fixed[u] - lowest];
      const float xyz[4] = {slopes[u] * z, slope * z, z, 1.0f};
      const uint32_t rgb[4] = {Packing::Pack(colour, u), 0, 0, 0};
      std::memcpy(out, xyz, sizeof xyz);
      std::memcpy(out + sizeof xyz, rgb, sizeof rgb);
    }
  }
}

void LayOut(const cv::Size& size, pcl::PCLPointCloud2* cloud) {
  if (cloud->fields.empty()) {
    pcl::for_each_type<pcl::traits::fieldList<Point>::type>(
        pcl::detail::FieldAdder<Point>(cloud->fields));
  }
  cloud->height = size.height;
  cloud->width = size.width;
  cloud->is_bigendian = false;
  cloud->is_dense = false;
  cloud->point_step = sizeof(Point);
  cloud->row_step = cloud->point_step * cloud->width;
  cloud->data.resize(static_cast<size_t>(cloud->row_step) * cloud->height);
}

}  // namespace

void CloudMaker::Make(const cv::Mat& disparity, int min_disparity, const Texture& texture,
                      const StereoGeometry& geometry, pcl::PCLPointCloud2* cloud) {
  if (disparity.type() != CV_16SC1 || texture.pixels.size() != disparity.size() ||
      (texture.pixels.type() != CV_8UC1 && texture.pixels.type() != CV_8UC3)) {
    throw std::invalid_argument("a cloud needs disparity (CV_16SC1) and 8-bit colour of one size");
  }
  LayOut(disparity.size(), cloud);
  if (disparity.empty()) return;

  // A fixed-point disparity has few values: each depth is divided out once, in double precision.
  double smallest = 0, largest = 0;
  cv::minMaxIdx(disparity, &smallest, &largest);
  const int lowest = static_cast<int>(smallest);
  depth_.resize(static_cast<size_t>(largest - smallest) + 1);
  for (size_t i = 0; i < depth_.size(); ++i) {
    const int fixed = lowest + static_cast<int>(i);
    const double d = static_cast<double>(fixed) / kSteps - geometry.offset;
    depth_[i] = fixed >= min_disparity * kSteps && d > 0
                    ? static_cast<float>(geometry.fx * geometry.baseline / d)
                    : std::numeric_limits<float>::quiet_NaN();
  }
  slopes_.resize(disparity.cols);
  for (int u = 0; u < disparity.cols; ++u) {
    slopes_[u] = static_cast<float>((u - geometry.cx) / geometry.fx);
  }

  const auto fill_as = texture.pixels.channels() == 1 ? &Fill<Grey>
                       : texture.red_first            ? &Fill<Colour<0, 2>>
                                                      : &Fill<Colour<2, 0>>;
  fill_as(disparity, lowest, depth_.data(), slopes_.data(), geometry.cy, geometry.fy,
          texture.pixels, cloud->data.data());
}

}  // namespace tld_follower::stereo
