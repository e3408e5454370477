// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/conversions_node.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <boost/make_shared.hpp>
#include <stdexcept>

namespace tld_follower::stereo {

cv::Mat ToMat(const sensor_msgs::Image& image, int type) {
  const size_t row = image.width * CV_ELEM_SIZE(type);
  if (row == 0 || image.height == 0) throw std::invalid_argument("the image is empty");
  if (image.step < row || image.data.size() < static_cast<size_t>(image.step) * image.height) {
    throw std::invalid_argument("the image has fewer bytes than its size and encoding ask for");
  }
  if (CV_MAT_DEPTH(type) == CV_16U &&
      (image.is_bigendian != 0) != (boost::endian::order::native == boost::endian::order::big)) {
    throw std::invalid_argument("the image's 16-bit pixels are in another byte order");
  }
  // OpenCV has no constant views.
  return cv::Mat(image.height, image.width, type, const_cast<uint8_t*>(image.data.data()),
                 image.step);
}

Calibration ToCalibration(const sensor_msgs::CameraInfo& info) {
  const double bin_x = std::max(1u, info.binning_x), bin_y = std::max(1u, info.binning_y);
  const auto& roi = info.roi;
  const cv::Matx33d window(1 / bin_x, 0, -(roi.x_offset / bin_x), 0, 1 / bin_y,
                           -(roi.y_offset / bin_y), 0, 0, 1);
  Calibration calibration;
  calibration.size = cv::Size(static_cast<int>((roi.width ? roi.width : info.width) / bin_x),
                              static_cast<int>((roi.height ? roi.height : info.height) / bin_y));
  calibration.distortion_model = info.distortion_model;
  calibration.d = info.D;
  calibration.k = window * cv::Matx33d(info.K.data());
  // Drivers of rectified cameras often leave R empty.
  const bool has_r = std::any_of(info.R.begin(), info.R.end(), [](double r) { return r != 0; });
  calibration.r = has_r ? cv::Matx33d(info.R.data()) : cv::Matx33d::eye();
  calibration.p = window * cv::Matx34d(info.P.data());
  return calibration;
}

MatcherParameters ToParameters(const tld_follower::StereoConfig& config) {
  MatcherParameters parameters;
  parameters.algorithm = static_cast<Algorithm>(config.stereo_algorithm);
  parameters.prefilter_cap = config.prefilter_cap;
  parameters.correlation_window_size = config.correlation_window_size;
  parameters.min_disparity = config.min_disparity;
  parameters.disparity_range = config.disparity_range;
  parameters.uniqueness_ratio = config.uniqueness_ratio;
  parameters.texture_threshold = config.texture_threshold;
  parameters.speckle_size = config.speckle_size;
  parameters.speckle_range = config.speckle_range;
  parameters.full_dp = config.fullDP;
  parameters.p1 = config.P1;
  parameters.p2 = config.P2;
  parameters.disp12_max_diff = config.disp12MaxDiff;
  return parameters;
}

CloudFilterParameters ToParameters(const tld_follower::CloudFilterConfig& config) {
  CloudFilterParameters parameters;
  parameters.crop_min =
      Eigen::Vector3d(config.crop_min_x, config.crop_min_y, config.crop_min_z).cast<float>();
  parameters.crop_max =
      Eigen::Vector3d(config.crop_max_x, config.crop_max_y, config.crop_max_z).cast<float>();
  parameters.voxel_size = static_cast<float>(config.voxel_size);
  parameters.outlier_removal = static_cast<OutlierRemoval>(config.outlier_removal);
  parameters.mean_k = config.mean_k;
  parameters.deviations = config.deviations;
  parameters.radius = config.radius;
  parameters.min_neighbours = config.min_neighbours;
  return parameters;
}

sensor_msgs::ImagePtr ToMessage(const Texture& texture, const std_msgs::Header& header) {
  namespace encodings = sensor_msgs::image_encodings;
  const cv::Mat& pixels = texture.pixels;
  auto message = boost::make_shared<sensor_msgs::Image>();
  message->header = header;
  message->height = pixels.rows;
  message->width = pixels.cols;
  message->encoding = pixels.channels() == 1 ? encodings::MONO8
                      : texture.red_first    ? encodings::RGB8
                                             : encodings::BGR8;
  message->step = pixels.cols * static_cast<uint32_t>(pixels.elemSize());
  message->data.resize(static_cast<size_t>(message->step) * pixels.rows);
  pixels.copyTo(cv::Mat(pixels.size(), pixels.type(), message->data.data(), message->step));
  return message;
}

}  // namespace tld_follower::stereo
