#include "vtkVDIProp.h"

#include <vtkDataObject.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationObjectBaseVectorKey.h>
#include <vtkMath.h>
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
#include <vtkPropCollection.h>
#include <vtkRenderer.h>
#include <vtkShaderProgram.h>
#include <vtkTextureObject.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "VDIBuffers.h"
#include "VDIImageData.h"
#include "VDIMessage.h"
#include "VDIPiece.h"
#include "VDISession.h"
#include "VDIStill.h"
#include "VDIView.h"
#include "plugin/VolumetricDepthImages/ParaViewVersions.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"
#include "vdi/core/Viewpoint.h"
#include "vdi/pipeline/VdiRenderer.h"

#include VDI_VTK_OPENGL

vtkStandardNewMacro(vtkVDIProp);

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// For a VDI that's being loaded.
constexpr std::chrono::milliseconds shortWait{30};
constexpr std::chrono::hours untilDone{24 * 365};

constexpr const char* pictureShader = R"(//VTK::System::Dec
//VTK::Output::Dec
in vec2 texCoord;
uniform sampler2D picture;
uniform float opacity;
void main() { gl_FragData[0] = opacity * texture(picture, texCoord); }
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

/// Of bounds as VTK has them.
vdi::Box boxOf(const double* bounds) {
  return {{bounds[0], bounds[2], bounds[4]}, {bounds[1], bounds[3], bounds[5]}};
}

bool drawsOnCpu() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr && std::string_view(name).find("llvmpipe") != std::string_view::npos;
}

}  // namespace

/// How long an interactive frame takes: what it takes anyway, and by the pixel of the VDI's picture.
class vtkVDIProp::Pace {
 public:
  void Measure(double seconds, double renderSeconds, double pixels) {
    this->Blend(this->Anyway, seconds - renderSeconds);
    this->Blend(this->PerPixel, renderSeconds / pixels);
  }
  /// For `rate` frames a second. Half of the time is for the VDI at least.
  std::optional<double> Pixels(double rate) const {
    if (!this->PerPixel) return std::nullopt;
    return std::max(1.0 / rate - this->Anyway.value_or(0.0), 0.5 / rate) / *this->PerPixel;
  }
  std::optional<double> Seconds(double pixels) const {
    if (!this->PerPixel) return std::nullopt;
    return pixels * *this->PerPixel;
  }
  /// A guess from a frame that wasn't interactive.
  void Guess(double renderSeconds, double pixels) {
    if (!this->PerPixel) this->PerPixel = renderSeconds / pixels;
  }

 private:
  static void Blend(std::optional<double>& mean, double value) {
    mean = mean ? 0.5 * (*mean + value) : value;
  }
  std::optional<double> Anyway;
  std::optional<double> PerPixel;
};

/// How a picture of the VDI is made.
struct vtkVDIProp::Form {
  glm::ivec2 size;
  std::optional<std::size_t> thin;  // of few lists: the level of them
};

struct vtkVDIProp::Internals {
  pv::VDIBuffers Buffers;
  vtkSmartPointer<vtkDataObject> Piece;
  vtkMTimeType PieceTime = 0;
  bool IsBeingMade = false;  // there is no VDI in the piece yet
  bool HasJustCome = false;  // the first VDI, after such a piece
  Frame NextFrame = Frame::Whole;
  bool IsBehind = false;           // the window is
  bool IsRecovering = false;       // until a frame has been drawn on the new device as it's to be
  vtkMTimeType FailedTime = 0;     // of the piece that has failed to be drawn
  glm::ivec2 FailedSize{0};        // in a viewport of that size
  vtkMTimeType RoughTime = 0;      // of the piece whose picture in full loses every device
  glm::ivec2 RoughSize{0};         // in a viewport of that size
  std::array<double, 6> Bounds{};  // as long as GetBounds' result is used

  bool IsPeeled = false;  // volumes are, in this frame

  vtkNew<vtkVDIMessage> Message;
  std::string Obstacle;
  std::string Problem;
  std::string Notice;  // nothing is wrong
  vtkVDIMessage::Place NoticePlace = vtkVDIMessage::Place::Middle;
  std::string Said;  // as an error
  vtkNew<vtkVDIMessage> AngleMessage;
  std::string Angle;

  vtkNew<vtkTextureObject> Texture;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
  std::unique_ptr<vtkOpenGLQuadHelper> DepthQuad;
  std::vector<float> Window;  // depth buffer
  std::vector<float> Ends;

  Pace Whole;                                          // of the VDI with all its lists
  std::array<Pace, pv::VDIBuffers::thinLevels> Thins;  // and with few of them
  double Reduction = 1.0;  // pixels of the viewport on a pixel's side, in interactive frames
  bool WasSmooth = false;  // the renderer's edges were to be smoothed, and aren't in this frame

  /// Whether the next frame leaves what takes long to a later one.
  bool DefersIn(vtkRenderWindow* window, const glm::ivec2& port) {
    constexpr double longTime = 0.05;  // seconds
    if (this->NextFrame != Frame::Deferred || window->GetStereoRender() != 0) return false;
    return this->Whole.Seconds(static_cast<double>(port.x) * port.y)
               .value_or(this->Buffers.isOnCpu() ? 2.0 * longTime : 0.0) > longTime;
  }
  /// Of few lists, but of enough for what the view shows of the VDI; none: of all.
  std::optional<std::size_t> ThinLevelFor(const vdi::View& view) {
    constexpr double leastAcross = 100.0;
    const double across =
        vdi::listsAcross(boxOf(this->Buffers.bounds().data()), *this->Buffers.viewpoint(), view);
    for (std::size_t level = 0; level < pv::VDIBuffers::thinLevels; ++level) {
      const pv::VDIBuffers::Thin& thin = this->Buffers.thin(level);
      const bool isLast = level + 1 == pv::VDIBuffers::thinLevels;
      if (thin.lists > 0 && (isLast || across * thin.share >= leastAcross)) return level;
    }
    return std::nullopt;
  }
  Form InteractiveForm(const pv::ViewMatrices& matrices, const glm::ivec2& port, double rate) {
    const double all = static_cast<double>(port.x) * port.y;
    Form form{port, std::nullopt};
    double pixels = this->Whole.Pixels(rate).value_or(0.0);
    const std::optional<std::size_t> thin = this->ThinLevelFor(matrices.view(port.x, port.y));
    const double fewLists = thin ? static_cast<double>(this->Buffers.thin(*thin).lists) : 0.0;
    if (thin && pixels < std::min(all, 2.0 * fewLists)) {
      // The lists between would hardly be seen.
      form.thin = thin;
      pixels = this->Thins.at(*thin).Pixels(rate).value_or(fewLists);
    }
    constexpr double coarsest = 8.0;  // beyond that, little is recognised
    const double wanted = std::sqrt(std::clamp(all / std::max(pixels, 1.0), 1.0, coarsest * coarsest));
    // What changes from frame to frame would flicker.
    const double ratio = wanted / this->Reduction;
    if (ratio < 0.8 || ratio > 1.25 || wanted == 1.0) this->Reduction = wanted;
    form.size = glm::max(glm::ivec2(glm::ceil(glm::dvec2(port) / this->Reduction)), 1);
    return form;
  }

  void ShowMessage(bool isVisible) {
    const std::string& problem = this->Obstacle.empty() ? this->Problem : this->Obstacle;
    const std::string& text = problem.empty() ? this->Notice : problem;
    this->Message->Show(isVisible ? text : std::string(),
                        problem.empty() ? this->NoticePlace : vtkVDIMessage::Place::Middle);
    this->AngleMessage->Show(isVisible ? this->Angle : std::string(), vtkVDIMessage::Place::Bottom);
  }
};

vtkVDIProp::vtkVDIProp() : Internal(new Internals) {}

vtkVDIProp::~vtkVDIProp() = default;

void vtkVDIProp::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Reconstruction: " << this->Reconstruction << "\n"
     << indent << "FrameRate: " << this->FrameRate << "\n"
     << indent << "Opacity: " << this->Opacity << "\n"
     << indent << "Problem: " << this->Internal->Problem << "\n";
}

void vtkVDIProp::SetVisibility(vtkTypeBool visible) {
  this->Superclass::SetVisibility(visible);
  if (visible == 0) this->Internal->IsBehind = false;
  this->Internal->ShowMessage(visible != 0);
}

vtkTextActor* vtkVDIProp::GetMessageActor() {
  return this->Internal->Message;
}

vtkTextActor* vtkVDIProp::GetAngleActor() {
  return this->Internal->AngleMessage;
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
  if (!pv::isSaidUpstream(text)) vtkErrorMacro(<< text);
}

void vtkVDIProp::Prepare(vtkDataObject* piece, Frame frame) {
  Internals& internal = *this->Internal;
  internal.NextFrame = frame;
  const vtkMTimeType time = piece != nullptr ? piece->GetMTime() : 0;
  if (piece != internal.Piece || time != internal.PieceTime) {
    internal.Piece = piece;
    internal.PieceTime = time;
    this->Modified();
    if (piece != nullptr) {
      const bool isBeingMade = pv::isBeingMade(piece->GetFieldData());
      internal.HasJustCome = !isBeingMade && (internal.HasJustCome || internal.IsBeingMade);
      internal.IsBeingMade = isBeingMade;
      internal.Buffers.load(piece);
    } else {
      internal.Buffers.clear();
      this->Say({});
    }
  }
  if (frame == Frame::Interactive) {
    this->Take(std::chrono::seconds(0));
  } else {
    const bool hasFrame = internal.Buffers.hasVdi() || internal.HasJustCome;
    this->Take(frame == Frame::Deferred && hasFrame ? shortWait : untilDone);
  }
  if (!internal.Buffers.isLoading()) internal.HasJustCome = false;
  // Whatever is drawn, or isn't as where the camera looks away. A picture of the window that's taken
  // meanwhile doesn't show in it.
  if (frame != Frame::Whole) internal.IsBehind = frame == Frame::Deferred && internal.Buffers.isLoading();
}

void vtkVDIProp::LookAround(vtkObject* renderer, unsigned long, void*) {
  Internals& internal = *this->Internal;
  auto* own = vtkRenderer::SafeDownCast(renderer);
  if (own == nullptr || own->GetSelector() != nullptr || this->GetVisibility() == 0) return;
  internal.Notice.clear();
  internal.Angle.clear();
  if (!this->IsCaptured) {
    this->NoteViewpoint(own);
    this->NoteAngle(own);
  }
  internal.ShowMessage(true);
}

/// None where drawing says what is wrong with it.
std::optional<vdi::View> vtkVDIProp::ViewOf(vtkRenderer* renderer) {
  const glm::ivec2 size = viewportOf(renderer).size;
  if (size.x < 1 || size.y < 1) return std::nullopt;
  try {
    return matricesOf(renderer).view(size.x, size.y);
  } catch (const vdi::Error&) {
    return std::nullopt;
  }
}

/// What's to be said of the VDI's viewpoint, or of the view's. That the view is turned far isn't, but by a
/// small line (NoteAngle): a VDI with all of its scene looks right from all around. Nor that there are cut
/// edges, which are seen.
void vtkVDIProp::NoteViewpoint(vtkRenderer* renderer) {
  Internals& internal = *this->Internal;
  internal.NoticePlace = vtkVDIMessage::Place::Middle;
  if (internal.IsBeingMade || internal.HasJustCome) {
    internal.Notice = "The VDI is being made.";
    return;
  }
  if (internal.Buffers.isEmpty()) {
    internal.Notice =
        "This VDI shows nothing: from its viewpoint nothing of its scene is seen, or all of it is "
        "transparent.";
    return;
  }
  const std::optional<vdi::View> view = this->ViewOf(renderer);
  if (!view) return;
  const std::optional<vdi::ViewpointIssue> issue = this->IssueIn(*view);
  if (!issue || !this->IsFirst(renderer, *view, *issue)) return;
  switch (*issue) {
    case vdi::ViewpointIssue::SeesNothing:
      if (this->IsBlank(renderer, *view)) internal.Notice = "The VDI is out of sight: press Reset Camera.";
      break;
    case vdi::ViewpointIssue::FarAway:
      if (this->IsBlank(renderer, *view))
        internal.Notice = "The VDI is too small to be seen from here: press Reset Camera.";
      break;
    case vdi::ViewpointIssue::Inside:
      internal.NoticePlace = vtkVDIMessage::Place::Top;
      internal.Notice = pv::isFiltered(internal.Piece->GetFieldData())
                            ? "From inside, this VDI is rough: press Regenerate From This View."
                            : "From inside, this VDI is rough: press Reset Camera.";
      break;
    case vdi::ViewpointIssue::FarBeside:
      break;
  }
}

/// Where it's in sight, and to be seen.
bool vtkVDIProp::IsShown() {
  return this->GetVisibility() != 0 && this->Opacity > 0.0 && this->Internal->Buffers.hasVdi() &&
         this->Internal->Piece != nullptr;
}

std::optional<vdi::ViewpointIssue> vtkVDIProp::IssueIn(const vdi::View& view) {
  const pv::VDIBuffers& buffers = this->Internal->Buffers;
  if (!this->IsShown()) return std::nullopt;
  return vdi::viewpointIssue(boxOf(buffers.bounds().data()), *buffers.viewpoint(), view);
}

/// Where the VDI is seen, from outside, and is to say it.
std::optional<double> vtkVDIProp::AngleIn(const vdi::View& view) {
  const Internals& internal = *this->Internal;
  if (!this->SaysAngle || !internal.Obstacle.empty() || !this->IsShown()) return std::nullopt;
  if (this->IssueIn(view).value_or(vdi::ViewpointIssue::FarBeside) != vdi::ViewpointIssue::FarBeside)
    return std::nullopt;
  return vdi::degreesBetween(boxOf(internal.Buffers.bounds().data()), internal.Buffers.viewpoint()->camera(),
                             view.camera());
}

void vtkVDIProp::NoteAngle(vtkRenderer* renderer) {
  const std::optional<vdi::View> view = this->ViewOf(renderer);
  const std::optional<double> own = view ? this->AngleIn(*view) : std::nullopt;
  if (!own || *own <= vdi::besideDegrees) return;
  bool isAlone = true;
  bool isBefore = true;  // the VDIs that have been looked at come first
  vtkPropCollection* props = renderer->GetViewProps();
  vtkCollectionSimpleIterator at;
  props->InitTraversal(at);
  while (vtkProp* prop = props->GetNextProp(at)) {
    auto* other = vtkVDIProp::SafeDownCast(prop);
    isBefore = isBefore && other != this;
    const std::optional<double> angle =
        other != nullptr && other != this ? other->AngleIn(*view) : std::nullopt;
    if (!angle) continue;
    isAlone = false;
    if (*angle > *own || (*angle == *own && isBefore)) return;
  }
  const std::string degrees = std::to_string(std::lround(*own)) + "\u00b0";
  this->Internal->Angle =
      isAlone ? degrees + " from the VDI's viewpoint" : "up to " + degrees + " from the VDIs' viewpoints";
}

/// Whether nothing else is seen in the view.
bool vtkVDIProp::IsBlank(vtkRenderer* renderer, const vdi::View& view) {
  vtkPropCollection* props = renderer->GetViewProps();
  vtkCollectionSimpleIterator at;
  props->InitTraversal(at);
  while (vtkProp* prop = props->GetNextProp(at)) {
    if (prop == this || prop->GetVisibility() == 0 || !prop->GetUseBounds()) continue;
    std::optional<vdi::ViewpointIssue> issue;
    if (auto* other = vtkVDIProp::SafeDownCast(prop)) {
      if (!other->IsShown()) continue;
      issue = other->IssueIn(view);
    } else {
      const double* bounds = prop->GetBounds();
      if (bounds == nullptr || vtkMath::AreBoundsInitialized(bounds) == 0) continue;
      vdi::Box box = boxOf(bounds);
      constexpr double beyond = std::numeric_limits<double>::max();
      for (int axis = 0; axis < 3; ++axis) {  // flat ones aren't empty
        box.lo[axis] = std::nextafter(box.lo[axis], -beyond);
        box.hi[axis] = std::nextafter(box.hi[axis], beyond);
      }
      issue = vdi::viewpointIssue(box, view, view);
    }
    if (issue != vdi::ViewpointIssue::SeesNothing && issue != vdi::ViewpointIssue::FarAway) return false;
  }
  return true;
}

/// Whether no VDI before this one has the same to say.
bool vtkVDIProp::IsFirst(vtkRenderer* renderer, const vdi::View& view, vdi::ViewpointIssue issue) {
  vtkPropCollection* props = renderer->GetViewProps();
  vtkCollectionSimpleIterator at;
  props->InitTraversal(at);
  while (vtkProp* prop = props->GetNextProp(at)) {
    if (prop == this) return true;
    auto* other = vtkVDIProp::SafeDownCast(prop);
    if (other != nullptr && other->IssueIn(view) == issue) return false;
  }
  return true;
}

bool vtkVDIProp::IsBehind() const {
  return this->Internal->IsBehind;
}

bool vtkVDIProp::HasMore() const {
  pv::VDIBuffers& buffers = this->Internal->Buffers;
  return this->IsBehind() && (buffers.isLoading() ? buffers.hasLoaded() : !buffers.still().isBeingMade());
}

void vtkVDIProp::Rest() {
  this->Internal->Buffers.still().rest();
}

void vtkVDIProp::Take(Clock::duration wait) {
  try {
    if (this->Internal->Buffers.take(wait)) this->Say({});
  } catch (const vdi::Error& error) {
    if (!this->Recover(error)) this->Fail(error);
  } catch (const std::exception& error) {
    this->Fail(error);
  }
}

/// Where the device was lost: shows the VDI on a new one, and returns true. A lost device stays lost.
bool vtkVDIProp::Recover(const vdi::Error& error) {
  Internals& internal = *this->Internal;
  if (error.code() != vdi::ErrorCode::DeviceFailure || internal.IsRecovering || internal.Piece == nullptr)
    return false;
  internal.IsRecovering = true;
  vtkWarningMacro(<< error.what() << "; trying a new device");
  internal.Buffers.clear();
  internal.Buffers.load(internal.Piece);
  this->Take(untilDone);
  return internal.Buffers.hasVdi();
}

void vtkVDIProp::Fail(const std::exception& error) {
  std::string help;
  if (const auto* own = dynamic_cast<const vdi::Error*>(&error)) {
    switch (own->code()) {
      case vdi::ErrorCode::DeviceUnavailable:
        help =
            "To show a VDI, this computer needs a Vulkan driver; Mesa's lavapipe (Debian's package "
            "mesa-vulkan-drivers) needs no GPU. Found: ";
        break;
      case vdi::ErrorCode::DeviceFailure:
      case vdi::ErrorCode::OutOfMemory:
        help = "The VDI can't be shown: ";
        break;
      default:  // says it all
        break;
    }
  }
  this->Say(help + error.what());
}

double* vtkVDIProp::GetBounds() {
  Internals& internal = *this->Internal;
  if (!internal.Buffers.hasVdi()) return nullptr;
  internal.Bounds = internal.Buffers.bounds();
  return internal.Bounds.data();
}

void vtkVDIProp::ReleaseGraphicsResources(vtkWindow* window) {
  this->Internal->Quad.reset();
  this->Internal->DepthQuad.reset();
  this->Internal->Texture->ReleaseGraphicsResources(window);
  this->Superclass::ReleaseGraphicsResources(window);
}

int vtkVDIProp::RenderOpaqueGeometry(vtkViewport* viewport) {
  // Edges are smoothed next, before volumes. On a CPU that takes five times as long as all else of a frame.
  auto* renderer = vtkRenderer::SafeDownCast(viewport);
  if (renderer == nullptr || !renderer->GetUseFXAA() || !drawsOnCpu()) return 0;
  Internals& internal = *this->Internal;
  const bool isRough = internal.DefersIn(renderer->GetRenderWindow(), viewportOf(renderer).size)
                           ? !internal.Buffers.still().isDone()
                           : internal.NextFrame == Frame::Interactive;
  if (!isRough) return 0;
  renderer->SetUseFXAA(false);
  internal.WasSmooth = true;
  return 0;
}

void vtkVDIProp::SmoothAgain(vtkRenderer* renderer) {
  if (this->Internal->WasSmooth && renderer != nullptr) renderer->SetUseFXAA(true);
  this->Internal->WasSmooth = false;
}

int vtkVDIProp::RenderVolumetricGeometry(vtkViewport* viewport) {
  this->SmoothAgain(vtkRenderer::SafeDownCast(viewport));
  // Depth peeling draws layer by layer, with shaders that it changes.
  vtkInformation* keys = this->GetPropertyKeys();
  this->Internal->IsPeeled = keys != nullptr && keys->Has(vtkOpenGLRenderPass::RenderPasses());
  return this->Internal->IsPeeled ? 0 : this->DrawIn(viewport);
}

int vtkVDIProp::RenderOverlay(vtkViewport* viewport) {
  this->SmoothAgain(vtkRenderer::SafeDownCast(viewport));
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
  if (this->MarksDepth) this->MarkDepth(window);
  if (!internal.Buffers.hasVdi() || !internal.Obstacle.empty()) return 0;
  try {
    bool isFinal = false;
    try {
      isFinal = this->Draw(renderer, window);
    } catch (const vdi::Error& error) {
      if (!this->Recover(error)) throw;
      isFinal = this->Draw(renderer, window);
    }
    if (isFinal) internal.IsRecovering = false;
    return 1;
  } catch (const std::exception& error) {
    internal.Buffers.clear();
    this->Fail(error);
    if (internal.FailedTime != internal.PieceTime || internal.FailedSize != port.size)
      internal.Piece = nullptr;  // once more with the next frame
    internal.FailedTime = internal.PieceTime;
    internal.FailedSize = port.size;
    return 0;
  }
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

/// Returns whether that's what this frame is to show in the end.
bool vtkVDIProp::Draw(vtkRenderer* renderer, vtkOpenGLRenderWindow* window) {
  Internals& internal = *this->Internal;
  const Viewport port = viewportOf(renderer);
  if (port.size.x < 1 || port.size.y < 1) return true;
  const pv::ViewMatrices matrices = matricesOf(renderer);
  readDepths(window, port, internal.Window);
  if (internal.DefersIn(window, port.size)) {
    return this->DrawDeferred(
        window,
        {matrices, port.size, static_cast<vdi::Reconstruction>(this->Reconstruction), internal.Window});
  }
  internal.Buffers.still().drop();
  const Form form = internal.NextFrame == Frame::Interactive
                        ? internal.InteractiveForm(matrices, port.size, this->FrameRate)
                        : Form{port.size, std::nullopt};
  this->DrawNow(window, matrices, port.size, form);
  return true;
}

bool vtkVDIProp::DrawDeferred(vtkOpenGLRenderWindow* window, pv::StillView view) {
  Internals& internal = *this->Internal;
  pv::VDIStill& still = internal.Buffers.still();
  if (internal.RoughTime == internal.PieceTime && internal.RoughSize == view.size) {
    still.drop();  // of another size
    this->DrawRough(window, view);
    return true;
  }
  if (still.isOf(view) && still.isDone()) {
    std::span<const glm::u8vec4> picture;
    try {
      picture = still.picture();
    } catch (const vdi::Error& error) {
      if (error.code() != vdi::ErrorCode::DeviceFailure || !internal.IsRecovering) throw;
      this->StayRough(window, view, error);
      return true;
    }
    this->ShowPicture(window, view.size, picture);
    internal.Whole.Guess(still.seconds(), static_cast<double>(view.window.size()));
    return true;
  }
  if (still.isOf(view) && internal.Texture->GetHandle() != 0) {
    this->ShowTexture(window);  // the rough one
    internal.IsBehind = true;
    return false;
  }
  // Where no frame is as the one before, what is made beside them is never right.
  const bool isUseless = still.isDone() && !still.isSeen();
  still.drop();
  if (isUseless) {
    this->DrawNow(window, view.matrices, view.size, {view.size, std::nullopt});
    return true;
  }
  this->DrawRough(window, view);
  if (!internal.Buffers.isLoading()) still.start(internal.Buffers.renderer(), std::move(view));
  internal.IsBehind = true;
  return false;
}

/// Where the picture in full has lost two devices in a row: on and on it would lose them.
void vtkVDIProp::StayRough(vtkOpenGLRenderWindow* window, const pv::StillView& view,
                           const vdi::Error& error) {
  Internals& internal = *this->Internal;
  internal.IsRecovering = false;
  if (!this->Recover(error)) throw vdi::Error(error);
  internal.RoughTime = internal.PieceTime;
  internal.RoughSize = view.size;
  this->DrawRough(window, view);
  this->Say(std::string("The VDI is shown with few pixels, for its picture in full can't be made: ") +
            error.what());
}

void vtkVDIProp::DrawRough(vtkOpenGLRenderWindow* window, const pv::StillView& view) {
  this->DrawNow(window, view.matrices, view.size,
                this->Internal->InteractiveForm(view.matrices, view.size, this->FrameRate));
}

void vtkVDIProp::DrawNow(vtkOpenGLRenderWindow* window, const pv::ViewMatrices& matrices,
                         const glm::ivec2& portSize, const Form& form) {
  Internals& internal = *this->Internal;
  const Clock::time_point start = Clock::now();
  const glm::ivec2& size = form.size;
  const bool hasObjects = std::any_of(internal.Window.begin(), internal.Window.end(), pv::isObject);
  internal.Ends.resize(hasObjects ? static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) : 0);
  if (hasObjects) pv::depthsOf(matrices, internal.Window, portSize, size, internal.Ends);

  vdi::VdiRenderer& views =
      form.thin ? internal.Buffers.thinRenderer(*form.thin) : internal.Buffers.renderer();
  auto reconstruction = static_cast<vdi::Reconstruction>(this->Reconstruction);
  // Faces lean at rest alone, for speed. A thinned VDI lacks the lists in which a surface goes on.
  if (form.thin || internal.NextFrame == Frame::Interactive)
    reconstruction = std::min(reconstruction, vdi::Reconstruction::Smooth);
  const Clock::time_point renderStart = Clock::now();
  const vdi::ImageBytes picture = views.renderBytes(matrices.view(size.x, size.y), internal.Ends,
                                                    vdi::Alpha::Premultiplied, reconstruction);
  const double renderSeconds = secondsSince(renderStart);
  this->ShowPicture(window, size, picture.rgba);

  const double pixels = static_cast<double>(size.x) * size.y;
  Pace& pace = form.thin ? internal.Thins.at(*form.thin) : internal.Whole;
  if (internal.NextFrame == Frame::Whole) {
    pace.Guess(renderSeconds, pixels);
  } else {
    pace.Measure(secondsSince(start), renderSeconds, pixels);
  }
}

void vtkVDIProp::ShowPicture(vtkOpenGLRenderWindow* window, const glm::ivec2& size,
                             std::span<const glm::u8vec4> picture) {
  vtkTextureObject* texture = this->Internal->Texture;
  texture->SetContext(window);
  texture->SetMinificationFilter(vtkTextureObject::Linear);
  texture->SetMagnificationFilter(vtkTextureObject::Linear);
  texture->SetWrapS(vtkTextureObject::ClampToEdge);
  texture->SetWrapT(vtkTextureObject::ClampToEdge);
  // VTK's call takes a pointer to what it only reads.
  texture->Create2DFromRaw(static_cast<unsigned int>(size.x), static_cast<unsigned int>(size.y), 4,
                           VTK_UNSIGNED_CHAR, const_cast<glm::u8vec4*>(picture.data()));
  this->ShowTexture(window);
}

void vtkVDIProp::ShowTexture(vtkOpenGLRenderWindow* window) {
  vtkOpenGLState* state = window->GetState();
  vtkOpenGLState::ScopedglEnableDisable blends(state, GL_BLEND);
  vtkOpenGLState::ScopedglEnableDisable testsDepth(state, GL_DEPTH_TEST);
  vtkOpenGLState::ScopedglDepthMask writesDepth(state);
  vtkOpenGLState::ScopedglBlendFuncSeparate blendFunction(state);
  state->vtkglEnable(GL_BLEND);
  state->vtkglDisable(GL_DEPTH_TEST);
  state->vtkglDepthMask(GL_FALSE);
  state->vtkglBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  std::unique_ptr<vtkOpenGLQuadHelper>& quad = this->Internal->Quad;
  if (!quad) {
    quad = std::make_unique<vtkOpenGLQuadHelper>(window, nullptr, pictureShader, "");
  } else {
    window->GetShaderCache()->ReadyShaderProgram(quad->Program);
  }
  vtkTextureObject* texture = this->Internal->Texture;
  texture->Activate();
  quad->Program->SetUniformi("picture", texture->GetTextureUnit());
  quad->Program->SetUniformf("opacity", static_cast<float>(this->Opacity));
  quad->Render();
  texture->Deactivate();
  vtkOpenGLCheckErrorMacro("failed to draw the VDI");
}
