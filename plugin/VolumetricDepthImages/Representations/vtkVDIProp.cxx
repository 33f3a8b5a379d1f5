#include "vtkVDIProp.h"

#include <vtkInformation.h>
#include <vtkInformationObjectBaseVectorKey.h>
#include <vtkMatrix3x3.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLCamera.h>
#include <vtkOpenGLError.h>
#include <vtkOpenGLFramebufferObject.h>
#include <vtkOpenGLQuadHelper.h>
#include <vtkOpenGLRenderPass.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkOpenGLShaderCache.h>
#include <vtkOpenGLState.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkShaderProgram.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTextureObject.h>
#include <vtk_glew.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <sstream>
#include <vector>

#include "VDIPiece.h"
#include "VDISession.h"
#include "VDIView.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Pipeline.h"

vtkStandardNewMacro(vtkVDIProp);

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr const char* pictureShader = R"(//VTK::System::Dec
//VTK::Output::Dec
in vec2 texCoord;
uniform sampler2D picture;
void main() { gl_FragData[0] = texture(picture, texCoord); }
)";

/// At the far plane, but for a few steps of a depth buffer of 24 bits: as far as anybody sees, background.
constexpr const char* depthShader = R"(//VTK::System::Dec
//VTK::Output::Dec
in vec2 texCoord;
void main() {
  gl_FragData[0] = vec4(texCoord, 0.0, 0.0);  // isn't written
  gl_FragDepth = 1.0 - 4.0 / 16777216.0;
}
)";

/// In lines of at most `columns`, broken at blanks.
std::string wrapped(const std::string& text, std::size_t columns) {
  std::string lines;
  std::size_t column = 0;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const bool fits = column + 1 + word.size() <= columns;
    if (column > 0) lines += fits ? ' ' : '\n';
    column = (column > 0 && fits ? column + 1 : 0) + word.size();
    lines += word;
  }
  return lines;
}

/// A renderer's part of its window, in pixels.
struct Viewport {
  glm::ivec2 size{0};
  glm::ivec2 corner{0};
};

Viewport viewportOf(vtkRenderer* renderer) {
  Viewport port;
  renderer->GetTiledSizeAndOrigin(&port.size.x, &port.size.y, &port.corner.x, &port.corner.y);
  return port;
}

pv::ViewMatrices matricesOf(vtkRenderer* renderer) {
  vtkMatrix4x4* worldToView = nullptr;
  vtkMatrix4x4* viewToClip = nullptr;
  vtkMatrix4x4* worldToClip = nullptr;
  vtkMatrix3x3* normals = nullptr;
  auto* camera = vtkOpenGLCamera::SafeDownCast(renderer->GetActiveCamera());
  camera->GetKeyMatrices(renderer, worldToView, normals, viewToClip, worldToClip);
  return {worldToView, viewToClip};
}

/// The depth buffer of what is being drawn to. Not vtkRenderWindow::GetZbufferData, which reads the window's:
/// passes draw elsewhere.
void readDepths(vtkOpenGLRenderWindow* window, const Viewport& port, std::vector<float>& depths) {
  depths.resize(static_cast<std::size_t>(port.size.x) * static_cast<std::size_t>(port.size.y));
  GLint samples = 0;
  glGetIntegerv(GL_SAMPLES, &samples);
  if (samples > 1) {
    window->GetZbufferData(port.corner.x, port.corner.y, port.corner.x + port.size.x - 1,
                           port.corner.y + port.size.y - 1, depths.data());
    return;
  }
  // Past vtkOpenGLState, which binds its own objects only: what it knows holds again in the end.
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

}  // namespace

struct vtkVDIProp::Internals {
  std::unique_ptr<vdi::VdiRenderer> Renderer;  // none until there's a VDI, and after a failure
  vtkSmartPointer<vtkDataObject> Piece;
  vtkMTimeType PieceTime = 0;
  bool HasVdi = false;
  vtkMTimeType FailedTime = 0;  // of the piece that has failed to render before
  bool HasFailed = false;       // to render this piece
  double Bounds[6] = {1.0, -1.0, 1.0, -1.0, 1.0, -1.0};

  bool IsPeeled = false;  // volumes are, in this frame

  vtkNew<vtkTextActor> Message;
  std::string Obstacle;
  std::string Problem;
  std::string Said;  // as an error

  vtkNew<vtkTextureObject> Texture;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
  std::unique_ptr<vtkOpenGLQuadHelper> DepthQuad;
  std::vector<float> Window;  // depth buffer
  std::vector<float> Ends;

  /// Of a frame's work: what it takes however many pixels it has is small.
  std::optional<double> SecondsPerPixel;
  double Reduction = 1.0;  // pixels of the viewport on a pixel's side, in interactive frames

  int Width = 400;  // of the viewport, pixels

  void ShowMessage(bool isVisible) {
    constexpr int letter = 9;  // pixels
    const std::string& text = this->Obstacle.empty() ? this->Problem : this->Obstacle;
    const auto columns = static_cast<std::size_t>(std::max(this->Width / letter, 20));
    this->Message->SetInput(wrapped(text, columns).c_str());
    this->Message->SetVisibility(isVisible && !text.empty());
  }
};

vtkVDIProp::vtkVDIProp() : Internal(new Internals) {
  vtkTextActor* message = this->Internal->Message;
  message->SetTextScaleModeToNone();
  message->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  message->SetPosition(0.03, 0.5);
  message->GetTextProperty()->SetFontSize(16);
  message->GetTextProperty()->SetVerticalJustificationToCentered();
  message->GetTextProperty()->SetBackgroundColor(0.1, 0.1, 0.1);
  message->GetTextProperty()->SetBackgroundOpacity(0.8);
  message->SetPickable(false);
  message->SetVisibility(false);
}

vtkVDIProp::~vtkVDIProp() = default;

void vtkVDIProp::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Reconstruction: " << this->Reconstruction << "\n"
     << indent << "FrameRate: " << this->FrameRate << "\n"
     << indent << "Problem: " << this->Internal->Problem << "\n";
}

void vtkVDIProp::SetVisibility(vtkTypeBool visible) {
  this->Superclass::SetVisibility(visible);
  this->Internal->ShowMessage(visible != 0);
}

vtkTextActor* vtkVDIProp::GetMessageActor() {
  return this->Internal->Message;
}

void vtkVDIProp::SetObstacle(const std::string& text) {
  if (this->Internal->Obstacle == text) return;
  this->Internal->Obstacle = text;
  this->Internal->ShowMessage(this->GetVisibility() != 0);
}

void vtkVDIProp::Say(const std::string& text) {
  this->Internal->Problem = text;
  this->Internal->ShowMessage(this->GetVisibility() != 0);
  if (text.empty() || text == this->Internal->Said) return;
  this->Internal->Said = text;
  vtkErrorMacro(<< text);
}

void vtkVDIProp::SetPiece(vtkDataObject* piece) {
  Internals& internal = *this->Internal;
  const vtkMTimeType time = piece != nullptr ? piece->GetMTime() : 0;
  if (piece == internal.Piece && time == internal.PieceTime) return;
  internal.Piece = piece;
  internal.PieceTime = time;
  internal.HasVdi = false;
  internal.HasFailed = false;
  std::fill_n(internal.Bounds, 6, 0.0);
  this->Modified();
  this->Say({});
  if (piece == nullptr) return;
  try {
    const std::optional<vdi::Vdi> vdi = pv::unpackVdi(piece);
    if (!vdi) return;
    if (auto* data = vtkPolyData::SafeDownCast(piece)) pv::boundsOf(data, internal.Bounds);
    if (vdi->supersegmentCount() == 0)
      throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                       "This VDI is empty: its viewpoint saw nothing of its scene.");
    if (!internal.Renderer) internal.Renderer = std::make_unique<vdi::VdiRenderer>(pv::sharedDevice(0));
    internal.Renderer->setVdi(*vdi);
    internal.HasVdi = true;
  } catch (const vdi::Error& error) {
    internal.Renderer.reset();
    const bool lacksDevice = error.code() == vdi::ErrorCode::DeviceUnavailable;
    this->Say((lacksDevice
                   ? "To show a VDI, this computer needs a Vulkan driver; Mesa's lavapipe (Debian's package "
                     "mesa-vulkan-drivers) needs no GPU. Found: "
                   : "") +
              std::string(error.what()));
  } catch (const std::exception& error) {
    internal.Renderer.reset();
    this->Say(error.what());
  }
}

double* vtkVDIProp::GetBounds() {
  return this->Internal->HasVdi ? this->Internal->Bounds : nullptr;
}

void vtkVDIProp::ReleaseGraphicsResources(vtkWindow* window) {
  this->Internal->Quad.reset();
  this->Internal->DepthQuad.reset();
  this->Internal->Texture->ReleaseGraphicsResources(window);
  this->Superclass::ReleaseGraphicsResources(window);
}

int vtkVDIProp::RenderVolumetricGeometry(vtkViewport* viewport) {
  // Depth peeling draws layer by layer, with shaders that it changes.
  vtkInformation* keys = this->GetPropertyKeys();
  this->Internal->IsPeeled = keys != nullptr && keys->Has(vtkOpenGLRenderPass::RenderPasses());
  return this->Internal->IsPeeled ? 0 : this->DrawIn(viewport);
}

int vtkVDIProp::RenderOverlay(vtkViewport* viewport) {
  if (!this->Internal->IsPeeled) return 0;
  this->Internal->IsPeeled = false;
  return this->DrawIn(viewport);
}

int vtkVDIProp::DrawIn(vtkViewport* viewport) {
  Internals& internal = *this->Internal;
  auto* renderer = vtkRenderer::SafeDownCast(viewport);
  auto* window = renderer ? vtkOpenGLRenderWindow::SafeDownCast(renderer->GetRenderWindow()) : nullptr;
  if (window == nullptr || renderer->GetSelector() != nullptr) return 0;
  const Viewport port = viewportOf(renderer);
  if (port.size.x != internal.Width) {
    internal.Width = port.size.x;
    internal.ShowMessage(this->GetVisibility() != 0);
  }
  if (this->MarksDepth) this->MarkDepth(window);
  if (!internal.HasVdi || internal.HasFailed || !internal.Obstacle.empty()) return 0;
  try {
    this->Draw(renderer, window);
  } catch (const std::exception& error) {
    internal.HasFailed = true;
    internal.Renderer.reset();  // a lost device stays lost
    if (internal.FailedTime != internal.PieceTime) {
      internal.FailedTime = internal.PieceTime;
      internal.Piece = nullptr;  // once more with the next frame
    }
    this->Say(error.what());
    return 0;
  }
  return 1;
}

void vtkVDIProp::MarkDepth(vtkOpenGLRenderWindow* window) {
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglEnableDisable testsDepth(state, GL_DEPTH_TEST);
  vtkOpenGLState::ScopedglDepthMask writesDepth(state);
  vtkOpenGLState::ScopedglColorMask writesColor(state);
  vtkOpenGLState::ScopedglDepthFunc depthFunction(state);
  state->vtkglEnable(GL_DEPTH_TEST);
  state->vtkglDepthFunc(GL_LESS);
  state->vtkglDepthMask(GL_TRUE);
  state->vtkglColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  std::unique_ptr<vtkOpenGLQuadHelper>& quad = this->Internal->DepthQuad;
  if (!quad) {
    quad = std::make_unique<vtkOpenGLQuadHelper>(window, nullptr, depthShader, "");
  } else {
    window->GetShaderCache()->ReadyShaderProgram(quad->Program);
  }
  quad->Render();
}

void vtkVDIProp::Draw(vtkRenderer* renderer, vtkOpenGLRenderWindow* window) {
  Internals& internal = *this->Internal;
  const Viewport port = viewportOf(renderer);
  if (port.size.x < 1 || port.size.y < 1) return;
  const Clock::time_point start = Clock::now();
  const double windowPixels = static_cast<double>(port.size.x) * port.size.y;
  const bool isInteractive = window->GetDesiredUpdateRate() >= 1.0;
  double reduction = 1.0;
  if (isInteractive && internal.SecondsPerPixel) {
    reduction = std::sqrt(std::max(1.0, *internal.SecondsPerPixel * windowPixels * this->FrameRate));
    // What changes from frame to frame would flicker.
    const double ratio = reduction / internal.Reduction;
    if (ratio > 0.8 && ratio < 1.25) reduction = internal.Reduction;
    internal.Reduction = reduction;
  }
  const glm::ivec2 size = glm::max(glm::ivec2(glm::ceil(glm::dvec2(port.size) / reduction)), 1);

  const pv::ViewMatrices matrices = matricesOf(renderer);
  readDepths(window, port, internal.Window);
  const bool hasObjects = std::any_of(internal.Window.begin(), internal.Window.end(),
                                      [](float z) { return z < pv::backgroundDepth; });
  internal.Ends.resize(hasObjects ? static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) : 0);
  if (hasObjects) pv::depthsOf(matrices, internal.Window, port.size, size, internal.Ends);

  const vdi::ImageBytes picture =
      internal.Renderer->renderBytes(matrices.view(size.x, size.y), internal.Ends, vdi::Alpha::Premultiplied,
                                     static_cast<vdi::Reconstruction>(this->Reconstruction));

  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglEnableDisable blends(state, GL_BLEND);
  vtkOpenGLState::ScopedglEnableDisable testsDepth(state, GL_DEPTH_TEST);
  vtkOpenGLState::ScopedglDepthMask writesDepth(state);
  vtkOpenGLState::ScopedglBlendFuncSeparate blendFunction(state);
  state->vtkglEnable(GL_BLEND);
  state->vtkglDisable(GL_DEPTH_TEST);
  state->vtkglDepthMask(GL_FALSE);
  state->vtkglBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  vtkTextureObject* texture = internal.Texture;
  texture->SetContext(window);
  texture->SetMinificationFilter(vtkTextureObject::Linear);
  texture->SetMagnificationFilter(vtkTextureObject::Linear);
  texture->SetWrapS(vtkTextureObject::ClampToEdge);
  texture->SetWrapT(vtkTextureObject::ClampToEdge);
  // VTK's call takes a pointer to what it only reads.
  texture->Create2DFromRaw(static_cast<unsigned int>(size.x), static_cast<unsigned int>(size.y), 4,
                           VTK_UNSIGNED_CHAR, const_cast<glm::u8vec4*>(picture.rgba.data()));
  if (!internal.Quad) {
    internal.Quad = std::make_unique<vtkOpenGLQuadHelper>(window, nullptr, pictureShader, "");
  } else {
    window->GetShaderCache()->ReadyShaderProgram(internal.Quad->Program);
  }
  texture->Activate();
  internal.Quad->Program->SetUniformi("picture", texture->GetTextureUnit());
  internal.Quad->Render();
  texture->Deactivate();
  vtkOpenGLCheckErrorMacro("failed to draw the VDI");

  const double measured = secondsSince(start) / (static_cast<double>(size.x) * size.y);
  internal.SecondsPerPixel =
      internal.SecondsPerPixel ? 0.5 * (*internal.SecondsPerPixel + measured) : measured;
}
