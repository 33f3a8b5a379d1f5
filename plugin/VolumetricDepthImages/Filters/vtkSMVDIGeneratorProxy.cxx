#include "vtkSMVDIGeneratorProxy.h"

#include <vtkCamera.h>
#include <vtkClientServerStream.h>
#include <vtkCommand.h>
#include <vtkCommunicator.h>
#include <vtkDataObject.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkProcessModule.h>
#include <vtkSMComparativeViewProxy.h>
#include <vtkSMCoreUtilities.h>
#include <vtkSMInputProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMProxyIterator.h>
#include <vtkSMProxySelectionModel.h>
#include <vtkSMRenderViewProxy.h>
#include <vtkSMRepresentationProxy.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMTrace.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionPresets.h>
#include <vtkSMTransferFunctionProxy.h>
#include <vtkSMUncheckedPropertyHelper.h>
#include <vtkScalarsToColors.h>
#include <vtkSmartPointer.h>
#include <vtk_jsoncpp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "VDILastVdi.h"
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

/// A function's control points: `values` numbers each, the first of them its place.
struct ControlPoints {
  std::vector<double> numbers;
  std::size_t values = 4;

  std::size_t size() const { return numbers.size() / values; }
  double place(std::size_t i) const { return numbers[i * values]; }

  /// Whether the points are those of `preset`, whose first and last places are moved to 0 and 1.
  bool isNormalized(const Json::Value& preset) const {
    if (preset.size() != numbers.size() || size() < 2 || place(0) != 0.0 || place(size() - 1) != 1.0)
      return false;
    const auto of = [&](std::size_t i) { return preset[static_cast<Json::ArrayIndex>(i)].asDouble(); };
    const double first = of(0);
    const double length = of((size() - 1) * values) - first;
    constexpr double tolerance = 1e-5;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const double expected = i % values == 0 ? (of(i) - first) / length : of(i);
      if (std::abs(numbers[i] - expected) > tolerance) return false;
    }
    return true;
  }
};

/// Whether a user has set the control points of a colour map (`RGBPoints`) or opacity function (`Points`).
/// Otherwise they are ParaView's own, or those of a preset on [0, 1], which wait for a range.
bool IsSetExplicitly(vtkSMProxy* function, const char* property) {
  vtkSMProperty* points = function->GetProperty(property);
  if (points == nullptr || points->IsValueDefault()) return false;
  const ControlPoints own{vtkSMPropertyHelper(points).GetDoubleArray()};
  auto* presets = vtkSMTransferFunctionPresets::GetInstance();
  for (unsigned int i = 0; i < presets->GetNumberOfPresets(); ++i) {
    const Json::Value& preset = presets->GetPreset(i)[property];
    if (preset.isArray() && own.isNormalized(preset)) return false;
  }
  return true;
}

/// Whether a function has no range yet. If a user has set its points, this marks the range as initialized, so
/// that ParaView's own views leave the function alone, too.
bool WaitsForRange(vtkSMProxy* function, const char* property) {
  vtkSMPropertyHelper initialized(function, "ScalarRangeInitialized", true);
  if (initialized.GetAsInt() != 0) return false;
  if (!IsSetExplicitly(function, property)) return true;
  initialized.Set(1);
  function->UpdateVTKObjects();
  return false;
}

/// Sets a flag for the lifetime of this object.
class Set {
 public:
  explicit Set(bool& flag) : Flag(flag) { this->Flag = true; }
  ~Set() { this->Flag = false; }
  Set(const Set&) = delete;
  Set& operator=(const Set&) = delete;

 private:
  bool& Flag;
};

/// The ranks if each has a client of its own (pvbatch --symmetric, Catalyst), which knows its own data only;
/// null otherwise.
vtkMultiProcessController* ranksWithClients() {
  if (!vtkProcessModule::GetProcessModule()->GetSymmetricMPIMode()) return nullptr;
  return vtkMultiProcessController::GetGlobalController();
}

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

vdi::Camera cameraOf(vtkCamera* camera) {
  const auto vector = [](const double* v) { return glm::dvec3(v[0], v[1], v[2]); };
  return {vector(camera->GetPosition()), vector(camera->GetFocalPoint()),      vector(camera->GetViewUp()),
          camera->GetViewAngle(),        camera->GetParallelProjection() != 0, camera->GetParallelScale()};
}

/// Whether a user has placed the view's camera: it isn't where new views have it.
bool isPlaced(vtkSMRenderViewProxy* view) {
  vtkSMProxy* initial =
      view->GetSessionProxyManager()->GetPrototypeProxy(view->GetXMLGroup(), view->GetXMLName());
  const auto isInitial = [initial](const char* property, const double* now) {
    return vtkSMPropertyHelper(initial, property).GetDoubleArray() == std::vector<double>(now, now + 3);
  };
  vtkCamera* camera = view->GetActiveCamera();
  return !isInitial("CameraPosition", camera->GetPosition()) ||
         !isInitial("CameraFocalPoint", camera->GetFocalPoint());
}

/// The view's size, reduced to at most as many pixels as 1920 x 1080 has, because a VDI's time and size grow
/// with them.
std::array<int, 2> resolutionOf(vtkSMViewProxy* view) {
  constexpr double maximum = 1920.0 * 1080.0;
  const vtkSMPropertyHelper size(view, "ViewSize");
  const double width = std::max(size.GetAsInt(0), 1);
  const double height = std::max(size.GetAsInt(1), 1);
  const double scale = std::min(1.0, std::sqrt(maximum / (width * height)));
  const auto scaled = [scale](double length) {
    return std::max(1, static_cast<int>(std::lround(scale * length)));
  };
  return {scaled(width), scaled(height)};
}

/// The component that a map's legends name.
int componentNamedBy(vtkSMProxy* map) {
  if (map->GetProperty("VectorMode") == nullptr) return vdi::magnitude;
  const bool isOne = vtkSMPropertyHelper(map, "VectorMode").GetAsInt() == vtkScalarsToColors::COMPONENT;
  return isOne ? vtkSMPropertyHelper(map, "VectorComponent").GetAsInt() : vdi::magnitude;
}

/// Whether ParaView may fit the map to the data.
bool mayRescale(vtkSMProxy* map) {
  return vtkSMPropertyHelper(map, "AutomaticRescaleRangeMode", true).GetAsInt() !=
         vtkSMTransferFunctionManager::NEVER;
}

/// The proxy in that property; null if there is none.
vtkSMProxy* proxyIn(vtkSMProxy* owner, const char* property) {
  const vtkSMPropertyHelper helper(owner, property, true);
  return helper.GetNumberOfElements() > 0 ? helper.GetAsProxy() : nullptr;
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

void vtkSMVDIGeneratorProxy::UpdatePipeline() {
  if (!EnterUpdate(this)) return;
  this->TakeWhatIsNotSet(std::nullopt);
  const bool isForView = this->UpdatesForView;
  // After a view got an earlier output, the proxy counts as updated, and the superclass would do nothing.
  if (!isForView && this->IsOutdated()) this->MarkDirty(this);
  if (isForView) this->InvokeCommand("BeginView");
  this->Superclass::UpdatePipeline();
  if (isForView) this->InvokeCommand("EndView");
}

void vtkSMVDIGeneratorProxy::UpdatePipeline(double time) {
  if (!EnterUpdate(this)) return;
  this->TakeWhatIsNotSet(time);
  const bool isForView = this->UpdatesForView;
  if (isForView) this->InvokeCommand("BeginView");
  this->Superclass::UpdatePipeline(time);
  if (isForView) this->InvokeCommand("EndView");
}

void vtkSMVDIGeneratorProxy::UpdateVTKObjects() {
  this->Superclass::UpdateVTKObjects();
  this->WatchMap();
  // Where each rank has a client, only some of their scripts may set this property. The ranks meet in the
  // next update, or when a view is drawn.
  if (this->Taken && !this->Choosing && ranksWithClients() == nullptr) this->FollowArray();
}

int vtkSMVDIGeneratorProxy::LoadXMLState(vtkPVXMLElement* element, vtkSMProxyLocator* locator) {
  this->Taken = true;
  return this->Superclass::LoadXMLState(element, locator);
}

void vtkSMVDIGeneratorProxy::LoadState(const vtkSMMessage* state, vtkSMProxyLocator* locator) {
  this->Superclass::LoadState(state, locator);
  // The first update sets the map. Forget follows the undo of that update.
  const vtkSMPropertyHelper table(this, "LookupTable");
  if (table.GetNumberOfElements() > 0 && table.GetAsProxy() != nullptr) this->Taken = true;
}

void vtkSMVDIGeneratorProxy::TakeWhatIsNotSet(std::optional<double> time) {
  if (vtkMultiProcessController* ranks = ranksWithClients()) {
    this->WatchViews();
    if (!this->MeetRanks(ranks, time)) return;
    if (this->Taken) this->FollowArray();
    if (std::exchange(this->FollowsMap, false)) this->FollowMap();
  }
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "what the view shows");
  this->TakeFromView();
  const Set choosing(this->Choosing);
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
    this->InvokeCommand("Renew");
    this->MarkDirty(this);
  }
  return isSame && (all[New] == 0.0 || this->GatherInput(ranks, now, time));
}

bool vtkSMVDIGeneratorProxy::GatherInput(vtkMultiProcessController* ranks, const Subject& subject,
                                         std::optional<double> time) {
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

/// Lets map, component and unit distance follow the array and the input after the first update.
void vtkSMVDIGeneratorProxy::FollowArray() {
  Subject now = this->CurrentSubject();
  if (!this->Shown) this->Shown = now;  // after a state file was loaded
  if (now == *this->Shown || now.Input == nullptr) return;
  const Set choosing(this->Choosing);
  // The panel blanks the array of a filter that a script made before its input had data. The filter keeps its
  // array.
  if (now.Array.empty() && !this->Shown->Array.empty()) {
    now.Array = this->Shown->Array;
    now.Association = this->Shown->Association;
    vtkSMPropertyHelper(this, "SelectInputScalars")
        .SetInputArrayToProcess(now.Association, now.Array.c_str());
    this->Superclass::UpdateVTKObjects();
    if (now == *this->Shown) return;
  }
  const Subject before = std::exchange(*this->Shown, now);
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "the array's map and settings");
  if (now.Input != before.Input || now.Port != before.Port) this->TakeUnitDistance();
  // A component that the new array lacks belonged to the old one.
  if (now.Array != before.Array && now.Component == before.Component && now.Component > 0 &&
      now.Component >= this->ComponentsOf(now.Array, now.Association)) {
    vtkSMPropertyHelper(this, "Component").Set(-1);
    this->Shown->Component = -1;
  }
  if (this->HasMapOf(before.Array)) {
    vtkSMPropertyHelper(this, "LookupTable").RemoveAllValues();
    this->Chosen.clear();  // if the range is unknown, the next update chooses the map
    this->ChooseLookupTable(std::nullopt, &before);
  }
  this->Superclass::UpdateVTKObjects();
  this->WatchMap();
  double range[2];
  vtkSMProxy* map = proxyIn(this, "LookupTable");
  if (map != nullptr && now.Array == before.Array && now.Component != before.Component &&
      this->RangeOfScalars(now.Array.c_str(), now.Association, std::nullopt, range))
    this->AnnounceComponent(map, range);
}

void vtkSMVDIGeneratorProxy::WatchMap() {
  vtkSMProxy* map = proxyIn(this, "LookupTable");
  if (map == this->WatchedMap) return;
  if (this->WatchedMap != nullptr) this->WatchedMap->RemoveObserver(this->MapObserver);
  this->WatchedMap = map;
  if (map == nullptr) return;
  this->NamedComponent = componentNamedBy(map);
  this->MapObserver = map->AddObserver(vtkCommand::UpdateEvent, this, &vtkSMVDIGeneratorProxy::MapUpdated);
}

void vtkSMVDIGeneratorProxy::MapUpdated() {
  const int named = componentNamedBy(this->WatchedMap);
  if (std::exchange(this->NamedComponent, named) == named || this->Choosing || !this->Taken) return;
  if (ranksWithClients() != nullptr) {
    this->FollowsMap = true;  // the number of components is known once the ranks have met
  } else {
    this->FollowMap();
  }
}

void vtkSMVDIGeneratorProxy::FollowMap() {
  const Subject before = this->CurrentSubject();
  const int components = this->ComponentsOf(before.Array, before.Association);
  if (components < 2 || this->NamedComponent >= components || this->NamedComponent == before.Component)
    return;
  const Set choosing(this->Choosing);
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "the component that the map names");
  vtkSMPropertyHelper(this, "Component").Set(this->NamedComponent);
  this->Superclass::UpdateVTKObjects();
  this->Shown = this->CurrentSubject();
  double range[2];
  vtkSMProxy* map = this->WatchedMap;
  const bool hasRange = this->RangeOfScalars(before.Array.c_str(), before.Association, std::nullopt, range);
  if (hasRange && mayRescale(map)) {
    vtkSMProxy* opacity = proxyIn(this, "ScalarOpacityFunction");
    if (opacity == nullptr) opacity = proxyIn(map, "ScalarOpacityFunction");
    vtkSMTransferFunctionProxy::RescaleTransferFunction(map, range[0], range[1]);
    if (opacity != nullptr) vtkSMTransferFunctionProxy::RescaleTransferFunction(opacity, range[0], range[1]);
  }
  if (hasRange) this->AnnounceComponent(map, range);
  // The window holds a filter whose map changes, and would make a VDI of the old component with the new map.
  this->InvokeCommand("Release");
  this->MarkDirty(this);
}

void vtkSMVDIGeneratorProxy::AnnounceComponent(vtkSMProxy* map, const double range[2]) {
  const Subject now = this->CurrentSubject();
  vtkClientServerStream stream;
  stream << vtkClientServerStream::Invoke << VTKOBJECT(this) << "AnnounceRange" << now.Array.c_str()
         << this->ComponentsOf(now.Array, now.Association) << now.Component << range[0] << range[1]
         << vtkClientServerStream::End;
  this->ExecuteStream(stream);
  this->InvalidateDataInformation();
  // Legends of the phase name no component.
  vtkPVArrayInformation* array =
      this->GetDataInformation(0)->GetArrayInformation(now.Array.c_str(), vtkDataObject::FIELD);
  if (array != nullptr) vtkSMTransferFunctionProxy::UpdateScalarBarsComponentTitle(map, array);
}

bool vtkSMVDIGeneratorProxy::HasMapOf(const std::string& name) {
  const vtkSMPropertyHelper table(this, "LookupTable");
  vtkSMProxy* map = table.GetNumberOfElements() > 0 ? table.GetAsProxy() : nullptr;
  if (map == nullptr) return false;
  if (map == this->ChosenMap) return true;
  // The map may come from a state file. ParaView removes spaces and similar characters from maps' names.
  const char* registered = this->GetSessionProxyManager()->GetProxyName("lookup_tables", map);
  return registered != nullptr && !name.empty() &&
         std::string_view(registered).starts_with(vtkSMCoreUtilities::SanitizeName(name) + ".");
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
  return this->RepresentationIn(this->ActiveView()) != nullptr || isPlaced(view) ? view : nullptr;
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
  if (map == nullptr || this->ComponentsOf(name, association) < 2) return;
  const bool byComponent = vtkSMPropertyHelper(map, "VectorMode").GetAsInt() == vtkScalarsToColors::COMPONENT;
  vtkSMPropertyHelper(this, "Component")
      .Set(byComponent ? vtkSMPropertyHelper(map, "VectorComponent").GetAsInt() : -1);
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
    this->TakeUnitDistance();
    pv::takeShading(this, shown, view);
    pv::takeCropping(this, shown,
                     this->OfRanks ? this->OfRanks->Whole : pv::wholeToCrop(this->InputInformation()));
    pv::takeBlending(this, shown);
    if (const std::string issues = pv::displayIssues(shown); !issues.empty()) vtkWarningMacro(<< issues);
  }
  if (!hasCamera && isPlaced(view)) SetCamera(this, view);
  if (!hasSize) {
    const std::array<int, 2> size = resolutionOf(view);
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

vtkPVDataInformation* vtkSMVDIGeneratorProxy::InputInformation() {
  const vtkSMPropertyHelper input(this, "Input");
  auto* source = vtkSMSourceProxy::SafeDownCast(input.GetAsProxy());
  return source != nullptr ? source->GetDataInformation(input.GetOutputPort()) : nullptr;
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
  return vdi::degreesBetween(this->ShownBounds(), own, cameraOf(view->GetActiveCamera()));
}

std::string vtkSMVDIGeneratorProxy::WhyNotFrom(vtkSMViewProxy* view) {
  if (std::string why = WhyNot(view); !why.empty()) return why;
  vtkSMRenderViewProxy* renderView = RenderViewOf(view);
  const std::array<int, 2> size = resolutionOf(renderView);
  try {
    const vdi::View seen(cameraOf(renderView->GetActiveCamera()), size[0], size[1]);
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
  const std::array<int, 2> size = resolutionOf(renderView);
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
    const std::array<int, 2> size = resolutionOf(view);
    settings.width = size[0];
    settings.height = size[1];
  }
  for (const vdi::Setting& setting : vdi::settingsTable()) setting.put(settings, number(setting.property));
  this->UpdatePropertyInformation(this->GetProperty("LastVdi"));
  pv::LastVdiNumbers last{};
  vtkSMPropertyHelper(this, "LastVdi").Get(last.data(), static_cast<unsigned int>(last.size()));
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
  this->UpdatePropertyInformation(this->GetProperty("Outdated"));
  return vtkSMPropertyHelper(this, "Outdated").GetAsInt() != 0;
}

void vtkSMVDIGeneratorProxy::ReleaseNow() {
  this->UpdatePropertyInformation(this->GetProperty("Held"));
  if (vtkSMPropertyHelper(this, "Held").GetAsInt() == 0 && !this->IsOutdated()) return;
  this->InvokeCommand("Release");
  this->MarkDirty(this);
}

bool vtkSMVDIGeneratorProxy::LacksLookupTable() {
  const vtkSMPropertyHelper table(this, "LookupTable");
  const bool isSet = table.GetNumberOfElements() > 0 && table.GetAsProxy() != nullptr;
  return !isSet && this->Chosen.empty();
}

void vtkSMVDIGeneratorProxy::ChooseLookupTable(std::optional<double> time, const Subject* before) {
  vtkSMPropertyHelper table(this, "LookupTable");
  vtkSMPropertyHelper scalars(this, "SelectInputScalars");
  const char* name = scalars.GetNumberOfElements() > 4 ? scalars.GetAsString(4) : nullptr;
  const bool wanted = before != nullptr || this->LacksLookupTable();
  if (!wanted || name == nullptr || *name == '\0') return;
  vtkNew<vtkSMTransferFunctionManager> manager;
  vtkSMProxy* map = this->MapInView(name, scalars.GetAsInt(3));
  if (map == nullptr) map = manager->GetColorTransferFunction(name, this->GetSessionProxyManager());
  if (map == nullptr) return;
  vtkSMProxy* opacity = vtkSMPropertyHelper(map, "ScalarOpacityFunction", true).GetAsProxy();
  if (opacity == nullptr) opacity = manager->GetOpacityTransferFunction(name, this->GetSessionProxyManager());
  const bool another = this->NameComponent(map, name, scalars.GetAsInt(3), before) && before != nullptr;
  // A function that has not been used yet is still on [0, 1]. It gets the array's range, as in a
  // representation.
  const bool mapWaits = WaitsForRange(map, "RGBPoints") || another;
  const bool opacityWaits = opacity != nullptr && (WaitsForRange(opacity, "Points") || another);
  if (mapWaits || opacityWaits) {
    double range[2];
    if (!this->RangeOfScalars(name, scalars.GetAsInt(3), time, range)) return;  // there are no data yet
    if (mapWaits) vtkSMTransferFunctionProxy::RescaleTransferFunction(map, range[0], range[1]);
    if (opacityWaits) vtkSMTransferFunctionProxy::RescaleTransferFunction(opacity, range[0], range[1]);
  }
  table.Set(map);
  this->UpdateVTKObjects();
  this->Chosen = name;
  this->ChosenMap = map;
}

/// Makes the map's legends name the component, unless the view shows the input by this map. Maps have no name
/// for the phase, and take it for the magnitude. Returns true if the component has changed and the map may be
/// rescaled: then it gets the component's range, as when ParaView itself chooses a component.
bool vtkSMVDIGeneratorProxy::NameComponent(vtkSMProxy* map, const std::string& name, int association,
                                           const Subject* before) {
  const int component = vtkSMPropertyHelper(this, "Component").GetAsInt();
  if (this->ComponentsOf(name, association) < 2 || map->GetProperty("VectorMode") == nullptr) return false;
  vtkSMPropertyHelper mode(map, "VectorMode");
  vtkSMPropertyHelper number(map, "VectorComponent");
  const bool isMagnitude = mode.GetAsInt() != vtkScalarsToColors::COMPONENT;
  const bool isNamed = component < 0 ? isMagnitude : !isMagnitude && number.GetAsInt() == component;
  const bool wasPhase = before != nullptr && before->Component == vdi::phase;
  if (isNamed && (before == nullptr || wasPhase == (component == vdi::phase))) return false;
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  if (this->MapInView(name, association) == map && vtkSMPropertyHelper(shown, "Visibility").GetAsInt() != 0)
    return false;
  mode.Set(component < 0 ? vtkScalarsToColors::MAGNITUDE : vtkScalarsToColors::COMPONENT);
  if (component >= 0) number.Set(component);
  map->UpdateVTKObjects();
  return mayRescale(map);
}

vtkSMProxy* vtkSMVDIGeneratorProxy::MapInView(const std::string& name, int association) {
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  if (shown == nullptr || shown->GetProperty("ColorArrayName") == nullptr) return nullptr;
  const vtkSMPropertyHelper colored(shown, "ColorArrayName");
  const char* by = colored.GetInputArrayNameToProcess();
  if (by == nullptr || name != by || association != colored.GetInputArrayAssociation()) return nullptr;
  return vtkSMPropertyHelper(shown, "LookupTable", true).GetAsProxy();
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
        const int component = components == 1 ? 0 : std::clamp(wanted, -1, components - 1);
        array->GetComponentFiniteRange(component, range);
      }
    }
  }
  return range[0] <= range[1];
}
