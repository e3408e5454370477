// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <stdexcept>

#include "stereo/camera.h"
#include "stereo/matcher.h"
#include "synthetic.h"

namespace tld_follower::stereo {
namespace {

const cv::Size kSize(320, 240);
constexpr double kF = 250, kCx = 161, kCy = 118;

Calibration MakeLeft() { return MakeCalibration(kSize, kF, kCx, kCy, 0); }
Calibration MakeRightCamera() { return MakeCalibration(kSize, kF, kCx, kCy, -kF * 0.05); }

// What a camera of `calibration` sees of a rectified image: the inverse of the rectification, by
// cv::undistortPoints, which the code under test does not use.
cv::Mat MakeRaw(const cv::Mat& rectified, const Calibration& calibration) {
  std::vector<cv::Point2d> pixels, sources;
  for (int v = 0; v < kSize.height; ++v) {
    for (int u = 0; u < kSize.width; ++u) pixels.emplace_back(u, v);
  }
  const cv::Matx33d p = calibration.p.get_minor<3, 3>(0, 0);
  if (calibration.distortion_model == "equidistant") {
    cv::fisheye::undistortPoints(pixels, sources, calibration.k, calibration.d, calibration.r, p);
  } else {
    cv::undistortPoints(
        pixels, sources, calibration.k, calibration.d, calibration.r, p,
        cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 50, 1e-9));
  }
  cv::Mat map, raw;
  cv::Mat(sources).reshape(2, kSize.height).convertTo(map, CV_32F);
  cv::remap(rectified, raw, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return raw;
}

double MeanDifference(const cv::Mat& a, const cv::Mat& b) {
  const cv::Rect inner(40, 40, kSize.width - 80, kSize.height - 80);
  cv::Mat difference;
  cv::absdiff(a(inner), b(inner), difference);
  return cv::mean(difference)[0];
}

std::vector<Calibration> UnrectifiedCameras() {
  std::vector<Calibration> cameras(4, MakeLeft());
  cameras[0].d = {-0.25, 0.08, 0.001, -0.002, 0};
  cv::Rodrigues(cv::Vec3d(0.02, -0.03, 0.01), cameras[0].r);
  cameras[0].k = cv::Matx33d(240, 0, 155, 0, 243, 121, 0, 0, 1);
  cameras[1].distortion_model = "rational_polynomial";
  cameras[1].d = {-0.2, 0.05, 0.001, 0.001, 0.01, 0.05, 0.01, 0.0};
  cameras[2].distortion_model = "equidistant";
  cameras[2].d = {-0.02, 0.01, 0, 0};
  cameras[3].d.clear();  // No distortion, but a rotation.
  cv::Rodrigues(cv::Vec3d(0, 0, 0.05), cameras[3].r);
  return cameras;
}

TEST(Camera, LeavesARectifiedImageAlone) {
  const cv::Mat raw = MakeTexture(kSize, 1);
  Rectifier rectifier;
  EXPECT_EQ(rectifier.Rectify(raw, MakeLeft()).data, raw.data);
  Calibration no_coefficients = MakeLeft();
  no_coefficients.d.clear();
  no_coefficients.distortion_model.clear();
  EXPECT_EQ(rectifier.Rectify(raw, no_coefficients).data, raw.data);
}

TEST(Camera, UndoesDistortionRotationAndOtherIntrinsics) {
  const cv::Mat ideal = MakeTexture(kSize, 2);
  for (const Calibration& camera : UnrectifiedCameras()) {
    EXPECT_FALSE(camera.IsRectified());
    const cv::Mat raw = MakeRaw(ideal, camera);
    Rectifier rectifier;
    EXPECT_GT(MeanDifference(raw, ideal), 15) << camera.distortion_model;
    EXPECT_LT(MeanDifference(rectifier.Rectify(raw, camera), ideal), 5) << camera.distortion_model;
  }
}

TEST(Camera, FollowsAChangeOfCalibration) {
  const auto cameras = UnrectifiedCameras();
  const cv::Mat ideal = MakeTexture(kSize, 3);
  Rectifier rectifier;
  for (const Calibration& camera : {cameras[0], cameras[0], cameras[3], MakeLeft(), cameras[0]}) {
    const cv::Mat raw = camera.IsRectified() ? ideal : MakeRaw(ideal, camera);
    EXPECT_LT(MeanDifference(rectifier.Rectify(raw, camera), ideal), 5);
  }
}

TEST(Camera, ADistortedPairMatchesOnceRectified) {
  const cv::Mat left = MakeTexture(kSize, 4), right = MakeRight(left, 14);
  const auto cameras = UnrectifiedCameras();
  Rectifier left_rectifier, right_rectifier;
  Matcher matcher;
  const cv::Mat raw_left = MakeRaw(left, cameras[0]), raw_right = MakeRaw(right, cameras[1]);
  const auto share_right = [&](const cv::Mat& a, const cv::Mat& b) {
    const cv::Rect inner(90, 20, 200, 200);
    const cv::Mat near = cv::abs(matcher.Match(a, b)(inner) - 14 * kSteps) <= kSteps / 2;
    return cv::countNonZero(near) / static_cast<double>(inner.area());
  };
  EXPECT_LT(share_right(raw_left, raw_right), 0.2);
  EXPECT_GT(share_right(left_rectifier.Rectify(raw_left, cameras[0]),
                        right_rectifier.Rectify(raw_right, cameras[1])),
            0.95);
}

TEST(Camera, RefusesAnotherSizeOrModelAndRecovers) {
  Rectifier rectifier;
  const cv::Mat raw = MakeTexture(kSize, 5);
  EXPECT_THROW(rectifier.Rectify(MakeTexture({321, 240}, 5), MakeLeft()), std::invalid_argument);
  Calibration odd = MakeLeft();
  odd.d = {0.1, 0.2, 0.3};
  EXPECT_THROW(rectifier.Rectify(raw, odd), std::invalid_argument);
  EXPECT_THROW(rectifier.Rectify(raw, odd), std::invalid_argument);
  odd.d = {0.1, 0, 0, 0, 0};
  odd.distortion_model = "kaleidoscope";
  EXPECT_THROW(rectifier.Rectify(raw, odd), std::invalid_argument);
  odd = MakeLeft();
  odd.d[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(rectifier.Rectify(raw, odd), std::invalid_argument);
  EXPECT_EQ(rectifier.Rectify(raw, MakeLeft()).data, raw.data);
}

TEST(Geometry, ReadsBothProjections) {
  Calibration right = MakeRightCamera();
  right.p(0, 2) = kCx - 5;
  const auto geometry = StereoGeometry::From(MakeLeft(), right);
  EXPECT_DOUBLE_EQ(geometry.fx, kF);
  EXPECT_DOUBLE_EQ(geometry.cx, kCx);
  EXPECT_DOUBLE_EQ(geometry.cy, kCy);
  EXPECT_DOUBLE_EQ(geometry.baseline, 0.05);
  EXPECT_DOUBLE_EQ(geometry.offset, 5);
}

TEST(Geometry, RefusesWhatIsNoStereoPair) {
  const auto left = MakeLeft(), right = MakeRightCamera();
  const auto refused = [&](int row, int column, double value) {
    Calibration changed = right;
    changed.p(row, column) = value;
    EXPECT_THROW(StereoGeometry::From(left, changed), std::invalid_argument)
        << row << " " << column << " " << value;
  };
  refused(0, 0, 0);
  refused(0, 0, std::numeric_limits<double>::quiet_NaN());
  refused(0, 0, kF + 1);
  refused(1, 2, kCy + 1);
  refused(0, 3, 0);
  refused(0, 3, 12.5);
  refused(0, 3, -std::numeric_limits<double>::infinity());
  EXPECT_THROW(StereoGeometry::From(Calibration(), right), std::invalid_argument);
  EXPECT_THROW(StereoGeometry::From(right, left), std::invalid_argument);
}

}  // namespace
}  // namespace tld_follower::stereo
