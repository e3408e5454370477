// SPDX-License-Identifier: BSD-3-Clause
// GLSL of the renderer. With SHADOW_MAP defined, the sun's light is taken from what it does not
// reach.
#pragma once

namespace tld_follower::sim::shaders {

constexpr const char* kVersion = "#version 330 core\n";
constexpr const char* kWithShadowMap = "#version 330 core\n#define SHADOW_MAP\n";

constexpr const char* kLitVertex = R"(
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
#ifdef SHADOW_MAP
uniform mat4 sun_view;
out vec3 sun_light;
out vec3 sun_place;
#endif
void main() {
  vec4 world = model * vec4(position, 1.0);
  vec3 n = mat3(model) * normal;
  float sky = 0.6 + 0.4 * n.z;
  vec3 sun = sun_colour * max(0.0, -dot(n, sun_direction));
#ifdef SHADOW_MAP
  light = colour * (ambient * sky);
  sun_light = colour * sun;
  sun_place = (sun_view * world).xyz * 0.5 + 0.5;
#else
  light = colour * (ambient * sky + sun);
#endif
  place = uv;
  light_place = light_uv;
  gl_Position = view * world;
})";

// The light of a fragment, for both kinds of surface.
constexpr const char* kFragmentLight = R"(
in vec3 light;
in vec2 place;
in vec2 light_place;
uniform sampler2D texture0;
uniform sampler2D texture1;
out vec4 result;
#ifdef SHADOW_MAP
in vec3 sun_light;
in vec3 sun_place;
uniform sampler2DShadow sun_map;
vec3 lit() { return light + sun_light * texture(sun_map, sun_place); }
#else
vec3 lit() { return light; }
#endif
)";

constexpr const char* kLitFragment = R"(
void main() { result = vec4(lit() * texture(texture0, place).rgb, 1.0); })";

constexpr const char* kGroundFragment = R"(
void main() {
  result = vec4(2.0 * lit() * texture(texture0, place).rgb * texture(texture1, light_place).rgb, 1.0);
})";

constexpr const char* kSkyVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 2) in vec2 uv;
uniform mat4 view;
uniform mat4 model;
out vec2 place;
void main() {
  place = uv;
  gl_Position = view * model * vec4(position, 1.0);
})";

constexpr const char* kSkyFragment = R"(
in vec2 place;
uniform sampler2D texture0;
out vec4 result;
void main() { result = texture(texture0, place); })";

constexpr const char* kShadowVertex = R"(
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

constexpr const char* kShadowFragment = R"(
out vec4 result;
void main() { result = vec4(0.0, 0.0, 0.0, 0.45); })";

constexpr const char* kDepthVertex = R"(
layout(location = 0) in vec3 position;
uniform mat4 view;
uniform mat4 model;
void main() { gl_Position = view * model * vec4(position, 1.0); })";

constexpr const char* kDepthFragment = R"(
void main() {})";

}  // namespace tld_follower::sim::shaders
