#include "VDIPainter.h"

#include <vtkObject.h>  // the next header needs it unless NDEBUG is defined
#include <vtkOpenGLError.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLQuadHelper.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkOpenGLState.h>
#include <vtkShaderProgram.h>
#include <vtkTextureObject.h>

#include <cstddef>
#include <string_view>

#include "VDIView.h"
#include "plugin/VolumetricDepthImages/ParaViewVersions.h"

#include VDI_VTK_OPENGL

namespace pv {

namespace {

constexpr const char* pictureShader = R"(//VTK::System::Dec
//VTK::Output::Dec
in vec2 texCoord;
uniform sampler2D picture;
uniform float opacity;
void main() { gl_FragData[0] = opacity * texture(picture, texCoord); }
)";

/// The depth is a few steps of a 24-bit depth buffer short of the far plane, where the difference is
/// invisible.
constexpr const char* depthShader = R"(//VTK::System::Dec
//VTK::Output::Dec
in vec2 texCoord;
void main() {
  gl_FragData[0] = vec4(texCoord, 0.0, 0.0);  // not written
  gl_FragDepth = 1.0 - 4.0 / 16777216.0;
}
)";

/// Makes the quad at its first use. Later it makes the quad's program current, because VTK's cache may have
/// another one ready.
void ready(std::unique_ptr<vtkOpenGLQuadHelper>& quad, vtkOpenGLRenderWindow* window, const char* shader) {
  if (!quad) {
    quad = std::make_unique<vtkOpenGLQuadHelper>(window, nullptr, shader, "");
  } else {
    window->GetShaderCache()->ReadyShaderProgram(quad->Program);
  }
}

}  // namespace

void readDepths(vtkOpenGLRenderWindow* window, const Viewport& port, std::vector<float>& depths) {
  depths.resize(static_cast<std::size_t>(port.size.x) * static_cast<std::size_t>(port.size.y));
  GLint samples = 0;
  glGetIntegerv(GL_SAMPLES, &samples);
  if (samples > 1) {
    window->GetZbufferData(port.corner.x, port.corner.y, port.corner.x + port.size.x - 1,
                           port.corner.y + port.size.y - 1, depths.data());
    return;
  }
  // vtkOpenGLState binds only VTK's framebuffers. These calls bypass it, and restore the binding that it
  // knows.
  GLint drawn = 0;
  GLint read = 0;
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &drawn);
  glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &read);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(drawn));
  window->GetState()->vtkglPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(port.corner.x, port.corner.y, port.size.x, port.size.y, GL_DEPTH_COMPONENT, GL_FLOAT,
               depths.data());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(read));
}

bool drawsOnCpu() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr && std::string_view(name).find("llvmpipe") != std::string_view::npos;
}

VDIPainter::VDIPainter() = default;

VDIPainter::~VDIPainter() = default;

void VDIPainter::load(vtkOpenGLRenderWindow* window, const glm::ivec2& size,
                      std::span<const glm::u8vec4> picture) {
  texture_->SetContext(window);
  texture_->SetMinificationFilter(vtkTextureObject::Linear);
  texture_->SetMagnificationFilter(vtkTextureObject::Linear);
  texture_->SetWrapS(vtkTextureObject::ClampToEdge);
  texture_->SetWrapT(vtkTextureObject::ClampToEdge);
  // VTK's call reads the pixels through a pointer that isn't const.
  texture_->Create2DFromRaw(static_cast<unsigned int>(size.x), static_cast<unsigned int>(size.y), 4,
                            VTK_UNSIGNED_CHAR, const_cast<glm::u8vec4*>(picture.data()));
}

bool VDIPainter::hasPicture(vtkRenderWindow* window) const {
  return texture_->GetHandle() != 0 && texture_->GetContext() == window;
}

void VDIPainter::draw(vtkOpenGLRenderWindow* window, double opacity) {
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglEnableDisable blends(state, GL_BLEND);
  vtkOpenGLState::ScopedglEnableDisable testsDepth(state, GL_DEPTH_TEST);
  vtkOpenGLState::ScopedglDepthMask writesDepth(state);
  vtkOpenGLState::ScopedglBlendFuncSeparate blendFunction(state);
  state->vtkglEnable(GL_BLEND);
  state->vtkglDisable(GL_DEPTH_TEST);
  state->vtkglDepthMask(GL_FALSE);
  state->vtkglBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  ready(quad_, window, pictureShader);
  texture_->Activate();
  quad_->Program->SetUniformi("picture", texture_->GetTextureUnit());
  quad_->Program->SetUniformf("opacity", static_cast<float>(opacity));
  quad_->Render();
  texture_->Deactivate();
  vtkOpenGLStaticCheckErrorMacro("failed to draw the VDI");
}

void VDIPainter::markDepth(vtkOpenGLRenderWindow* window) {
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglEnableDisable testsDepth(state, GL_DEPTH_TEST);
  vtkOpenGLState::ScopedglDepthMask writesDepth(state);
  vtkOpenGLState::ScopedglColorMask writesColor(state);
  vtkOpenGLState::ScopedglDepthFunc depthFunction(state);
  state->vtkglEnable(GL_DEPTH_TEST);
  state->vtkglDepthFunc(GL_LESS);
  state->vtkglDepthMask(GL_TRUE);
  state->vtkglColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  ready(depthQuad_, window, depthShader);
  depthQuad_->Render();
}

void VDIPainter::release(vtkWindow* window) {
  quad_.reset();
  depthQuad_.reset();
  texture_->ReleaseGraphicsResources(window);
}

}  // namespace pv
