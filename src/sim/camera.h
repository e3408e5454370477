// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <LinearMath/btTransform.h>

#include <array>

namespace tld_follower::sim {

enum class Eye { kLeft = 0, kRight = 1 };

/// A rectified stereo pair of pinhole cameras on the drone. Defaults are Spiri's.
///
/// An optical frame has z forward, x right and y down (REP-103). A point (X, Y, Z) of it falls on
/// u = f X / Z + cx, v = f Y / Z + cy, in pixels with whole numbers at pixel centres.
struct StereoCamera {
  int width = 640;             ///< [pixel]
  int height = 480;            ///< [pixel]
  double hfov = 1.1344640138;  ///< Horizontal field of view [rad]; 65 degrees.
  double baseline = 0.049;     ///< [m]
  btVector3 position{btScalar(0.080), btScalar(0.005), btScalar(-0.0165)};  ///< On the drone [m].
  double pitch = 0.34;                                                      ///< Downwards [rad].
  double near = 0.03;  ///< Clipping distance [m].
  double far = 150.0;  ///< Clipping distance [m].

  /// Throws std::invalid_argument if a value is out of range.
  void Check() const;

  double FocalLength() const;  ///< [pixel]
  double Cx() const { return (width - 1) / 2.0; }
  double Cy() const { return (height - 1) / 2.0; }

  /// Pose of the camera's mount (x forward, z up, between the two eyes) in the drone's frame.
  btTransform Mount() const;
  /// Pose of an eye's optical frame in the mount's frame.
  btTransform Optical(Eye eye) const;

  /// Whether part of a sphere about `centre` (optical frame) may be in the image.
  bool Sees(const btVector3& centre, double radius) const;

  /// OpenGL projection of optical coordinates to clip space, column major. Image row 0 becomes the
  /// first row in memory, so that no flip is needed after reading back.
  std::array<float, 16> Projection() const;
};

}  // namespace tld_follower::sim
