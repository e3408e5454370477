// SPDX-License-Identifier: BSD-3-Clause
#include "sim/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "sim/shaders.h"

namespace tld_follower::sim {
namespace {

// The stencil holds a pixel's label, whether it is ground, and whether a shadow fell on it.
constexpr GLint kLabelBits = 0x3f, kGroundBit = 0x40, kShadowBit = 0x80;
static_assert(kLastLabel == kLabelBits);
constexpr int kSunMapUnit = 2;
constexpr double kAhead = 5.0;  // What the map of shadows is centred on, before the camera [m].
constexpr btScalar kFallbackSize = btScalar(0.5);  // Of what stands in for a mesh [m].
constexpr double kSkyRadius = 100.0;

std::array<float, 16> ToMatrix(const btTransform& pose) {
  btScalar m[16];
  pose.getOpenGLMatrix(m);
  std::array<float, 16> result;
  std::copy(m, m + 16, result.begin());
  return result;
}

std::array<float, 16> Multiply(const std::array<float, 16>& a, const std::array<float, 16>& b) {
  std::array<float, 16> c{};
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      for (int k = 0; k < 4; ++k) c[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    }
  }
  return c;
}

// What cannot be overlooked where a texture is missing.
cv::Mat MissingTexture() {
  cv::Mat image(64, 64, CV_8UC4, cv::Scalar(20, 20, 20, 255));
  const cv::Scalar magenta(255, 0, 255, 255);
  cv::rectangle(image, {0, 0, 32, 32}, magenta, cv::FILLED);
  cv::rectangle(image, {32, 32, 32, 32}, magenta, cv::FILLED);
  return image;
}

// What has a light map and receives shadows, but casts none.
bool IsGround(const Geometry& geometry) {
  return geometry.type == Geometry::Type::kPlane || geometry.type == Geometry::Type::kTerrain;
}

std::string Source(const char* text, bool shadow_map) {
  return std::string(shadow_map ? shaders::kWithShadowMap : shaders::kVersion) + text;
}

btTransform Place(const btTransform& pose, int frame, const std::vector<btTransform>& frames) {
  return frame < 0 ? pose : frames[size_t(frame)] * pose;
}

}  // namespace

Renderer::Renderer(const StereoCamera& camera, const World& world, const Scene& scene,
                   bool shadow_map, const Resources& resources, const WarningSink& warn)
    : camera_(camera),
      sun_direction_(world.sun_direction),
      resources_(resources),
      warn_(warn),
      lit_(Source(shaders::kLitVertex, shadow_map),
           Source(shaders::kFragmentLight, shadow_map) + shaders::kLitFragment),
      ground_(Source(shaders::kLitVertex, shadow_map),
              Source(shaders::kFragmentLight, shadow_map) + shaders::kGroundFragment),
      sky_(Source(shaders::kSkyVertex, false), Source(shaders::kSkyFragment, false)),
      shadow_(Source(shaders::kShadowVertex, false), Source(shaders::kShadowFragment, false)),
      depth_(Source(shaders::kDepthVertex, false), Source(shaders::kDepthFragment, false)),
      framebuffer_(2 * camera.width, camera.height),
      sky_colour_{0.62f, 0.72f, 0.85f} {
  if (shadow_map) sun_map_.emplace(world.sun_direction);
  const std::array<float, 3> sun{float(sun_direction_.x()), float(sun_direction_.y()),
                                 float(sun_direction_.z())};
  for (const GlProgram* program : {&lit_, &ground_, &sky_, &shadow_}) {
    program->Use();
    program->Set("sun_direction", sun);
    program->Set("sun_colour", world.sun_colour);
    program->Set("ambient", world.ambient);
    program->Set("texture0", 0);
    program->Set("texture1", 1);
    program->Set("sun_map", kSunMapUnit);
  }
  for (const SceneNode& node : scene.visuals) {
    const Material& material = node.visual.material;
    Item item;
    item.mesh = AddMesh(node.visual.geometry, material.texture_size);
    item.texture = Texture(material.texture);
    item.ground = IsGround(node.visual.geometry);
    item.light_map = material.light_map.empty() ? NeutralLightMap() : Texture(material.light_map);
    item.colour = material.colour;
    item.pose = node.visual.pose;
    item.frame = node.frame;
    item.label = std::min(node.label, kLastLabel);
    items_.push_back(item);
  }
  for (const ShadowNode& node : scene.shadows) {
    if (IsGround(node.shape.geometry)) continue;
    shadows_.push_back({AddMesh(node.shape.geometry, 1.0), node.shape.pose, node.frame});
  }
  if (!world.sky_texture.empty()) {
    meshes_.emplace_back(MakeSkyDome(kSkyRadius));
    sky_mesh_ = meshes_.size() - 1;
    sky_texture_ = Texture(world.sky_texture);
  }
}

Renderer::~Renderer() { context_.MakeCurrent(); }

size_t Renderer::AddMesh(const Geometry& geometry, double texture_size) {
  std::ostringstream key;
  key << int(geometry.type) << ' ' << geometry.size.x() << ' ' << geometry.size.y() << ' '
      << geometry.size.z() << ' ' << texture_size << ' ' << geometry.mesh;
  const auto [place, is_new] = mesh_by_key_.try_emplace(key.str(), meshes_.size());
  if (!is_new) return place->second;
  if (geometry.type == Geometry::Type::kMesh) {
    meshes_.emplace_back(LoadMesh(geometry));
  } else {
    meshes_.emplace_back(MakePrimitive(geometry, texture_size));
  }
  return place->second;
}

Mesh Renderer::LoadMesh(const Geometry& geometry) {
  std::string problem = "it is missing";
  const std::string file = resources_.Find(geometry.mesh);
  if (!file.empty()) {
    try {
      return LoadObj(file, geometry.size);
    } catch (const std::runtime_error& error) {
      problem = error.what();
    }
  }
  warn_("mesh '" + geometry.mesh + "': " + problem + "; drawing a box");
  Geometry box;
  box.size.setValue(kFallbackSize, kFallbackSize, kFallbackSize);
  return MakePrimitive(box, 1.0);
}

GLuint Renderer::Texture(const std::string& uri) {
  const auto [place, is_new] = texture_by_uri_.try_emplace(uri, 0);
  if (!is_new) return place->second;
  cv::Mat rgba;
  if (uri.empty()) {
    rgba = cv::Mat(1, 1, CV_8UC4, cv::Scalar(255, 255, 255, 255));
  } else {
    const std::string file = resources_.Find(uri);
    const cv::Mat image = file.empty() ? cv::Mat() : cv::imread(file, cv::IMREAD_COLOR);
    if (image.empty()) {
      warn_("texture '" + uri + "' is " + (file.empty() ? "missing" : "unreadable") +
            "; drawing a magenta chequerboard");
      rgba = MissingTexture();
    } else {
      cv::cvtColor(image, rgba, cv::COLOR_BGR2RGBA);
    }
  }
  place->second = UploadTexture(rgba.cols, rgba.rows, rgba.data);
  return place->second;
}

GLuint Renderer::NeutralLightMap() {
  const unsigned char grey[4] = {128, 128, 128, 255};
  const auto [place, is_new] = texture_by_uri_.try_emplace("neutral light map", 0);
  if (is_new) place->second = UploadTexture(1, 1, grey);
  return place->second;
}

int Renderer::triangles() const {
  int count = 0;
  for (const Item& item : items_) count += meshes_[item.mesh].triangles();
  for (const Shadow& shadow : shadows_) count += meshes_[shadow.mesh].triangles();
  return count + (sky_texture_ != 0 ? meshes_[sky_mesh_].triangles() : 0);
}

void Renderer::Render(const btTransform& mount, const std::vector<btTransform>& frames,
                      StereoImages* images, TargetMask* mask) {
  context_.MakeCurrent();
  Arrange(frames);
  if (sun_map_) DrawSunMap(mount);
  framebuffer_.Bind();
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CW);  // The projection turns the image upside down for the readback.
  glDepthFunc(GL_LEQUAL);
  glEnable(GL_STENCIL_TEST);
  glStencilMask(0xff);
  glClearColor(sky_colour_[0], sky_colour_[1], sky_colour_[2], 1);
  glClearStencil(0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  DrawEye(Eye::kLeft, mount);
  DrawEye(Eye::kRight, mount);

  const size_t bytes = size_t(camera_.width) * size_t(camera_.height) * 3;
  images->left.resize(bytes);
  images->right.resize(bytes);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, camera_.width, camera_.height, GL_RGB, GL_UNSIGNED_BYTE, images->left.data());
  glReadPixels(camera_.width, 0, camera_.width, camera_.height, GL_RGB, GL_UNSIGNED_BYTE,
               images->right.data());
  if (mask != nullptr) ReadMask(mask);
}

void Renderer::Arrange(const std::vector<btTransform>& frames) {
  item_poses_.clear();
  for (const Item& item : items_) item_poses_.push_back(Place(item.pose, item.frame, frames));
  shadow_poses_.clear();
  for (const Shadow& shadow : shadows_) {
    shadow_poses_.push_back(Place(shadow.pose, shadow.frame, frames));
  }
}

void Renderer::DrawSunMap(const btTransform& mount) {
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  sun_map_->Begin(mount.getOrigin() + btScalar(kAhead) * mount.getBasis().getColumn(0));
  depth_.Use();
  depth_.Set("view", sun_map_->view());
  for (size_t i = 0; i < items_.size(); ++i) {
    const btTransform& pose = item_poses_[i];
    depth_.Set("model", ToMatrix(pose));
    meshes_[items_[i].mesh].Draw([&](const btVector3& centre, btScalar radius) {
      return sun_map_->Sees(pose * centre, radius);
    });
  }
  sun_map_->End();
  for (const GlProgram* program : {&lit_, &ground_}) {
    program->Use();
    program->Set("sun_view", sun_map_->view());
  }
  sun_map_->Bind(kSunMapUnit);
}

void Renderer::DrawEye(Eye eye, const btTransform& mount) {
  glViewport(eye == Eye::kLeft ? 0 : camera_.width, 0, camera_.width, camera_.height);
  const btTransform optical = mount * camera_.Optical(eye);
  const std::array<float, 16> view = Multiply(camera_.Projection(), ToMatrix(optical.inverse()));
  for (const GlProgram* program : {&ground_, &lit_, &sky_, &shadow_}) {
    program->Use();
    program->Set("view", view);
  }
  // What stands on the ground first: it hides much of the ground, which is dear to shade. The sky
  // last, for the same reason.
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  lit_.Use();
  DrawItems(lit_, false, optical);
  ground_.Use();
  DrawItems(ground_, true, optical);
  if (!sun_map_) DrawShadows(optical);
  glStencilFunc(GL_ALWAYS, kSkyLabel, 0xff);
  if (sky_texture_ != 0) DrawSky(optical);
}

void Renderer::DrawItems(const GlProgram& program, bool ground, const btTransform& optical) {
  for (size_t i = 0; i < items_.size(); ++i) {
    const Item& item = items_[i];
    if (item.ground != ground) continue;
    const btTransform in_view = optical.inverseTimes(item_poses_[i]);
    const auto sees = [&](const btVector3& centre, btScalar radius) {
      return camera_.Sees(in_view * centre, radius);
    };
    if (!meshes_[item.mesh].AnyPiece(sees)) continue;
    program.Set("model", ToMatrix(item_poses_[i]));
    program.Set("colour", item.colour);
    glStencilFunc(GL_ALWAYS, item.label | (ground ? kGroundBit : 0), 0xff);
    if (ground) {
      glActiveTexture(GL_TEXTURE1);
      glBindTexture(GL_TEXTURE_2D, item.light_map);
    }
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, item.texture);
    meshes_[item.mesh].Draw(sees);
  }
}

void Renderer::DrawShadows(const btTransform& optical) {
  if (sun_direction_.z() > -0.1) return;  // A sun this low has no shadow that ends.
  shadow_.Use();
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_FALSE);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(-1.f, -4.f);
  // Only the ground is darkened, each pixel once, however many shadows fall on it.
  glStencilFunc(GL_EQUAL, kGroundBit, kGroundBit | kShadowBit);
  glStencilMask(kShadowBit);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INVERT);
  const btTransform to_view = optical.inverse();
  // A sphere's shadow lies within a sphere about its centre's shadow.
  const btScalar stretch = 1 + 1 / btFabs(sun_direction_.z());
  for (size_t i = 0; i < shadows_.size(); ++i) {
    const btTransform& pose = shadow_poses_[i];
    shadow_.Set("model", ToMatrix(pose));
    meshes_[shadows_[i].mesh].Draw([&](const btVector3& centre, btScalar radius) {
      btVector3 place = pose * centre;
      place -= sun_direction_ * (btMax(place.z(), btScalar(0)) / sun_direction_.z());
      return camera_.Sees(to_view * place, stretch * radius);
    });
  }
  glStencilMask(0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDepthMask(GL_TRUE);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void Renderer::DrawSky(const btTransform& optical) {
  // It moves with the camera.
  sky_.Use();
  sky_.Set("model", ToMatrix(btTransform(btQuaternion::getIdentity(), optical.getOrigin())));
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, sky_texture_);
  meshes_[sky_mesh_].Draw([](const btVector3&, btScalar) { return true; });
}

void Renderer::ReadLabels(std::vector<uint8_t>* labels) {
  labels->resize(size_t(camera_.width) * size_t(camera_.height));
  context_.MakeCurrent();
  framebuffer_.Bind();
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, camera_.width, camera_.height, GL_STENCIL_INDEX, GL_UNSIGNED_BYTE,
               labels->data());
  for (uint8_t& label : *labels) label &= kLabelBits;
}

void Renderer::ReadDepth(std::vector<float>* depth) {
  ReadLabels(&labels_);
  depth->resize(labels_.size());
  glReadPixels(0, 0, camera_.width, camera_.height, GL_DEPTH_COMPONENT, GL_FLOAT, depth->data());
  const double near = camera_.near, far = camera_.far;
  for (size_t i = 0; i < depth->size(); ++i) {
    float& value = (*depth)[i];
    value = labels_[i] == kSkyLabel ? std::numeric_limits<float>::infinity()
                                    : float(near * far / (far - double(value) * (far - near)));
  }
}

void Renderer::ReadMask(TargetMask* mask) {
  ReadLabels(&labels_);
  int left = camera_.width, right = -1, top = camera_.height, bottom = -1;
  *mask = TargetMask();
  for (int y = 0; y < camera_.height; ++y) {
    const uint8_t* row = &labels_[size_t(y) * size_t(camera_.width)];
    for (int x = 0; x < camera_.width; ++x) {
      if (row[x] != kTargetLabel) continue;
      ++mask->pixels;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = y;
    }
  }
  if (mask->pixels > 0) {
    mask->x = left;
    mask->y = top;
    mask->width = right - left + 1;
    mask->height = bottom - top + 1;
  }
}

}  // namespace tld_follower::sim
