// SPDX-License-Identifier: BSD-3-Clause
#include "sim/renderer.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace tld_follower::sim {
namespace {

// Stencil bits: what is the target, and where a shadow fell already.
constexpr GLint kTargetBit = 1;
constexpr GLint kShadowBit = 2;
constexpr btScalar kFallbackSize = btScalar(0.5);  // Of what stands in for a mesh [m].
constexpr double kSkyRadius = 100.0;

constexpr const char* kLitVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec2 light_uv;
uniform mat4 view;
uniform mat4 model;
uniform vec3 colour, ambient, sun_colour, sun_direction;
out vec3 light;
out vec2 place;
out vec2 light_place;
void main() {
  vec4 world = model * vec4(position, 1.0);
  vec3 n = mat3(model) * normal;
  float sky = 0.6 + 0.4 * n.z;
  light = colour * (ambient * sky + sun_colour * max(0.0, -dot(n, sun_direction)));
  place = uv;
  light_place = light_uv;
  gl_Position = view * world;
})";

constexpr const char* kLitFragment = R"(#version 330 core
in vec3 light;
in vec2 place;
uniform sampler2D texture0;
out vec4 result;
void main() { result = vec4(light * texture(texture0, place).rgb, 1.0); })";

constexpr const char* kGroundFragment = R"(#version 330 core
in vec3 light;
in vec2 place;
in vec2 light_place;
uniform sampler2D texture0;
uniform sampler2D texture1;
out vec4 result;
void main() {
  result = vec4(2.0 * light * texture(texture0, place).rgb * texture(texture1, light_place).rgb, 1.0);
})";

constexpr const char* kSkyVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 2) in vec2 uv;
uniform mat4 view;
uniform mat4 model;
out vec2 place;
void main() {
  place = uv;
  gl_Position = view * model * vec4(position, 1.0);
})";

constexpr const char* kSkyFragment = R"(#version 330 core
in vec2 place;
uniform sampler2D texture0;
out vec4 result;
void main() { result = texture(texture0, place); })";

constexpr const char* kShadowVertex = R"(#version 330 core
layout(location = 0) in vec3 position;
uniform mat4 view;
uniform mat4 model;
uniform vec3 sun_direction;
void main() {
  vec4 world = model * vec4(position, 1.0);
  // Along the sun's rays onto z = 0.
  world.xyz -= sun_direction * (max(world.z, 0.0) / sun_direction.z);
  gl_Position = view * world;
})";

constexpr const char* kShadowFragment = R"(#version 330 core
out vec4 result;
void main() { result = vec4(0.0, 0.0, 0.0, 0.45); })";

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

btTransform Place(const btTransform& pose, int frame, const std::vector<btTransform>& frames) {
  return frame < 0 ? pose : frames[size_t(frame)] * pose;
}

}  // namespace

Renderer::Renderer(const StereoCamera& camera, const World& world, const Scene& scene,
                   const Resources& resources, const WarningSink& warn)
    : camera_(camera),
      sun_direction_(world.sun_direction),
      resources_(resources),
      warn_(warn),
      lit_(kLitVertex, kLitFragment),
      ground_(kLitVertex, kGroundFragment),
      sky_(kSkyVertex, kSkyFragment),
      shadow_(kShadowVertex, kShadowFragment),
      framebuffer_(2 * camera.width, camera.height),
      sky_colour_{0.62f, 0.72f, 0.85f},
      stencil_(size_t(camera.width) * size_t(camera.height)) {
  const std::array<float, 3> sun{float(sun_direction_.x()), float(sun_direction_.y()),
                                 float(sun_direction_.z())};
  for (const GlProgram* program : {&lit_, &ground_, &sky_, &shadow_}) {
    program->Use();
    program->Set("sun_direction", sun);
    program->Set("sun_colour", world.sun_colour);
    program->Set("ambient", world.ambient);
    program->Set("texture0", 0);
    program->Set("texture1", 1);
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
    item.target = node.target;
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
  DrawEye(Eye::kLeft, mount, frames);
  DrawEye(Eye::kRight, mount, frames);

  const size_t bytes = size_t(camera_.width) * size_t(camera_.height) * 3;
  images->left.resize(bytes);
  images->right.resize(bytes);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, camera_.width, camera_.height, GL_RGB, GL_UNSIGNED_BYTE, images->left.data());
  glReadPixels(camera_.width, 0, camera_.width, camera_.height, GL_RGB, GL_UNSIGNED_BYTE,
               images->right.data());
  if (mask != nullptr) ReadMask(mask);
}

void Renderer::DrawEye(Eye eye, const btTransform& mount, const std::vector<btTransform>& frames) {
  glViewport(eye == Eye::kLeft ? 0 : camera_.width, 0, camera_.width, camera_.height);
  const btTransform optical = mount * camera_.Optical(eye);
  const std::array<float, 16> view = Multiply(camera_.Projection(), ToMatrix(optical.inverse()));
  for (const GlProgram* program : {&ground_, &lit_, &sky_, &shadow_}) {
    program->Use();
    program->Set("view", view);
  }
  // The ground first, since shadows are blended onto it before anything stands in front of it.
  glStencilFunc(GL_ALWAYS, 0, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  ground_.Use();
  DrawItems(ground_, true, frames);
  DrawShadows(frames);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  lit_.Use();
  DrawItems(lit_, false, frames);
  if (sky_texture_ != 0) DrawSky(optical);
}

void Renderer::DrawItems(const GlProgram& program, bool ground,
                         const std::vector<btTransform>& frames) {
  for (const Item& item : items_) {
    if (item.ground != ground) continue;
    program.Set("model", ToMatrix(Place(item.pose, item.frame, frames)));
    program.Set("colour", item.colour);
    glStencilFunc(GL_ALWAYS, item.target ? kTargetBit : 0, 0xff);
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, item.light_map);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, item.texture);
    meshes_[item.mesh].Draw();
  }
}

void Renderer::DrawShadows(const std::vector<btTransform>& frames) {
  if (sun_direction_.z() > -0.1) return;  // A sun this low has no shadow that ends.
  shadow_.Use();
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_FALSE);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(-1.f, -4.f);
  // Each pixel is darkened once, however many shadows fall on it.
  glStencilFunc(GL_NOTEQUAL, kShadowBit, kShadowBit);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  for (const Shadow& shadow : shadows_) {
    shadow_.Set("model", ToMatrix(Place(shadow.pose, shadow.frame, frames)));
    meshes_[shadow.mesh].Draw();
  }
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDepthMask(GL_TRUE);
  glEnable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

void Renderer::DrawSky(const btTransform& optical) {
  // Last, so that only what is really sky is shaded. It moves with the camera.
  sky_.Use();
  sky_.Set("model", ToMatrix(btTransform(btQuaternion::getIdentity(), optical.getOrigin())));
  glStencilFunc(GL_ALWAYS, 0, 0xff);
  glBindTexture(GL_TEXTURE_2D, sky_texture_);
  meshes_[sky_mesh_].Draw();
}

void Renderer::ReadMask(TargetMask* mask) {
  glReadPixels(0, 0, camera_.width, camera_.height, GL_STENCIL_INDEX, GL_UNSIGNED_BYTE,
               stencil_.data());
  int left = camera_.width, right = -1, top = camera_.height, bottom = -1;
  *mask = TargetMask();
  for (int y = 0; y < camera_.height; ++y) {
    const uint8_t* row = &stencil_[size_t(y) * size_t(camera_.width)];
    for (int x = 0; x < camera_.width; ++x) {
      if (row[x] != kTargetBit) continue;
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
