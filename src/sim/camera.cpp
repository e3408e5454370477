// SPDX-License-Identifier: BSD-3-Clause
#include "sim/camera.h"

#include <cmath>
#include <stdexcept>

namespace tld_follower::sim {

void StereoCamera::Check() const {
  if (width < 16 || height < 16 || width > 4096 || height > 4096) {
    throw std::invalid_argument("the camera's width and height must be 16 to 4096 pixels");
  }
  if (!(hfov > 0.05 && hfov < 3.0)) throw std::invalid_argument("hfov must be 0.05 to 3 rad");
  if (!(baseline > 0)) throw std::invalid_argument("baseline must be positive");
}

double StereoCamera::FocalLength() const { return width / 2.0 / std::tan(hfov / 2); }

btTransform StereoCamera::Mount() const {
  return btTransform(btQuaternion(btVector3(0, 1, 0), btScalar(pitch)), position);
}

btTransform StereoCamera::Optical(Eye eye) const {
  const btMatrix3x3 optical(0, 0, 1, -1, 0, 0, 0, -1, 0);
  const btScalar half = btScalar(baseline / 2);
  return btTransform(optical, btVector3(0, eye == Eye::kLeft ? half : -half, 0));
}

bool StereoCamera::Sees(const btVector3& centre, double radius) const {
  const double tan_x = width / 2.0 / FocalLength(), tan_y = height / 2.0 / FocalLength();
  // Distances from the planes through the image's edges.
  return centre.z() > near - radius &&
         std::abs(centre.x()) - centre.z() * tan_x < radius * std::hypot(1, tan_x) &&
         std::abs(centre.y()) - centre.z() * tan_y < radius * std::hypot(1, tan_y);
}

std::array<float, 16> StereoCamera::Projection() const {
  // OpenGL's y grows with the row in memory, as does v; cx and cy lie in the middle of the image.
  const double fx = 2 * FocalLength() / width;
  const double fy = 2 * FocalLength() / height;
  const double a = (far + near) / (far - near);
  const double b = -2 * far * near / (far - near);
  std::array<float, 16> m{};
  m[0] = float(fx);
  m[5] = float(fy);
  m[10] = float(a);
  m[14] = float(b);
  m[11] = 1.f;
  return m;
}

}  // namespace tld_follower::sim
