// SPDX-License-Identifier: BSD-3-Clause
#include "sim/sun_map.h"

#include <cmath>
#include <stdexcept>

namespace tld_follower::sim {
namespace {

constexpr int kPixels = 1024;
constexpr double kReach = 12.0;  // Half the map's edge [m].
constexpr double kDepth = 40.0;  // Half its depth [m].

// Rows of the result are the map's axes.
btMatrix3x3 Axes(const btVector3& direction) {
  const btVector3 other = std::abs(direction.x()) < 0.9 ? btVector3(1, 0, 0) : btVector3(0, 1, 0);
  const btVector3 x = direction.cross(other).normalized();
  const btVector3 y = direction.cross(x);
  return btMatrix3x3(x.x(), x.y(), x.z(), y.x(), y.y(), y.z(), direction.x(), direction.y(),
                     direction.z());
}

}  // namespace

SunMap::SunMap(const btVector3& direction) : to_map_(Axes(direction)) {
  glGenTextures(1, &depth_);
  glBindTexture(GL_TEXTURE_2D, depth_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, kPixels, kPixels, 0, GL_DEPTH_COMPONENT,
               GL_UNSIGNED_INT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  // Outside of the map the sun shines.
  const float farthest[4] = {1, 1, 1, 1};
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, farthest);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  glGenFramebuffers(1, &framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_, 0);
  glDrawBuffer(GL_NONE);
  glReadBuffer(GL_NONE);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("OpenGL cannot draw the map of shadows");
  }
}

SunMap::~SunMap() {
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteTextures(1, &depth_);
}

void SunMap::Begin(const btVector3& focus) {
  // Moved by whole pixels, or the shadows' edges would crawl.
  const double pixel = 2 * kReach / kPixels;
  middle_ = to_map_ * focus;
  middle_.setX(btScalar(pixel * std::round(middle_.x() / pixel)));
  middle_.setY(btScalar(pixel * std::round(middle_.y() / pixel)));
  const double scale[3] = {1 / kReach, 1 / kReach, 1 / kDepth};
  view_ = {};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      view_[size_t(4 * column + row)] = float(scale[row] * to_map_[row][column]);
    }
    view_[size_t(12 + row)] = float(-scale[row] * middle_[row]);
  }
  view_[15] = 1;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, kPixels, kPixels);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(2.f, 4.f);  // Or what is lit would shade itself.
  glClear(GL_DEPTH_BUFFER_BIT);
}

void SunMap::End() const {
  glDisable(GL_POLYGON_OFFSET_FILL);
  glEnable(GL_CULL_FACE);
  glEnable(GL_STENCIL_TEST);
}

void SunMap::Bind(int unit) const {
  glActiveTexture(GLenum(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, depth_);
}

bool SunMap::Sees(const btVector3& centre, double radius) const {
  const btVector3 offset = to_map_ * centre - middle_;
  return std::abs(offset.x()) < kReach + radius && std::abs(offset.y()) < kReach + radius;
}

}  // namespace tld_follower::sim
