#include "vtkVDIProp.h"

#include <vtkDataObject.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationObjectBaseVectorKey.h>
#include <vtkObjectFactory.h>
#include <vtkOpenGLRenderPass.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "VDIBuffers.h"
#include "VDIFramePolicy.h"
#include "VDIImageData.h"
#include "VDINotices.h"
#include "VDIPainter.h"
#include "VDIPiece.h"
#include "VDIStill.h"
#include "VDIView.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Error.h"
#include "vdi/core/Region.h"
#include "vdi/core/Viewpoint.h"
#include "vdi/pipeline/VdiRenderer.h"

vtkStandardNewMacro(vtkVDIProp);

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The longest time that a deferred frame waits for a VDI being loaded.
constexpr std::chrono::milliseconds shortWait{30};
constexpr std::chrono::hours untilDone{24 * 365};

/// The renderer's view; nullopt if drawing would fail, which reports the reason itself.
std::optional<vdi::View> viewOf(vtkRenderer* renderer) {
  const glm::ivec2 size = pv::viewportOf(renderer).size;
  if (size.x < 1 || size.y < 1) return std::nullopt;
  try {
    return pv::ViewMatrices(renderer).view(size.x, size.y);
  } catch (const vdi::Error&) {
    return std::nullopt;
  }
}

/// A piece in a viewport, after which the same piece and viewport would fail again.
struct Attempt {
  vtkMTimeType piece = 0;
  glm::ivec2 size{0};

  bool operator==(const Attempt&) const = default;
};

}  // namespace

struct vtkVDIProp::Internals {
  pv::VDIBuffers Buffers;
  vtkSmartPointer<vtkDataObject> Piece;
  vtkMTimeType PieceTime = 0;
  bool IsBeingMade = false;  // the piece announces a VDI to come
  bool HasJustCome = false;  // the piece is the first VDI after such an announcement
  FrameKind NextFrame = FrameKind::Whole;
  bool IsBehind = false;           // the window shows less than it will
  bool IsRecovering = false;       // true until a new device has drawn a final frame
  Attempt Failed;                  // the last attempt that couldn't be drawn
  Attempt Rough;                   // the attempt whose full picture loses every device
  std::array<double, 6> Bounds{};  // the last result of GetBounds
  bool IsPeeled = false;           // this frame peels volumes
  std::vector<vdi::ClipPlane> Planes;

  pv::VDINotices Notices;
  std::string Said;  // the last text reported as an error

  pv::VDIPainter Painter;
  pv::VDIFramePolicy Policy;
  std::vector<float> Window;  // memory of a depth buffer, which frames of an orbit reuse
  std::vector<float> Ends;    // depth at which each pixel's ray ends at an object
  bool WasSmooth = false;     // the renderer smooths edges, except in this frame

  /// The view and the VDI whose full picture is in the texture. Nullopt if that picture is rough or was made
  /// by a thread.
  std::optional<pv::StillView> Textured;
  std::uint64_t TexturedVersion = 0;

  /// Whether the next frame leaves a slow picture to a later one.
  bool DefersIn(vtkRenderWindow* window, const glm::ivec2& port) const {
    return this->NextFrame == FrameKind::Deferred && window->GetStereoRender() == 0 &&
           this->Policy.takesLong(this->Buffers, port);
  }
  bool HasTexture(vtkRenderWindow* window, const pv::StillView& view) const {
    return this->Textured == view && this->TexturedVersion == this->Buffers.version() &&
           this->Painter.hasPicture(window);
  }
};

vtkVDIProp::vtkVDIProp() : Internal(new Internals) {}

vtkVDIProp::~vtkVDIProp() = default;

void vtkVDIProp::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Reconstruction: " << this->Reconstruction << "\n"
     << indent << "FrameRate: " << this->FrameRate << "\n"
     << indent << "Opacity: " << this->Opacity << "\n"
     << indent << "ClippingPlanes: " << this->Internal->Planes.size() << "\n"
     << indent << "Problem: " << this->Internal->Notices.problem() << "\n";
}

void vtkVDIProp::AddClippingPlane(double originX, double originY, double originZ, double normalX,
                                  double normalY, double normalZ) {
  std::vector<vdi::ClipPlane> planes = this->Internal->Planes;
  planes.push_back({{originX, originY, originZ}, {normalX, normalY, normalZ}});
  try {
    vdi::validate(vdi::Region{.box = std::nullopt, .planes = planes});
  } catch (const vdi::Error& error) {
    vtkErrorMacro(<< error.what());
    return;
  }
  this->Internal->Planes = std::move(planes);
  this->Modified();
}

void vtkVDIProp::RemoveAllClippingPlanes() {
  if (this->Internal->Planes.empty()) return;
  this->Internal->Planes.clear();
  this->Modified();
}

void vtkVDIProp::SetVisibility(vtkTypeBool visible) {
  this->Superclass::SetVisibility(visible);
  if (visible == 0) this->Internal->IsBehind = false;
  this->Internal->Notices.show(visible != 0);
}

vtkTextActor* vtkVDIProp::GetMessageActor() {
  return this->Internal->Notices.message();
}

vtkTextActor* vtkVDIProp::GetAngleActor() {
  return this->Internal->Notices.angleMessage();
}

void vtkVDIProp::SetObstacle(const std::string& text) {
  this->Internal->Notices.setObstacle(text);
  this->Internal->Notices.show(this->GetVisibility() != 0);
}

void vtkVDIProp::Say(const std::string& text) {
  this->Internal->Notices.setProblem(text);
  this->Internal->Notices.show(this->GetVisibility() != 0);
  if (text.empty() || text == this->Internal->Said) return;
  this->Internal->Said = text;
  if (!pv::isSaidUpstream(text)) vtkErrorMacro(<< text);
}

void vtkVDIProp::Prepare(vtkDataObject* piece, FrameKind frame) {
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
  if (frame == FrameKind::Interactive) {
    this->Take(std::chrono::seconds(0));
  } else {
    const bool hasFrame = internal.Buffers.hasVdi() || internal.HasJustCome;
    this->Take(frame == FrameKind::Deferred && hasFrame ? shortWait : untilDone);
  }
  if (!internal.Buffers.isLoading()) internal.HasJustCome = false;
  // The window is behind while a VDI is loading, even if the camera looks away and nothing is drawn. A whole
  // frame doesn't change that: it is a saved picture, which the window doesn't show.
  if (frame != FrameKind::Whole)
    internal.IsBehind = frame == FrameKind::Deferred && internal.Buffers.isLoading();
}

void vtkVDIProp::LookAround(vtkObject* renderer, unsigned long, void*) {
  Internals& internal = *this->Internal;
  auto* own = vtkRenderer::SafeDownCast(renderer);
  if (own == nullptr || own->GetSelector() != nullptr || this->GetVisibility() == 0) return;
  internal.Notices.clear();
  if (this->IsCaptured) {  // saved pictures have no notices
    internal.Notices.show(true);
    return;
  }
  const std::optional<vdi::View> view = viewOf(own);
  const auto sightOf = [&view](vtkProp* prop) -> std::optional<pv::VDISight> {
    auto* vdi = vtkVDIProp::SafeDownCast(prop);
    if (vdi == nullptr || !view) return std::nullopt;
    return pv::VDISight{vdi->IsShown(), vdi->IssueIn(*view), vdi->AngleIn(*view)};
  };
  if (internal.IsBeingMade || internal.HasJustCome) {
    internal.Notices.note("The VDI is being made.");
  } else if (internal.Buffers.isEmpty()) {
    internal.Notices.note(
        "This VDI shows nothing: from its viewpoint none of its scene is visible, or all of it is "
        "transparent.");
  } else if (view) {
    const bool isFiltered = internal.Piece != nullptr && pv::isFiltered(internal.Piece->GetFieldData());
    internal.Notices.noteViewpoint(own, *view, this, sightOf, isFiltered);
  }
  if (view) internal.Notices.noteAngle(own, this, sightOf);
  internal.Notices.show(true);
}

bool vtkVDIProp::IsShown() {
  return this->GetVisibility() != 0 && this->Opacity > 0.0 && this->Internal->Buffers.hasVdi() &&
         this->Internal->Piece != nullptr;
}

std::optional<vdi::ViewpointIssue> vtkVDIProp::IssueIn(const vdi::View& view) {
  const pv::VDIBuffers& buffers = this->Internal->Buffers;
  if (!this->IsShown()) return std::nullopt;
  return vdi::viewpointIssue(pv::boxOf(buffers.bounds().data()), *buffers.viewpoint(), view);
}

std::optional<double> vtkVDIProp::AngleIn(const vdi::View& view) {
  const Internals& internal = *this->Internal;
  if (!this->SaysAngle || !internal.Notices.obstacle().empty() || !this->IsShown()) return std::nullopt;
  if (this->IssueIn(view).value_or(vdi::ViewpointIssue::FarBeside) != vdi::ViewpointIssue::FarBeside)
    return std::nullopt;
  return vdi::degreesBetween(pv::boxOf(internal.Buffers.bounds().data()),
                             internal.Buffers.viewpoint()->camera(), view.camera());
}

bool vtkVDIProp::IsBehind() const {
  return this->Internal->IsBehind;
}

bool vtkVDIProp::IsLoading() const {
  return this->IsBehind() && this->Internal->Buffers.isLoading();
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

/// If the device was lost, loads the VDI on a new one and returns true. A lost device stays lost.
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
      default:  // the error's own text is enough
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
  this->Internal->Painter.release(window);
  this->Superclass::ReleaseGraphicsResources(window);
}

int vtkVDIProp::RenderOpaqueGeometry(vtkViewport* viewport) {
  // VTK smooths edges before it draws volumes. On a CPU that takes five times as long as the rest of a frame.
  auto* renderer = vtkRenderer::SafeDownCast(viewport);
  if (renderer == nullptr || !renderer->GetUseFXAA() || !pv::drawsOnCpu()) return 0;
  Internals& internal = *this->Internal;
  const bool isRough = internal.DefersIn(renderer->GetRenderWindow(), pv::viewportOf(renderer).size)
                           ? !internal.Buffers.still().isDone()
                           : internal.NextFrame == FrameKind::Interactive;
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
  if (this->MarksDepth) internal.Painter.markDepth(window);
  if (!internal.Buffers.hasVdi() || !internal.Notices.obstacle().empty()) return 0;
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
    const Attempt attempt{internal.PieceTime, pv::viewportOf(renderer).size};
    if (internal.Failed != attempt) internal.Piece = nullptr;  // the next frame tries once more
    internal.Failed = attempt;
    return 0;
  }
}

/// Draws the frame. Returns whether the frame is final.
bool vtkVDIProp::Draw(vtkRenderer* renderer, vtkOpenGLRenderWindow* window) {
  Internals& internal = *this->Internal;
  const pv::Viewport port = pv::viewportOf(renderer);
  if (port.size.x < 1 || port.size.y < 1) return true;
  pv::StillView view{pv::ViewMatrices(renderer), port.size,
                     static_cast<vdi::Reconstruction>(this->Reconstruction), internal.Planes,
                     std::move(internal.Window)};
  pv::readDepths(window, port, view.window);
  if (internal.DefersIn(window, port.size)) return this->DrawDeferred(window, std::move(view));
  internal.Buffers.still().drop();
  const bool isInteractive = internal.NextFrame == FrameKind::Interactive;
  if (!isInteractive && !internal.HasTexture(window, view)) {
    this->DrawNow(window, view, {view.size, std::nullopt});
    internal.Textured = std::move(view);
    internal.TexturedVersion = internal.Buffers.version();
    return true;
  }
  if (isInteractive) {
    this->DrawRough(window, view);
  } else {
    internal.Painter.draw(window, this->Opacity);
  }
  internal.Window = std::move(view.window);
  return true;
}

bool vtkVDIProp::DrawDeferred(vtkOpenGLRenderWindow* window, pv::StillView view) {
  Internals& internal = *this->Internal;
  pv::VDIStill& still = internal.Buffers.still();
  if (internal.Rough == Attempt{internal.PieceTime, view.size}) {
    still.drop();  // its size may have changed
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
    internal.Textured.reset();
    internal.Painter.load(window, view.size, picture);
    internal.Painter.draw(window, this->Opacity);
    internal.Policy.guess({view.size, std::nullopt}, still.seconds());
    return true;
  }
  if (still.isOf(view) && internal.Painter.hasPicture(window)) {
    internal.Painter.draw(window, this->Opacity);  // the texture has the rough picture
    internal.IsBehind = true;
    return false;
  }
  // If each frame differs from the last one, a thread's picture comes too late for any of them.
  const bool isUseless = still.isDone() && !still.isSeen();
  still.drop();
  if (isUseless) {
    this->DrawNow(window, view, {view.size, std::nullopt});
    return true;
  }
  this->DrawRough(window, view);
  if (!internal.Buffers.isLoading()) still.start(internal.Buffers.renderer(), std::move(view));
  internal.IsBehind = true;
  return false;
}

/// Gives up a full picture that has lost two devices in a row, and would lose more.
void vtkVDIProp::StayRough(vtkOpenGLRenderWindow* window, const pv::StillView& view,
                           const vdi::Error& error) {
  Internals& internal = *this->Internal;
  internal.IsRecovering = false;
  if (!this->Recover(error)) throw vdi::Error(error);
  internal.Rough = {internal.PieceTime, view.size};
  this->DrawRough(window, view);
  this->Say(std::string("The VDI is shown with few pixels because the full picture can't be made: ") +
            error.what());
}

void vtkVDIProp::DrawRough(vtkOpenGLRenderWindow* window, const pv::StillView& view) {
  Internals& internal = *this->Internal;
  const vdi::View whole = view.matrices.view(view.size.x, view.size.y);
  this->DrawNow(window, view,
                internal.Policy.interactive(internal.Buffers, whole, view.size, this->FrameRate));
}

void vtkVDIProp::DrawNow(vtkOpenGLRenderWindow* window, const pv::StillView& view,
                         const pv::PictureForm& form) {
  Internals& internal = *this->Internal;
  internal.Textured.reset();
  const Clock::time_point start = Clock::now();
  const glm::ivec2& size = form.size;
  const bool hasObjects = std::any_of(view.window.begin(), view.window.end(), pv::isObject);
  internal.Ends.resize(hasObjects ? static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) : 0);
  if (hasObjects) pv::depthsOf(view.matrices, view.window, view.size, size, internal.Ends);

  vdi::VdiRenderer& views =
      form.thin ? internal.Buffers.thinRenderer(*form.thin) : internal.Buffers.renderer();
  vdi::Reconstruction reconstruction = view.reconstruction;
  // Leaning faces take longer, so moving frames leave them out. A thinned VDI lacks the lists in which a
  // surface continues.
  if (form.thin || internal.NextFrame == FrameKind::Interactive)
    reconstruction = std::min(reconstruction, vdi::Reconstruction::Smooth);
  views.setClipPlanes(view.planes);
  const Clock::time_point renderStart = Clock::now();
  const vdi::ImageBytes picture = views.renderBytes(view.matrices.view(size.x, size.y), internal.Ends,
                                                    vdi::Alpha::Premultiplied, reconstruction);
  const double renderSeconds = secondsSince(renderStart);
  internal.Painter.load(window, size, picture.rgba);
  internal.Painter.draw(window, this->Opacity);

  if (internal.NextFrame == FrameKind::Whole) {
    internal.Policy.guess(form, renderSeconds);
  } else {
    internal.Policy.measure(form, secondsSince(start), renderSeconds);
  }
}
