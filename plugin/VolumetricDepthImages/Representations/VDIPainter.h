// Draws pictures of a VDI into the framebuffer that VTK draws to.
#ifndef VDIPainter_h
#define VDIPainter_h

#include <vtkNew.h>

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

class vtkOpenGLQuadHelper;
class vtkOpenGLRenderWindow;
class vtkRenderWindow;
class vtkTextureObject;
class vtkWindow;

namespace pv {

struct Viewport;

/// Reads the depth buffer of the framebuffer that is being drawn to, [size.y][size.x] of `port`.
/// vtkRenderWindow::GetZbufferData reads the window's own, but render passes draw to others.
void readDepths(vtkOpenGLRenderWindow* window, const Viewport& port, std::vector<float>& depths);

/// Whether OpenGL in this thread's context is Mesa's software renderer.
bool drawsOnCpu();

/// Keeps one picture in a texture and draws it. Belongs to the views' thread; the window's context is
/// current in each call.
class VDIPainter {
 public:
  VDIPainter();
  ~VDIPainter();
  VDIPainter(const VDIPainter&) = delete;
  VDIPainter& operator=(const VDIPainter&) = delete;
  VDIPainter(VDIPainter&&) = delete;
  VDIPainter& operator=(VDIPainter&&) = delete;

  /// Replaces the texture's picture. `picture`: [size.y][size.x], premultiplied colours, rows from below.
  void load(vtkOpenGLRenderWindow* window, const glm::ivec2& size, std::span<const glm::u8vec4> picture);
  /// Whether the texture has a picture in that window.
  bool hasPicture(vtkRenderWindow* window) const;
  /// Blends the texture's picture over the viewport's contents.
  void draw(vtkOpenGLRenderWindow* window, double opacity);
  /// Gives each pixel of the background a depth just short of the background's.
  void markDepth(vtkOpenGLRenderWindow* window);
  void release(vtkWindow* window);

 private:
  vtkNew<vtkTextureObject> texture_;
  std::unique_ptr<vtkOpenGLQuadHelper> quad_;
  std::unique_ptr<vtkOpenGLQuadHelper> depthQuad_;
};

}  // namespace pv

#endif
