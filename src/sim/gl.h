// SPDX-License-Identifier: BSD-3-Clause
// OpenGL 3.3 without a display, and owners for the few kinds of objects that the renderer uses.
#pragma once

#include <GL/glcorearb.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "sim/mesh.h"

namespace tld_follower::sim {

/// Has Mesa's software renderer draw with this many threads of its own, 0 for the caller's alone.
/// Pixels do not depend on it. For the whole process, before its first GlContext; the environment's
/// LP_NUM_THREADS has precedence.
void SetDrawingThreads(int count);

/// An OpenGL 3.3 core context on EGL without a surface (Mesa's software renderer will do).
class GlContext {
 public:
  /// Throws std::runtime_error if the machine offers none.
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  /// Makes this the calling thread's context.
  void MakeCurrent() const;

 private:
  void* display_ = nullptr;  // EGLDisplay and EGLContext are void*.
  void* context_ = nullptr;
};

/// A linked vertex and fragment shader.
class GlProgram {
 public:
  /// Throws std::runtime_error with the compiler's message.
  GlProgram(const std::string& vertex_source, const std::string& fragment_source);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void Use() const;
  void Set(const char* uniform, int value) const;
  void Set(const char* uniform, const std::array<float, 3>& value) const;
  /// Column major.
  void Set(const char* uniform, const std::array<float, 16>& value) const;

 private:
  GLuint id_;
};

/// A mesh in video memory.
class GlMesh {
 public:
  explicit GlMesh(const Mesh& mesh);
  ~GlMesh();
  GlMesh(GlMesh&& other) noexcept;
  GlMesh& operator=(GlMesh&&) = delete;

  /// Draws the pieces for whose bounding sphere `sees(centre, radius)` holds, in the mesh's frame.
  template <typename Predicate>
  void Draw(Predicate sees) const {
    for (const Piece& piece : pieces_) {
      if (sees(piece.centre, piece.radius)) DrawPiece(piece);
    }
  }
  /// Whether Draw() would draw something.
  template <typename Predicate>
  bool AnyPiece(Predicate sees) const {
    return std::any_of(pieces_.begin(), pieces_.end(),
                       [&](const Piece& piece) { return sees(piece.centre, piece.radius); });
  }
  int triangles() const { return count_ / 3; }

 private:
  struct Piece {
    GLsizei first, count;
    btVector3 centre;
    btScalar radius;
  };

  void DrawPiece(const Piece& piece) const;

  std::vector<Piece> pieces_;
  GLuint array_ = 0, vertices_ = 0, indices_ = 0;
  GLsizei count_ = 0;
};

/// A colour, depth and stencil target with 8 bits a channel.
class GlFramebuffer {
 public:
  GlFramebuffer(int width, int height);
  ~GlFramebuffer();
  GlFramebuffer(const GlFramebuffer&) = delete;
  GlFramebuffer& operator=(const GlFramebuffer&) = delete;

  void Bind() const;

 private:
  GLuint id_ = 0, colour_ = 0, depth_ = 0;
};

/// Uploads RGBA pixels as a repeating texture with mipmaps; the caller keeps it for the context's
/// lifetime.
GLuint UploadTexture(int width, int height, const unsigned char* rgba);

}  // namespace tld_follower::sim
