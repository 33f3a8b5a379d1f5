#include "vtkSMVDIGeneratorProxy.h"

#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkCommunicator.h>
#include <vtkDataObject.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkPVTemporalDataInformation.h>
#include <vtkProcessModule.h>
#include <vtkSMArrayListDomain.h>
#include <vtkSMComparativeViewProxy.h>
#include <vtkSMOutputPort.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMProxyIterator.h>
#include <vtkSMProxySelectionModel.h>
#include <vtkSMRenderViewProxy.h>
#include <vtkSMRepresentationProxy.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMTrace.h>
#include <vtkSMUncheckedPropertyHelper.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "VDICameras.h"
#include "VDILastVdi.h"
#include "VDIMaps.h"
#include "VDIServer.h"
#include "VDISession.h"
#include "VDIVolumeDisplay.h"
#include "plugin/VolumetricDepthImages/ParaViewVersions.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/Estimate.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/Viewpoint.h"

namespace {

/// Collective: replaces the numbers by the largest over the ranks. Returns false if another rank doesn't take
/// part; the next update reports that.
template <std::size_t N>
bool takeLargest(vtkMultiProcessController* ranks, std::array<double, N>& numbers, const char* what) {
  try {
    pv::enterCollective(ranks, what);
  } catch (const vdi::Error&) {
    return false;
  }
  const std::array<double, N> mine = numbers;
  ranks->AllReduce(mine.data(), numbers.data(), static_cast<vtkIdType>(N), vtkCommunicator::MAX_OP);
  return true;
}

/// A number that doubles hold exactly. Different texts have different ones, in all likelihood.
double identityOf(const std::string& text) {
  constexpr std::size_t most = (std::size_t{1} << 53) - 1;
  return static_cast<double>(std::hash<std::string>()(text) & most);
}

/// Whether these are the bounds of a cropping box that has been set.
bool isSet(const std::vector<double>& box) {
  return std::ranges::any_of(box, [](double bound) { return bound != 0.0; });
}

}  // namespace

vtkStandardNewMacro(vtkSMVDIGeneratorProxy);

/// Each client's facts about its part of the input and of the array, gathered from all ranks.
struct vtkSMVDIGeneratorProxy::InputOfRanks {
  int Components = 0;
  std::array<double, 2> Range{};  // the lower end is above the upper one if there are no values
  vdi::Box Whole;                 // pv::wholeToCrop
};

vtkSMVDIGeneratorProxy::vtkSMVDIGeneratorProxy() = default;
vtkSMVDIGeneratorProxy::~vtkSMVDIGeneratorProxy() = default;

bool vtkSMVDIGeneratorProxy::EnterUpdate(vtkSMProxy* proxy) {
  if constexpr (pv::updatesAreCollective) {
    try {
      pv::enterCollective(vtkMultiProcessController::GetGlobalController(), proxy->GetXMLName());
    } catch (const std::exception& error) {
      vtkErrorWithObjectMacro(proxy, << error.what());
      return false;
    }
  }
  return true;
}

vtkMultiProcessController* vtkSMVDIGeneratorProxy::RanksWithClients() {
  if (!vtkProcessModule::GetProcessModule()->GetSymmetricMPIMode()) return nullptr;
  return vtkMultiProcessController::GetGlobalController();
}

void vtkSMVDIGeneratorProxy::UpdatePipeline() {
  if (!EnterUpdate(this)) return;
  this->TakeWhatIsNotSet(std::nullopt);
  const bool isForView = this->UpdatesForView;
  // After a view got an earlier output, the proxy counts as updated, and the superclass would do nothing.
  if (!isForView && this->IsOutdated()) this->MarkDirty(this);
  if (isForView) pv::command(this, "BeginView");
  this->Superclass::UpdatePipeline();
  if (isForView) pv::command(this, "EndView");
}

void vtkSMVDIGeneratorProxy::UpdatePipeline(double time) {
  if (!EnterUpdate(this)) return;
  this->TakeWhatIsNotSet(time);
  const bool isForView = this->UpdatesForView;
  if (isForView) pv::command(this, "BeginView");
  this->Superclass::UpdatePipeline(time);
  if (isForView) pv::command(this, "EndView");
}

void vtkSMVDIGeneratorProxy::UpdateVTKObjects() {
  this->Superclass::UpdateVTKObjects();
  this->WatchMap();
  // Where each rank has a client, only some of their scripts may set this property. The ranks meet in the
  // next update, or when a view is drawn.
  if (this->Taken && !this->Choosing && RanksWithClients() == nullptr && pv::isConnected(this->GetSession()))
    this->FollowArray();
}

int vtkSMVDIGeneratorProxy::LoadXMLState(vtkPVXMLElement* element, vtkSMProxyLocator* locator) {
  this->Taken = true;
  return this->Superclass::LoadXMLState(element, locator);
}

void vtkSMVDIGeneratorProxy::LoadState(const vtkSMMessage* state, vtkSMProxyLocator* locator) {
  this->Superclass::LoadState(state, locator);
  // The first update sets the map. Forget follows the undo of that update.
  if (pv::proxyIn(this, "LookupTable") != nullptr) this->Taken = true;
}

void vtkSMVDIGeneratorProxy::TakeWhatIsNotSet(std::optional<double> time) {
  if (vtkMultiProcessController* ranks = RanksWithClients()) {
    this->WatchViews();
    if (!this->MeetRanks(ranks, time)) return;
    if (this->Taken) this->FollowArray();
    if (std::exchange(this->FollowsMap, false) && this->TakeNamedComponent()) {
      if (!this->GatherInput(ranks, this->CurrentSubject(), time)) return;
      this->FitToComponent();
    }
  }
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "what the view shows");
  this->TakeFromView();
  const Raised choosing(this->Choosing);
  this->ChooseLookupTable(time, nullptr);
  this->Shown = this->CurrentSubject();
}

void vtkSMVDIGeneratorProxy::WatchViews() {
  vtkNew<vtkSMProxyIterator> views;
  views->SetSessionProxyManager(this->GetSessionProxyManager());
  views->SetModeToOneGroup();
  for (views->Begin("views"); views->IsAtEnd() == 0; views->Next()) {
    vtkSMProxy* view = views->GetProxy();
    const auto isView = [view](const vtkSMProxy* watched) { return watched == view; };
    if (std::ranges::any_of(this->Watched, isView)) continue;
    view->AddObserver(vtkCommand::StartEvent, this, &vtkSMVDIGeneratorProxy::BeforeRender);
    this->Watched.emplace_back(view);
  }
}

void vtkSMVDIGeneratorProxy::BeforeRender() {
  if (!this->Choosing) this->TakeWhatIsNotSet(std::nullopt);
}

bool vtkSMVDIGeneratorProxy::MeetRanks(vtkMultiProcessController* ranks, std::optional<double> time) {
  this->OfRanks.reset();
  const Subject now = this->CurrentSubject();
  const double subject =
      identityOf(now.Array + '\n' + std::to_string(now.Association) + '\n' + std::to_string(now.Component));
  const bool isNew =
      !this->Taken || !this->Shown || now != *this->Shown || this->LacksLookupTable() || this->FollowsMap;
  enum { Highest, Lowest, New, Changed, Unchanged };
  std::array<double, 5> all{subject, -subject, isNew ? 1.0 : 0.0, this->NeedsUpdate ? 1.0 : 0.0,
                            this->NeedsUpdate ? 0.0 : 1.0};
  if (!takeLargest(ranks, all, "VolumetricDepthImage's properties")) return false;
  const bool isSame = all[Highest] == -all[Lowest];
  // A rank whose script has changed nothing would leave the others waiting in the filter.
  if (!isSame || (all[Changed] != 0.0 && all[Unchanged] != 0.0)) {
    pv::command(this, "Renew");
    this->MarkDirty(this);
  }
  return isSame && (all[New] == 0.0 || this->GatherInput(ranks, now, time));
}

bool vtkSMVDIGeneratorProxy::GatherInput(vtkMultiProcessController* ranks, const Subject& subject,
                                         std::optional<double> time) {
  this->OfRanks.reset();
  std::array<double, 2> range{};
  const bool hasRange = this->RangeOfScalars(subject.Array.c_str(), subject.Association, time, range.data());
  const vdi::Box whole = pv::wholeToCrop(this->InputInformation());
  // Ranks without blocks take part: they must take the same next steps as the others.
  constexpr double none = -std::numeric_limits<double>::infinity();
  enum { Components, Low, High, Box };
  std::array<double, 9> numbers{};
  numbers.fill(none);
  numbers[Components] = this->ComponentsOf(subject.Array, subject.Association);
  if (hasRange) {
    numbers[Low] = -range[0];
    numbers[High] = range[1];
  }
  for (int axis = 0; axis < 3 && !whole.empty(); ++axis) {
    const std::size_t place = Box + 2 * static_cast<std::size_t>(axis);
    numbers[place] = -whole.lo[axis];
    numbers[place + 1] = whole.hi[axis];
  }
  if (!takeLargest(ranks, numbers, "VolumetricDepthImage's input")) return false;
  this->OfRanks = std::make_unique<InputOfRanks>();
  InputOfRanks& input = *this->OfRanks;
  input.Components = static_cast<int>(numbers[Components]);
  input.Range = {-numbers[Low], numbers[High]};
  for (int axis = 0; axis < 3 && numbers[Box] > none; ++axis) {
    const std::size_t place = Box + 2 * static_cast<std::size_t>(axis);
    input.Whole.lo[axis] = -numbers[place];
    input.Whole.hi[axis] = numbers[place + 1];
  }
  return true;
}

vtkSMVDIGeneratorProxy::Subject vtkSMVDIGeneratorProxy::CurrentSubject() {
  const vtkSMPropertyHelper input(this, "Input");
  const vtkSMPropertyHelper scalars(this, "SelectInputScalars");
  const char* name = scalars.GetNumberOfElements() > 4 ? scalars.GetAsString(4) : nullptr;
  Subject subject;
  subject.Input = input.GetNumberOfElements() > 0 ? input.GetAsProxy() : nullptr;
  subject.Port = subject.Input != nullptr ? input.GetOutputPort() : 0;
  subject.Array = name != nullptr ? name : "";
  subject.Association = scalars.GetNumberOfElements() > 3 ? scalars.GetAsInt(3) : 0;
  subject.Component = vtkSMPropertyHelper(this, "Component").GetAsInt();
  return subject;
}

vtkSMRenderViewProxy* vtkSMVDIGeneratorProxy::RenderViewOf(vtkSMProxy* view) {
  auto* comparative = vtkSMComparativeViewProxy::SafeDownCast(view);
  return vtkSMRenderViewProxy::SafeDownCast(comparative != nullptr ? comparative->GetRootView() : view);
}

vtkSMViewProxy* vtkSMVDIGeneratorProxy::ActiveView() {
  vtkSMProxySelectionModel* active = this->GetSessionProxyManager()->GetSelectionModel("ActiveView");
  return active != nullptr ? vtkSMViewProxy::SafeDownCast(active->GetCurrentProxy()) : nullptr;
}

vtkSMRenderViewProxy* vtkSMVDIGeneratorProxy::ViewToTakeFrom() {
  vtkSMRenderViewProxy* view = RenderViewOf(this->ActiveView());
  if (view == nullptr) return nullptr;
  return this->RepresentationIn(this->ActiveView()) != nullptr || pv::isPlaced(view) ? view : nullptr;
}

vtkSMProxy* vtkSMVDIGeneratorProxy::RepresentationIn(vtkSMViewProxy* view) {
  vtkSMPropertyHelper input(this, "Input");
  auto* source = vtkSMSourceProxy::SafeDownCast(input.GetAsProxy());
  if (view == nullptr || source == nullptr) return nullptr;
  return view->FindRepresentation(source, static_cast<int>(input.GetOutputPort()));
}

void vtkSMVDIGeneratorProxy::TakeArrayFromView() {
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  if (shown == nullptr || shown->GetProperty("ColorArrayName") == nullptr) return;
  const vtkSMPropertyHelper colored(shown, "ColorArrayName");
  const int association = colored.GetInputArrayAssociation();
  const std::string name = colored.GetInputArrayNameToProcess() ? colored.GetInputArrayNameToProcess() : "";
  if (name.empty() || (association != vtkDataObject::POINT && association != vtkDataObject::CELL)) return;
  vtkSMPropertyHelper(this, "SelectInputScalars").SetInputArrayToProcess(association, name.c_str());
  // By default a map colours vectors by their magnitude.
  vtkSMProxy* map = vtkSMPropertyHelper(shown, "LookupTable", true).GetAsProxy();
  const int components = this->ComponentsOf(name, association);
  if (map == nullptr || components < 2) return;
  const bool together =
      pv::takesComponentsTogether(shown) && vdi::componentIssue(vdi::together, components).empty();
  vtkSMPropertyHelper(this, "Component").Set(together ? vdi::together : pv::componentNamedBy(map));
}

std::map<std::string, int> vtkSMVDIGeneratorProxy::ArraysOfInput() {
  std::map<std::string, int> arrays;
  auto* domain = this->GetProperty("SelectInputScalars")->FindDomain<vtkSMArrayListDomain>();
  for (unsigned int i = 0; domain != nullptr && i < domain->GetNumberOfStrings(); ++i) {
    const char* name = domain->GetString(i);
    if (const int components = this->ComponentsOf(name, domain->GetFieldAssociation(i)); components > 0)
      arrays[name] = components;
  }
  return arrays;
}

bool vtkSMVDIGeneratorProxy::ChooseArray(const std::string& name, int association) {
  const Subject before = this->CurrentSubject();
  std::vector<int> accepted{association};
  if (association == vtkDataObject::FIELD)
    accepted = {before.Association, vtkDataObject::POINT, vtkDataObject::CELL};
  const auto has = [&](int each) { return this->ComponentsOf(name, each) > 0; };
  const auto found = std::ranges::find_if(accepted, has);
  if (found == accepted.end()) return false;
  if (name == before.Array && *found == before.Association) return true;
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "the array by which it is coloured");
  vtkSMPropertyHelper(this, "SelectInputScalars").SetInputArrayToProcess(*found, name.c_str());
  this->UpdateVTKObjects();
  return true;
}

int vtkSMVDIGeneratorProxy::ComponentsOf(const std::string& name, int association) {
  if (this->OfRanks) return this->OfRanks->Components;
  vtkPVDataInformation* data = this->InputInformation();
  vtkPVArrayInformation* array =
      data != nullptr ? data->GetArrayInformation(name.c_str(), association) : nullptr;
  return array != nullptr ? array->GetNumberOfComponents() : 0;
}

void vtkSMVDIGeneratorProxy::Forget() {
  this->Taken = false;
  this->Chosen.clear();
}

void vtkSMVDIGeneratorProxy::TakeFromView() {
  if (this->Taken) return;
  this->Taken = true;
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  vtkSMRenderViewProxy* view = this->ViewToTakeFrom();
  if (view == nullptr) return;
  const bool hasCamera = vtkSMPropertyHelper(this, "CameraPosition").GetDoubleArray() !=
                         vtkSMPropertyHelper(this, "CameraFocalPoint").GetDoubleArray();
  vtkSMPropertyHelper resolution(this, "Resolution");
  const bool hasSize = resolution.GetAsInt(0) != 0 || resolution.GetAsInt(1) != 0;
  // A script that sets both describes the whole VDI. Saved Python states set both, and leave out default
  // values.
  if (!hasCamera || !hasSize || this->HasViewpointOfView) {
    pv::takeShading(this, shown, view);
    pv::takeCropping(this, shown,
                     this->OfRanks ? this->OfRanks->Whole : pv::wholeToCrop(this->InputInformation()));
    pv::takeBlending(this, shown);
    pv::takeInterpolation(this, shown);
    const Subject subject = this->CurrentSubject();
    vtkSMPropertyHelper component(this, "Component");
    if (component.GetAsInt() == vdi::magnitude && pv::takesComponentsTogether(shown) &&
        vdi::componentIssue(vdi::together, this->ComponentsOf(subject.Array, subject.Association)).empty())
      component.Set(vdi::together);
    this->TakeUnitDistance();
    const std::string issues = pv::displayIssues(shown, component.GetAsInt() == vdi::together);
    if (!issues.empty()) vtkWarningMacro(<< issues);
  }
  if (!hasCamera && pv::isPlaced(view)) SetCamera(this, view);
  if (!hasSize) {
    const std::array<int, 2> size = pv::resolutionOf(view);
    resolution.Set(size.data(), 2);
  }
  this->UpdateVTKObjects();
}

/// Takes the unit distance of the volume in the active view, or 0 if there is none, unless a user has set it.
void vtkSMVDIGeneratorProxy::TakeUnitDistance() {
  vtkSMPropertyHelper unit(this, "ScalarOpacityUnitDistance");
  const double set = unit.GetAsDouble();
  if (set != 0.0 && this->TakenUnitDistance != set) return;
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  double taken = 0.0;
  if (shown != nullptr && shown->GetProperty("ScalarOpacityUnitDistance") != nullptr)
    taken = vtkSMPropertyHelper(shown, "ScalarOpacityUnitDistance").GetAsDouble();
  // VTK's mapper takes that of the last component (vtkVolumeInputHelper), which ParaView never sets.
  if (taken != 0.0 && pv::takesComponentsTogether(shown) &&
      vtkSMPropertyHelper(this, "Component").GetAsInt() == vdi::together)
    taken = 1.0;
  unit.Set(taken);
  this->TakenUnitDistance = taken;
}

void vtkSMVDIGeneratorProxy::SetCamera(vtkSMProxy* proxy, vtkSMRenderViewProxy* view) {
  vtkCamera* camera = view->GetActiveCamera();
  vtkSMPropertyHelper(proxy, "CameraPosition").Set(camera->GetPosition(), 3);
  vtkSMPropertyHelper(proxy, "CameraFocalPoint").Set(camera->GetFocalPoint(), 3);
  vtkSMPropertyHelper(proxy, "CameraViewUp").Set(camera->GetViewUp(), 3);
  vtkSMPropertyHelper(proxy, "CameraViewAngle").Set(camera->GetViewAngle());
  vtkSMPropertyHelper(proxy, "CameraParallelProjection").Set(camera->GetParallelProjection());
  vtkSMPropertyHelper(proxy, "CameraParallelScale").Set(camera->GetParallelScale());
}

std::string vtkSMVDIGeneratorProxy::WhyNot(vtkSMViewProxy* view) {
  vtkSMRenderViewProxy* renderView = RenderViewOf(view);
  if (renderView == nullptr)
    return "The active view has no camera. Click into a 3-D view (Render View) first.";
  constexpr int planar = 1;  // vtkPVRenderView::INTERACTION_MODE_2D
  if (vtkSMPropertyHelper(renderView, "InteractionMode", true).GetAsInt() == planar)
    return "The active view is in 2-D mode. Click into a 3-D view that shows the volume, or on the view's 2D "
           "button.";
  return {};
}

vtkPVDataInformation* vtkSMVDIGeneratorProxy::InputInformation(bool overTime) {
  const vtkSMPropertyHelper input(this, "Input");
  auto* source = vtkSMSourceProxy::SafeDownCast(input.GetAsProxy());
  if (source == nullptr) return nullptr;
  if (!overTime) return source->GetDataInformation(input.GetOutputPort());
  vtkSMOutputPort* port = source->GetOutputPort(input.GetOutputPort());
  return port != nullptr ? port->GetTemporalDataInformation() : nullptr;
}

vtkPVArrayInformation* vtkSMVDIGeneratorProxy::InputArray(bool overTime) {
  const Subject now = this->CurrentSubject();
  vtkPVDataInformation* data = this->InputInformation(overTime);
  return data != nullptr ? data->GetArrayInformation(now.Array.c_str(), now.Association) : nullptr;
}

vdi::Box vtkSMVDIGeneratorProxy::ShownBounds() {
  vtkPVDataInformation* data = this->InputInformation();
  if (data == nullptr) return {};
  const auto box = [](const double* b) { return vdi::Box{{b[0], b[2], b[4]}, {b[1], b[3], b[5]}}; };
  double bounds[6];
  data->GetBounds(bounds);
  const vdi::Box whole = box(bounds);
  if (vtkSMPropertyHelper(this, "Cropping").GetAsInt() == 0) return whole;
  const std::vector<double> set = vtkSMPropertyHelper(this, "CroppingBox").GetDoubleArray();
  if (!isSet(set)) return whole;
  const vdi::Box cropped = whole.intersection(box(set.data()));
  return cropped.empty() ? whole : cropped;
}

void vtkSMVDIGeneratorProxy::BeginCropping() {
  if (vtkSMUncheckedPropertyHelper(this, "Cropping").GetAsInt() == 0 ||
      isSet(vtkSMUncheckedPropertyHelper(this, "CroppingBox").GetDoubleArray()))
    return;
  vtkPVDataInformation* data = this->InputInformation();
  if (data == nullptr) return;
  double bounds[6];
  data->GetBounds(bounds);
  if (bounds[0] <= bounds[1]) vtkSMPropertyHelper(this, "CroppingBox").Set(bounds, 6);
}

double vtkSMVDIGeneratorProxy::DegreesFrom(vtkSMRenderViewProxy* view) {
  const auto vector = [this](const char* name) {
    const std::vector<double> v = vtkSMPropertyHelper(this, name).GetDoubleArray();
    return glm::dvec3(v[0], v[1], v[2]);
  };
  const vdi::Camera own{
      .position = vector("CameraPosition"),
      .focalPoint = vector("CameraFocalPoint"),
      .viewUp = vector("CameraViewUp"),
      .parallelProjection = vtkSMPropertyHelper(this, "CameraParallelProjection").GetAsInt() != 0};
  return vdi::degreesBetween(this->ShownBounds(), own, pv::cameraOf(view->GetActiveCamera()));
}

std::string vtkSMVDIGeneratorProxy::WhyNotFrom(vtkSMViewProxy* view) {
  if (std::string why = WhyNot(view); !why.empty()) return why;
  vtkSMRenderViewProxy* renderView = RenderViewOf(view);
  const std::array<int, 2> size = pv::resolutionOf(renderView);
  try {
    const vdi::View seen(pv::cameraOf(renderView->GetActiveCamera()), size[0], size[1]);
    const auto issue = vdi::viewpointIssue(this->ShownBounds(), seen, seen);
    if (issue == vdi::ViewpointIssue::SeesNothing)
      return "This view doesn't see the volume, which lies behind its camera or beside its picture.";
  } catch (const vdi::Error& error) {
    return error.what();
  }
  return {};
}

std::string vtkSMVDIGeneratorProxy::SetViewpoint(vtkSMViewProxy* view) {
  if (std::string why = this->WhyNotFrom(view); !why.empty()) return why;
  vtkSMRenderViewProxy* renderView = RenderViewOf(view);
  const std::array<int, 2> size = pv::resolutionOf(renderView);
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "the view's camera");
  SetCamera(this, renderView);
  pv::takeLights(this, renderView);
  vtkSMPropertyHelper(this, "Resolution").Set(size.data(), 2);
  this->HasViewpointOfView = true;
  this->UpdateVTKObjects();
  return {};
}

std::optional<vdi::VdiEstimate> vtkSMVDIGeneratorProxy::EstimateToCome() {
  const auto number = [this](const char* name, unsigned int i = 0) {
    return vtkSMUncheckedPropertyHelper(this, name).GetAsDouble(i);
  };
  if (number("PictureOnly") != 0.0) return std::nullopt;
  vdi::GenerateSettings settings;  // has the size of a filter that takes nothing from a view
  const int width = static_cast<int>(number("Resolution", 0));
  const int height = static_cast<int>(number("Resolution", 1));
  vtkSMRenderViewProxy* view = this->Taken ? nullptr : this->ViewToTakeFrom();
  if (width > 0 || height > 0) {
    settings.width = width;
    settings.height = height;
  } else if (view != nullptr) {
    const std::array<int, 2> size = pv::resolutionOf(view);
    settings.width = size[0];
    settings.height = size[1];
  }
  for (const vdi::Setting& setting : vdi::settingsTable()) setting.put(settings, number(setting.property));
  pv::LastVdiNumbers last{};
  vtkSMPropertyHelper(pv::asked(this, "LastVdi")).Get(last.data(), static_cast<unsigned int>(last.size()));
  return vdi::estimateOf(settings, pv::lastVdiOf(last));
}

void vtkSMVDIGeneratorProxy::PrepareUpstream(vtkSMProxy* proxy, std::optional<double> time) {
  if (proxy == nullptr) return;
  for (unsigned int i = 0; i < proxy->GetNumberOfProducers(); ++i) {
    vtkSMProxy* producer = proxy->GetProducerProxy(i);
    if (vtkSMSourceProxy::SafeDownCast(producer) == nullptr) continue;  // skips maps and the like
    PrepareUpstream(producer, time);
    if (auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(producer)) {
      generator->TakeWhatIsNotSet(time);
      generator->ReleaseNow();
    }
  }
}

bool vtkSMVDIGeneratorProxy::IsOutdated() {
  return vtkSMPropertyHelper(pv::asked(this, "Outdated")).GetAsInt() != 0;
}

void vtkSMVDIGeneratorProxy::ReleaseNow() {
  if (vtkSMPropertyHelper(pv::asked(this, "Held")).GetAsInt() == 0 && !this->IsOutdated()) return;
  pv::command(this, "Release");
  this->MarkDirty(this);
}

bool vtkSMVDIGeneratorProxy::RangeOfScalars(const char* name, int association, std::optional<double> time,
                                            double range[2]) {
  if (this->OfRanks) {
    std::ranges::copy(this->OfRanks->Range, range);
    return range[0] <= range[1];
  }
  range[0] = std::numeric_limits<double>::infinity();
  range[1] = -std::numeric_limits<double>::infinity();
  vtkSMPropertyHelper input(this, "Input");
  if (auto* source = vtkSMSourceProxy::SafeDownCast(input.GetAsProxy())) {
    if (time) {
      source->UpdatePipeline(*time);
    } else {
      source->UpdatePipeline();
    }
    vtkPVDataInformation* data = source->GetDataInformation(input.GetOutputPort());
    if (vtkPVArrayInformation* array = data->GetArrayInformation(name, association)) {
      // The range is that of the filter's component. The filter reports a component that doesn't exist.
      const int wanted = vtkSMPropertyHelper(this, "Component").GetAsInt();
      const int components = array->GetNumberOfComponents();
      if (wanted == vdi::phase && components == 2) {
        range[0] = -std::numbers::pi;
        range[1] = std::numbers::pi;
      } else {
        const int named = vdi::legendComponent(wanted, components);
        const int component = components == 1 ? 0 : std::clamp(named, -1, components - 1);
        array->GetComponentFiniteRange(component, range);
      }
    }
  }
  return range[0] <= range[1];
}
