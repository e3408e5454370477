// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/camera.h"
#include "sim/gl.h"
#include "sim/resources.h"
#include "sim/sun_map.h"
#include "sim/world.h"

namespace tld_follower::sim {

/// A visual that is drawn, and the moving frame that carries it.
struct SceneNode {
  Visual visual;
  int frame = -1;  ///< Index into the poses given to Render, or -1 for the world.
  int label = 0;   ///< What it belongs to, one of the labels below.
};

/// Labels of pixels. Models have the following ones in their order; those too many share the last.
enum Label { kSkyLabel = 0, kTargetLabel = 1, kVehicleLabel = 2, kFirstModelLabel = 3 };
constexpr int kLastLabel = 63;

/// A shape whose shadow falls on the ground at z = 0; with a map of shadows the visuals cast
/// theirs.
struct ShadowNode {
  Collision shape;
  int frame = -1;
};

struct Scene {
  std::vector<SceneNode> visuals;
  std::vector<ShadowNode> shadows;
};

/// RGB images, rows of 3 * width bytes from top to bottom.
struct StereoImages {
  std::vector<uint8_t> left, right;
};

/// The target's visible pixels in the left image: tight box and count.
struct TargetMask {
  int x = 0, y = 0, width = 0, height = 0;
  int pixels = 0;
};

/// Draws the scene into a stereo pair with OpenGL: textures with mipmaps, a sun lit at the
/// vertices, a sky dome, and shadows: on the ground alone, or with a shadow map on everything
/// within 12 m of what lies ahead. Equal calls give equal bytes.
class Renderer {
 public:
  /// `world` gives the light and the sky. A missing texture is reported to `warn` and drawn as a
  /// magenta chequerboard; a missing or unreadable mesh is reported likewise and drawn as a box of
  /// 0.5 m. Throws std::runtime_error without OpenGL.
  Renderer(const StereoCamera& camera, const World& world, const Scene& scene, bool shadow_map,
           const Resources& resources, const WarningSink& warn);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// Draws with the camera's mount at `mount` and frame i at `frames[i]` (world frame). Fills
  /// `mask` unless it is null.
  void Render(const btTransform& mount, const std::vector<btTransform>& frames,
              StereoImages* images, TargetMask* mask);

  /// Depth along the optical axis [m] of the left image's pixels as drawn last, by rows from the
  /// top; infinity in the sky.
  void ReadDepth(std::vector<float>* depth);
  /// Labels of the left image's pixels as drawn last, by rows from the top.
  void ReadLabels(std::vector<uint8_t>* labels);

  int triangles() const;
  const StereoCamera& camera() const { return camera_; }

 private:
  struct Item {
    size_t mesh;
    GLuint texture = 0;
    GLuint light_map = 0;
    std::array<float, 3> colour;
    btTransform pose;
    int frame;
    int label;
    bool ground;
  };
  struct Shadow {
    size_t mesh;
    btTransform pose;
    int frame;
  };

  size_t AddMesh(const Geometry& geometry, double texture_size);
  Mesh LoadMesh(const Geometry& geometry);
  GLuint Texture(const std::string& uri);
  GLuint NeutralLightMap();
  void Arrange(const std::vector<btTransform>& frames);
  void DrawSunMap(const btTransform& mount);
  void DrawEye(Eye eye, const btTransform& mount);
  void DrawItems(const GlProgram& program, bool ground, const btTransform& optical);
  void DrawShadows(const btTransform& optical);
  void DrawSky(const btTransform& optical);
  void ReadMask(TargetMask* mask);

  StereoCamera camera_;
  btVector3 sun_direction_;
  const Resources resources_;
  const WarningSink warn_;
  GlContext context_;
  GlProgram lit_, ground_, sky_, shadow_, depth_;
  std::optional<SunMap> sun_map_;
  GlFramebuffer framebuffer_;
  std::vector<GlMesh> meshes_;
  std::map<std::string, size_t> mesh_by_key_;
  std::map<std::string, GLuint> texture_by_uri_;
  std::vector<Item> items_;
  std::vector<btTransform> item_poses_, shadow_poses_;  // In the picture that is being drawn.
  std::vector<Shadow> shadows_;
  size_t sky_mesh_ = 0;
  GLuint sky_texture_ = 0;
  std::array<float, 3> sky_colour_;
  std::vector<uint8_t> labels_;
};

}  // namespace tld_follower::sim
