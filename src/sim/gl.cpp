// SPDX-License-Identifier: BSD-3-Clause
#include "sim/gl.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

namespace tld_follower::sim {
namespace {

GLuint Compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    char log[1024] = {};
    glGetShaderInfoLog(shader, sizeof log, nullptr, log);
    throw std::runtime_error(std::string("a shader does not compile: ") + log);
  }
  return shader;
}

}  // namespace

void SetDrawingThreads(int count) {
  setenv("LP_NUM_THREADS", std::to_string(count).c_str(), /*overwrite=*/0);
}

GlContext::GlContext() {
  SetDrawingThreads(0);  // Unless told before: the other cores have a tracker to run.
  const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  EGLDisplay display =
      get_display ? get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)
                  : EGL_NO_DISPLAY;
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr) ||
      !eglBindAPI(EGL_OPENGL_API)) {
    throw std::runtime_error("no EGL display without a screen: install Mesa (libegl-mesa0)");
  }
  const EGLint wanted[] = {EGL_CONTEXT_MAJOR_VERSION,
                           3,
                           EGL_CONTEXT_MINOR_VERSION,
                           3,
                           EGL_CONTEXT_OPENGL_PROFILE_MASK,
                           EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                           EGL_NONE};
  EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted);
  if (context == EGL_NO_CONTEXT) throw std::runtime_error("no OpenGL 3.3 context from EGL");
  display_ = display;
  context_ = context;
  MakeCurrent();
}

GlContext::~GlContext() {
  // The display is shared by all contexts of the process and stays.
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

void GlContext::MakeCurrent() const {
  if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
    throw std::runtime_error("the OpenGL context cannot be made current");
  }
}

GlProgram::GlProgram(const std::string& vertex_source, const std::string& fragment_source)
    : id_(glCreateProgram()) {
  const GLuint vertex = Compile(GL_VERTEX_SHADER, vertex_source.c_str());
  const GLuint fragment = Compile(GL_FRAGMENT_SHADER, fragment_source.c_str());
  glAttachShader(id_, vertex);
  glAttachShader(id_, fragment);
  glLinkProgram(id_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  GLint ok = 0;
  glGetProgramiv(id_, GL_LINK_STATUS, &ok);
  if (!ok) throw std::runtime_error("the shaders do not link");
}

GlProgram::~GlProgram() { glDeleteProgram(id_); }

void GlProgram::Use() const { glUseProgram(id_); }

void GlProgram::Set(const char* uniform, int value) const {
  glUniform1i(glGetUniformLocation(id_, uniform), value);
}

void GlProgram::Set(const char* uniform, const std::array<float, 3>& value) const {
  glUniform3fv(glGetUniformLocation(id_, uniform), 1, value.data());
}

void GlProgram::Set(const char* uniform, const std::array<float, 16>& value) const {
  glUniformMatrix4fv(glGetUniformLocation(id_, uniform), 1, GL_FALSE, value.data());
}

GlMesh::GlMesh(const Mesh& mesh) : count_(GLsizei(mesh.indices.size())) {
  glGenVertexArrays(1, &array_);
  glBindVertexArray(array_);
  glGenBuffers(1, &vertices_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(mesh.vertices.size() * sizeof(Vertex)),
               mesh.vertices.data(), GL_STATIC_DRAW);
  glGenBuffers(1, &indices_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(mesh.indices.size() * sizeof(uint32_t)),
               mesh.indices.data(), GL_STATIC_DRAW);
  const std::array<std::pair<GLint, size_t>, 4> attributes{{{3, offsetof(Vertex, position)},
                                                            {3, offsetof(Vertex, normal)},
                                                            {2, offsetof(Vertex, uv)},
                                                            {2, offsetof(Vertex, light_uv)}}};
  for (GLuint i = 0; i < attributes.size(); ++i) {
    glEnableVertexAttribArray(i);
    glVertexAttribPointer(i, attributes[i].first, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                          reinterpret_cast<const void*>(attributes[i].second));
  }
  const size_t length = mesh.piece > 0 ? mesh.piece : mesh.indices.size();
  for (size_t first = 0; first < mesh.indices.size(); first += length) {
    const size_t last = std::min(first + length, mesh.indices.size());
    const auto corner = [&mesh](size_t i) {
      const float* p = mesh.vertices[mesh.indices[i]].position;
      return btVector3(p[0], p[1], p[2]);
    };
    btVector3 low = corner(first), high = low;
    for (size_t i = first; i < last; ++i) {
      low.setMin(corner(i));
      high.setMax(corner(i));
    }
    pieces_.push_back(
        {GLsizei(first), GLsizei(last - first), (low + high) / 2, (high - low).length() / 2});
  }
}

GlMesh::GlMesh(GlMesh&& other) noexcept
    : pieces_(std::move(other.pieces_)),
      array_(std::exchange(other.array_, 0)),
      vertices_(std::exchange(other.vertices_, 0)),
      indices_(std::exchange(other.indices_, 0)),
      count_(other.count_) {}

GlMesh::~GlMesh() {
  glDeleteVertexArrays(1, &array_);
  glDeleteBuffers(1, &vertices_);
  glDeleteBuffers(1, &indices_);
}

void GlMesh::DrawPiece(const Piece& piece) const {
  glBindVertexArray(array_);
  glDrawElements(GL_TRIANGLES, piece.count, GL_UNSIGNED_INT,
                 reinterpret_cast<const void*>(size_t(piece.first) * sizeof(uint32_t)));
}

GlFramebuffer::GlFramebuffer(int width, int height) {
  glGenFramebuffers(1, &id_);
  glBindFramebuffer(GL_FRAMEBUFFER, id_);
  glGenRenderbuffers(1, &colour_);
  glBindRenderbuffer(GL_RENDERBUFFER, colour_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_);
  glGenRenderbuffers(1, &depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH24_STENCIL8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, depth_);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error("OpenGL cannot draw images of " + std::to_string(width) + "x" +
                             std::to_string(height));
  }
}

GlFramebuffer::~GlFramebuffer() {
  glDeleteFramebuffers(1, &id_);
  glDeleteRenderbuffers(1, &colour_);
  glDeleteRenderbuffers(1, &depth_);
}

void GlFramebuffer::Bind() const { glBindFramebuffer(GL_FRAMEBUFFER, id_); }

GLuint UploadTexture(int width, int height, const unsigned char* rgba) {
  GLuint id = 0;
  glGenTextures(1, &id);
  glBindTexture(GL_TEXTURE_2D, id);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
  glGenerateMipmap(GL_TEXTURE_2D);
  // Trilinear filtering costs a third more on a CPU and helps the vision little.
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  return id;
}

}  // namespace tld_follower::sim
