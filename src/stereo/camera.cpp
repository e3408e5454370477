// SPDX-License-Identifier: BSD-3-Clause
#include "stereo/camera.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>

namespace tld_follower::stereo {
namespace {

// Calibration tools print 6 or more digits; what differs by less is the same number.
bool Close(double a, double b) { return std::abs(a - b) <= 1e-6 * std::max(1.0, std::abs(a)); }

bool IsCalibrated(const Calibration& camera) {
  return std::isfinite(camera.p(0, 0)) && camera.p(0, 0) > 0 && std::isfinite(camera.p(1, 1)) &&
         camera.p(1, 1) > 0;
}

bool IsFinite(const Calibration& camera) {
  return cv::checkRange(camera.k) && cv::checkRange(camera.r) && cv::checkRange(camera.p) &&
         cv::checkRange(camera.d);
}

void MakeMaps(const Calibration& camera, cv::Mat* map_xy, cv::Mat* map_fraction) {
  const cv::Matx33d p = camera.p.get_minor<3, 3>(0, 0);
  const size_t n = camera.d.size();
  if (camera.distortion_model == "equidistant" && n == 4) {
    cv::fisheye::initUndistortRectifyMap(camera.k, camera.d, camera.r, p, camera.size, CV_16SC2,
                                         *map_xy, *map_fraction);
  } else if (n == 0 || (camera.distortion_model == "plumb_bob" && (n == 4 || n == 5)) ||
             (camera.distortion_model == "rational_polynomial" && (n == 8 || n == 12 || n == 14))) {
    cv::initUndistortRectifyMap(camera.k, camera.d, camera.r, p, camera.size, CV_16SC2, *map_xy,
                                *map_fraction);
  } else {
    std::ostringstream text;
    text
        << "camera_info has " << n << " distortion coefficients of the model '"
        << camera.distortion_model
        << "'; known are plumb_bob (4 or 5), rational_polynomial (8, 12 or 14) and equidistant (4)";
    throw std::invalid_argument(text.str());
  }
}

}  // namespace

bool Calibration::operator==(const Calibration& other) const {
  return size == other.size && distortion_model == other.distortion_model && d == other.d &&
         k == other.k && r == other.r && p == other.p;
}

bool Calibration::IsRectified() const {
  if (std::any_of(d.begin(), d.end(), [](double c) { return c != 0; })) return false;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      if (!Close(r(row, col), row == col ? 1 : 0) || !Close(k(row, col), p(row, col))) return false;
    }
  }
  return true;
}

StereoGeometry StereoGeometry::From(const Calibration& left, const Calibration& right) {
  for (const auto* camera : {&left, &right}) {
    if (!IsCalibrated(*camera)) {
      throw std::invalid_argument(std::string(camera == &left ? "left" : "right") +
                                  " camera_info is uncalibrated: P holds no focal length");
    }
  }
  if (!Close(left.p(0, 0), right.p(0, 0)) || !Close(left.p(1, 1), right.p(1, 1)) ||
      !Close(left.p(1, 2), right.p(1, 2))) {
    throw std::invalid_argument(
        "left and right camera_info are not of one stereo calibration: P differs in fx, fy or cy");
  }
  StereoGeometry geometry;
  geometry.fx = left.p(0, 0);
  geometry.fy = left.p(1, 1);
  geometry.cx = left.p(0, 2);
  geometry.cy = left.p(1, 2);
  geometry.baseline = -right.p(0, 3) / right.p(0, 0);
  geometry.offset = left.p(0, 2) - right.p(0, 2);
  if (!(geometry.baseline > 0) || !std::isfinite(geometry.baseline)) {
    throw std::invalid_argument(
        "right camera_info holds no baseline: P[3] must be -fx * baseline, negative (are left and "
        "right swapped, or is the pair not calibrated as a stereo pair?)");
  }
  return geometry;
}

cv::Mat Rectifier::Rectify(const cv::Mat& raw, const Calibration& calibration) {
  if (raw.size() != calibration.size) {
    std::ostringstream text;
    text << "camera_info is of an image of " << calibration.size << " pixels, the image has "
         << raw.size();
    throw std::invalid_argument(text.str());
  }
  if (!IsFinite(calibration)) throw std::invalid_argument("camera_info holds NaN or infinity");
  if (calibration != calibration_) {
    calibration_ = {};  // Stays unset should the maps fail.
    map_xy_.release();
    map_fraction_.release();
    if (!calibration.IsRectified()) MakeMaps(calibration, &map_xy_, &map_fraction_);
    calibration_ = calibration;
  }
  if (map_xy_.empty()) return raw;
  cv::remap(raw, rectified_, map_xy_, map_fraction_, cv::INTER_LINEAR);
  return rectified_;
}

}  // namespace tld_follower::stereo
