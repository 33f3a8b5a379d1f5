#include "vtkVDIRepresentation.h"

#include <vtkAbstractArray.h>
#include <vtkAlgorithmOutput.h>
#include <vtkCommand.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMPIMoveData.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkPVRenderView.h>
#include <vtkPVSession.h>
#include <vtkPVView.h>
#include <vtkPolyData.h>
#include <vtkProcessModule.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkVolume.h>
#include <vtkVolumeCollection.h>

#include <algorithm>
#include <vector>

#include "VDIPiece.h"
#include "VDISession.h"
#include "VDIUpdate.h"
#include "vtkVDIForViews.h"
#include "vtkVDIProp.h"

vtkStandardNewMacro(vtkVDIRepresentation);

namespace {

/// Whether there are a client and a server. Both can draw, and both get the same answer.
bool hasServer() {
  if (pv::isServer()) return true;
  auto* session = vtkPVSession::SafeDownCast(vtkProcessModule::GetProcessModule()->GetSession());
  return session != nullptr && session->GetController(vtkPVSession::RENDER_SERVER_ROOT) != nullptr;
}

/// Whether there are several ranks without a client. All of them always draw, and IceT composites their
/// pictures.
bool drawsOnRanks() {
  vtkProcessModule* module = vtkProcessModule::GetProcessModule();
  return vtkProcessModule::GetProcessType() == vtkProcessModule::PROCESS_BATCH &&
         module->GetNumberOfLocalPartitions() > 1;
}

/// Whether views are windows. In pvbatch and in simulations, views are only for pictures.
bool hasWindows() {
  return vtkProcessModule::GetProcessType() == vtkProcessModule::PROCESS_CLIENT;
}

/// The offsets of the VDI in the data set; null if there is none.
vtkAbstractArray* offsetsOf(vtkDataObject* data) {
  vtkFieldData* fields = data != nullptr ? data->GetFieldData() : nullptr;
  return fields != nullptr ? fields->GetAbstractArray("VDI.offsets") : nullptr;
}

bool showsVolumes(vtkPVRenderView* view) {
  vtkVolumeCollection* volumes = view->GetRenderer()->GetVolumes();
  vtkCollectionSimpleIterator at;
  volumes->InitTraversal(at);
  while (vtkVolume* volume = volumes->GetNextVolume(at)) {
    if (volume->GetVisibility() != 0) return true;
  }
  return false;
}

/// Whether the view draws on ranks that don't have the VDI. Volumes require that. On ranks without a client,
/// volumes are wrong when all data are on the first rank.
bool drawsVolumesOnRanks(vtkPVRenderView* view) {
  return hasServer() ? view->GetUseDistributedRenderingForRender() : drawsOnRanks() && showsVolumes(view);
}

/// Whether to ask that the client draws the view. The first representation that asks decides, and a volume
/// that needs the ranks would be invisible then.
bool wantsClient(vtkPVRenderView* view) {
  return hasServer() && view != nullptr && !showsVolumes(view);
}

std::vector<vtkWeakPointer<vtkPVRenderView>>& deferringViews() {
  static std::vector<vtkWeakPointer<vtkPVRenderView>> views;
  return views;
}

bool defersStillFrames(vtkPVRenderView* view) {
  const std::vector<vtkWeakPointer<vtkPVRenderView>>& views = deferringViews();
  return std::find(views.begin(), views.end(), view) != views.end();
}

}  // namespace

vtkVDIRepresentation::vtkVDIRepresentation() {
  pv::packNothing(this->Piece);
}

vtkVDIRepresentation::~vtkVDIRepresentation() {
  this->ForgetInteractor();
}

void vtkVDIRepresentation::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  this->Prop->PrintSelf(os, indent.GetNextIndent());
}

void vtkVDIRepresentation::SetReconstruction(int reconstruction) {
  this->Prop->SetReconstruction(reconstruction);
}

void vtkVDIRepresentation::AddClippingPlane(double originX, double originY, double originZ, double normalX,
                                            double normalY, double normalZ) {
  this->Prop->AddClippingPlane(originX, originY, originZ, normalX, normalY, normalZ);
}

void vtkVDIRepresentation::RemoveAllClippingPlanes() {
  this->Prop->RemoveAllClippingPlanes();
}

void vtkVDIRepresentation::SetFrameRate(double rate) {
  this->Prop->SetFrameRate(rate);
}

void vtkVDIRepresentation::SetOpacity(double opacity) {
  this->Prop->SetOpacity(opacity);
}

void vtkVDIRepresentation::SetVisibility(bool visible) {
  this->Superclass::SetVisibility(visible);
  this->Prop->SetVisibility(visible);
}

int vtkVDIRepresentation::FillInputPortInformation(int, vtkInformation* info) {
  // Accepts anything: data without a VDI get a message, and composite data come whole.
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

int vtkVDIRepresentation::RequestData(vtkInformation* request, vtkInformationVector** inputs,
                                      vtkInformationVector* outputs) {
  const bool hasInput = inputs[0]->GetNumberOfInformationObjects() > 0;
  if (hasInput && pv::isRoot()) {
    vtkDataObject* input = vtkDataObject::GetData(inputs[0]);
    vtkAbstractArray* offsets = offsetsOf(input);
    this->HasPacked = true;
    // Skips a VDI that is packed already, for example while the next one is being made. It would be sent and
    // loaded again.
    if (offsets != nullptr && offsets == this->PackedOf)
      return this->Superclass::RequestData(request, inputs, outputs);
    pv::packVdi(input, pv::isServer(), this->Piece);
    if (vtkVDIForViews::GeneratorOf(this) != nullptr) pv::markFiltered(this->Piece);
    this->PackedOf = offsets;
  } else {
    pv::packNothing(this->Piece);  // clients have no input, and other ranks have no VDI
  }
  this->HasPacked = true;
  this->Piece->Modified();
  return this->Superclass::RequestData(request, inputs, outputs);
}

int vtkVDIRepresentation::ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* in,
                                             vtkInformation* out) {
  const bool updates = request == vtkPVView::REQUEST_UPDATE() && this->GetNeedsUpdate();
  this->HasPacked = false;
  {
    const pv::Update update(this, request);
    const vtkVDIForViews::Bracket bracket(request == vtkPVView::REQUEST_UPDATE() ? this : nullptr);
    if (!this->Superclass::ProcessViewRequest(request, in, out)) return 0;
  }
  auto* view = vtkPVRenderView::SafeDownCast(in->Get(vtkPVView::VIEW()));
  if (updates && !this->HasPacked && pv::isRoot() && view != nullptr && !view->IsCached(this)) {
    // The input's update has failed. Its earlier data aren't the requested ones.
    pv::packProblem(pv::failedUpstream, this->Piece);
    this->PackedOf = nullptr;
    view->ClearCache(this);
  }
  if (request == vtkPVView::REQUEST_UPDATE()) {
    // A VDI's real size would make the view render remotely and with less detail.
    constexpr unsigned long tiny = 1;
    vtkPVRenderView::SetPiece(in, this, this->Piece, tiny);
    vtkPVRenderView::SetDeliverToClientAndRenderingProcesses(in, this, /*deliver_to_client*/ true,
                                                             /*gather_before_delivery*/ false);
    double bounds[6];
    if (pv::boundsOf(this->Piece->GetFieldData(), bounds))
      vtkPVRenderView::SetGeometryBounds(in, this, bounds);
    // The process with the VDI draws all objects.
    if (wantsClient(view)) vtkPVRenderView::SetRequiresDistributedRendering(in, this, false);
    if (drawsOnRanks()) vtkPVRenderView::SetForceDataDistributionMode(in, vtkMPIMoveData::COLLECT);
  } else if (request == vtkPVView::REQUEST_UPDATE_LOD()) {
    if (wantsClient(view)) vtkPVRenderView::SetRequiresDistributedRenderingLOD(in, this, false);
  } else if (request == vtkPVView::REQUEST_RENDER()) {
    this->Prop->SetMarksDepth(drawsOnRanks());
    this->Prop->SetObstacle(
        view != nullptr && drawsVolumesOnRanks(view)
            ? "A VDI can't be shown beside a volume that is drawn on all ranks: hide the objects "
              "of representation Volume."
            : "");
    vtkAlgorithmOutput* port = vtkPVRenderView::GetPieceProducer(in, this);
    if (port != nullptr && view != nullptr) {
      this->Prop->SetIsCaptured(IsCaptured(view->GetRenderWindow()));
      this->Prop->SetSaysAngle(this->SaysAngle && hasWindows());
      this->Prop->Prepare(port->GetProducer()->GetOutputDataObject(port->GetIndex()),
                          this->FrameKindOf(view));
    }
  }
  return 1;
}

bool vtkVDIRepresentation::IsCaptured(vtkRenderWindow* window) {
  // A window swaps no buffers while a picture is taken of it.
  return window->GetSwapBuffers() == 0;
}

void vtkVDIRepresentation::DeferStillFrames(vtkPVRenderView* view) {
  if (defersStillFrames(view)) return;
  std::erase(deferringViews(), nullptr);  // views that no longer exist
  deferringViews().emplace_back(view);
}

void vtkVDIRepresentation::DeferNoStillFrames() {
  deferringViews().clear();
}

vtkVDIProp::FrameKind vtkVDIRepresentation::FrameKindOf(vtkPVRenderView* view) {
  if (this->IsInteractive(view)) return vtkVDIProp::FrameKind::Interactive;
  return defersStillFrames(view) && !IsCaptured(view->GetRenderWindow()) ? vtkVDIProp::FrameKind::Deferred
                                                                         : vtkVDIProp::FrameKind::Whole;
}

/// Whether the next frame may be rough and late, because the camera is moving. Time steps during that time
/// ask for still frames.
bool vtkVDIRepresentation::IsInteractive(vtkPVRenderView* view) {
  vtkRenderWindowInteractor* interactor = view->GetInteractor();
  if (interactor != this->Interactor) {
    this->ForgetInteractor();
    this->Interactor = interactor;
    if (interactor != nullptr) {
      constexpr float first = 1.0F;  // runs before other observers, which draw the still frame at the end
      this->Observers = {
          interactor->AddObserver(vtkCommand::StartInteractionEvent, this, &vtkVDIRepresentation::Drag),
          interactor->AddObserver(vtkCommand::EndInteractionEvent, this, &vtkVDIRepresentation::Drop, first)};
    }
  }
  const auto now = std::chrono::steady_clock::now();
  if (view->GetRenderWindow()->GetDesiredUpdateRate() >= 1.0) {
    this->LastInteractive = now;
    return true;
  }
  // A user who holds the camera without moving it gets the full frame.
  constexpr std::chrono::seconds rest{2};
  return this->IsDragged && now - this->LastInteractive < rest;
}

void vtkVDIRepresentation::Drag() {
  this->IsDragged = true;
}

void vtkVDIRepresentation::Drop() {
  this->IsDragged = false;
}

void vtkVDIRepresentation::ForgetInteractor() {
  if (this->Interactor != nullptr) {
    for (const unsigned long observer : this->Observers) this->Interactor->RemoveObserver(observer);
  }
  this->Interactor = nullptr;
  this->IsDragged = false;
}

bool vtkVDIRepresentation::AddToView(vtkView* view) {
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (renderView == nullptr) return false;
  vtkVDIProp* prop = this->Prop;
  this->StartObserver =
      renderView->GetRenderer()->AddObserver(vtkCommand::StartEvent, prop, &vtkVDIProp::LookAround);
  renderView->GetRenderer()->AddViewProp(this->Prop);
  renderView->GetNonCompositedRenderer()->AddViewProp(this->Prop->GetMessageActor());
  renderView->GetNonCompositedRenderer()->AddViewProp(this->Prop->GetAngleActor());
  return this->Superclass::AddToView(view);
}

bool vtkVDIRepresentation::RemoveFromView(vtkView* view) {
  auto* renderView = vtkPVRenderView::SafeDownCast(view);
  if (renderView == nullptr) return false;
  this->ForgetInteractor();
  renderView->GetRenderer()->RemoveObserver(this->StartObserver);
  renderView->GetRenderer()->RemoveViewProp(this->Prop);
  renderView->GetNonCompositedRenderer()->RemoveViewProp(this->Prop->GetMessageActor());
  renderView->GetNonCompositedRenderer()->RemoveViewProp(this->Prop->GetAngleActor());
  return this->Superclass::RemoveFromView(view);
}
