#include "vtkSMVDIRepresentationProxy.h"

#include <vtkDataObject.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkSMCoreUtilities.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionProxy.h>
#include <vtkScalarsToColors.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "VDIMaps.h"
#include "VDIServer.h"
#include "vdi/core/ComponentValues.h"
#include "vdi/core/Error.h"
#include "vdi/io/Metadata.h"
#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIRepresentationProxy);

namespace {

constexpr std::string_view ownType = "VDI";

/// Gives the maps the file's nodes, in RGB, and keeps ParaView from moving them.
void setMaps(vtkSMProxy* colors, vtkSMProxy* opacities, const vdi::Coloring& coloring) {
  std::vector<double> points;
  for (const vdi::ColorNode& node : coloring.function.colors)
    points.insert(points.end(), {node.x, node.color.r, node.color.g, node.color.b});
  vtkSMPropertyHelper(colors, "ColorSpace").Set("RGB");
  vtkSMPropertyHelper(colors, "Discretize").Set(0);
  vtkSMPropertyHelper(colors, "RGBPoints").Set(points.data(), static_cast<unsigned int>(points.size()));
  points.clear();
  constexpr double midpoint = 0.5;
  for (const vdi::OpacityNode& node : coloring.function.opacities)
    points.insert(points.end(), {node.x, node.opacity, midpoint, 0.0});
  vtkSMPropertyHelper(opacities, "Points").Set(points.data(), static_cast<unsigned int>(points.size()));
  const bool isComponent = coloring.array.components > 1 && coloring.array.component >= 0;
  vtkSMPropertyHelper(colors, "VectorMode")
      .Set(isComponent ? vtkScalarsToColors::COMPONENT : vtkScalarsToColors::MAGNITUDE);
  if (isComponent) vtkSMPropertyHelper(colors, "VectorComponent").Set(coloring.array.component);
  vtkSMPropertyHelper(colors, "AutomaticRescaleRangeMode").Set(vtkSMTransferFunctionManager::NEVER);
  vtkSMPropertyHelper(colors, "ScalarOpacityFunction").Set(opacities);
  for (vtkSMProxy* map : {colors, opacities}) {
    vtkSMPropertyHelper(map, "ScalarRangeInitialized", true).Set(1);
    map->UpdateVTKObjects();
  }
}

}  // namespace

vtkSMVDIRepresentationProxy::vtkSMVDIRepresentationProxy() = default;
vtkSMVDIRepresentationProxy::~vtkSMVDIRepresentationProxy() = default;

bool vtkSMVDIRepresentationProxy::SetRepresentationType(const char* type) {
  const bool isOwn = type != nullptr && type == ownType;
  if (this->GetUsingScalarColoring()) this->DropLegend();
  // It skips the superclass, which colours slices by an array.
  // NOLINTNEXTLINE(bugprone-parent-virtual-call)
  const bool result = this->vtkSMRepresentationProxy::SetRepresentationType(type);
  if (isOwn) this->TakeLegend(nullptr);
  return result;
}

void vtkSMVDIRepresentationProxy::ViewUpdated(vtkSMProxy* view) {
  const vtkSMVDIGeneratorProxy* generator = this->ShownGenerator();
  const bool waits = generator != nullptr && generator->GetLegendsWait() && this->HasLegend();
  if (!waits && vtkSMPropertyHelper(this, "Representation").GetAsString() == ownType) this->TakeLegend(view);
  // A comparative view copies the representation before its type is set, and links only later changes.
  if (!this->TypeIsLinked) {
    this->TypeIsLinked = true;
    this->GetProperty("Representation")->Modified();
  }
  this->Superclass::ViewUpdated(view);
}

void vtkSMVDIRepresentationProxy::UpdateVTKObjects() {
  this->Superclass::UpdateVTKObjects();
  this->TakeChoice();
}

int vtkSMVDIRepresentationProxy::LoadXMLState(vtkPVXMLElement* element, vtkSMProxyLocator* locator) {
  this->Named.clear();  // a state's filter has the state's array
  return this->Superclass::LoadXMLState(element, locator);
}

void vtkSMVDIRepresentationProxy::LoadState(const vtkSMMessage* state, vtkSMProxyLocator* locator) {
  this->Named.clear();
  this->Superclass::LoadState(state, locator);
}

/// The filter whose VDI is shown; null if it is a file's, or another type is shown.
vtkSMVDIGeneratorProxy* vtkSMVDIRepresentationProxy::ShownGenerator() {
  const char* type = vtkSMPropertyHelper(this, "Representation").GetAsString();
  if (type == nullptr || type != ownType) return nullptr;
  return vtkSMVDIGeneratorProxy::SafeDownCast(pv::proxyIn(this, "Input"));
}

vtkPVDataInformation* vtkSMVDIRepresentationProxy::GetRepresentedDataInformation() {
  vtkSMVDIGeneratorProxy* generator = this->ShownGenerator();
  if (generator == nullptr) return this->Superclass::GetRepresentedDataInformation();
  vtkNew<vtkImageData> named;
  for (const auto& [name, components] : generator->ArraysOfInput()) {
    // ParaView fits the map to the range of a chosen array. NaN has none.
    vtkNew<vtkDoubleArray> array;
    array->SetName(name.c_str());
    array->SetNumberOfComponents(components);
    array->InsertNextTuple(std::vector<double>(static_cast<std::size_t>(components), std::nan("")).data());
    named->GetFieldData()->AddArray(array);
  }
  this->ArraysOfInput->Initialize();
  this->ArraysOfInput->CopyFromObject(named);
  return this->ArraysOfInput;
}

/// Gives the filter the array that a user has chosen, or a script. The maps stay those of the shown VDI.
void vtkSMVDIRepresentationProxy::TakeChoice() {
  const vtkSMPropertyHelper array(this, "ColorArrayName");
  const char* name = array.GetInputArrayNameToProcess();
  if (name == nullptr || *name == '\0' || this->Named == name) return;
  const bool isChoice = !std::exchange(this->Named, name).empty();
  vtkSMVDIGeneratorProxy* generator = this->ShownGenerator();
  if (!isChoice || generator == nullptr) return;
  if (generator->ChooseArray(name, array.GetInputArrayAssociation()) && this->Colors != nullptr)
    this->SetMaps(this->Colors, this->Opacities);
}

/// Whether the representation has a legend. Only the representation VDI is coloured by field data.
bool vtkSMVDIRepresentationProxy::HasLegend() {
  return this->GetUsingScalarColoring() &&
         vtkSMPropertyHelper(this, "ColorArrayName").GetInputArrayAssociation() == vtkDataObject::FIELD;
}

void vtkSMVDIRepresentationProxy::DropLegend() {
  vtkSMPropertyHelper(this, "ColorArrayName").SetInputArrayToProcess(vtkDataObject::POINT, "");
  vtkSMPropertyHelper(this, "LookupTable").RemoveAllValues();
  vtkSMPropertyHelper(this, "ScalarOpacityFunction", true).RemoveAllValues();
  this->Named.clear();
  this->UpdateVTKObjects();
}

void vtkSMVDIRepresentationProxy::SetMaps(vtkSMProxy* colors, vtkSMProxy* opacities) {
  this->Colors = colors;
  this->Opacities = opacities;
  vtkSMPropertyHelper(this, "LookupTable").Set(colors);
  vtkSMPropertyHelper opacity(this, "ScalarOpacityFunction", true);
  if (opacities != nullptr) {
    opacity.Set(opacities);
  } else {
    opacity.RemoveAllValues();
  }
  this->UpdateVTKObjects();
}

vtkSMVDIRepresentationProxy::Legend vtkSMVDIRepresentationProxy::LegendOfInput() {
  vtkSMProxy* input = pv::proxyIn(this, "Input");
  if (input == nullptr) return {};
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(input);
  if (generator == nullptr) return this->LegendOfFile(input);
  const vtkSMPropertyHelper scalars(input, "SelectInputScalars");
  const char* name = scalars.GetNumberOfElements() > 4 ? scalars.GetAsString(4) : nullptr;
  vtkSMProxy* colors = pv::proxyIn(input, "LookupTable");
  if (name == nullptr || *name == '\0' || colors == nullptr) return {};
  return {name, colors, generator->OpacityFunction()};
}

vtkSMVDIRepresentationProxy::Legend vtkSMVDIRepresentationProxy::LegendOfFile(vtkSMProxy* reader) {
  vtkSMProperty* property = reader->GetProperty("Coloring");
  if (property == nullptr || property->GetInformationOnly() == 0) return {};
  const char* said = vtkSMPropertyHelper(pv::asked(reader, "Coloring")).GetAsString();
  const std::string text = said != nullptr ? said : "";
  if (text.empty()) return {};
  vdi::Coloring coloring;
  try {
    coloring = vdi::io::coloringIn(text);
  } catch (const vdi::Error&) {
    return {};  // from a server of another version
  }
  if (coloring.array.name.empty()) return {};
  // The name that ParaView gives to maps of a single representation.
  const std::string key = std::string("Separate_") + this->GetGlobalIDAsString() + "_" + coloring.array.name;
  vtkNew<vtkSMTransferFunctionManager> manager;
  vtkSMSessionProxyManager* proxies = this->GetSessionProxyManager();
  vtkSMProxy* colors = manager->GetColorTransferFunction(key.c_str(), proxies);
  vtkSMProxy* opacities = manager->GetOpacityTransferFunction(key.c_str(), proxies);
  if (colors == nullptr || opacities == nullptr) return {};
  vtkSMPropertyHelper(this, "UseSeparateColorMap", true).Set(1);
  if (text != this->FileColoring) setMaps(colors, opacities, coloring);
  this->FileColoring = text;
  return {coloring.array.name, colors, opacities};
}

bool vtkSMVDIRepresentationProxy::FollowShown(vtkSMProxy* view) {
  return this->ShownGenerator() != nullptr && this->TakeLegend(view);
}

/// Takes the legend of the input. If the old map has a bar in `view`, the new map's bar replaces it. `view`
/// may be null. Returns whether that has changed the legend.
bool vtkSMVDIRepresentationProxy::TakeLegend(vtkSMProxy* view) {
  const Legend legend = this->LegendOfInput();
  if (legend.Colors == nullptr) {
    if (!this->GetUsingScalarColoring()) return false;
    this->DropLegend();
    return true;
  }
  vtkSMProxy* before = pv::proxyIn(this, "LookupTable");
  vtkSMPropertyHelper array(this, "ColorArrayName");
  const char* name = array.GetInputArrayNameToProcess();
  if (before == legend.Colors && pv::proxyIn(this, "ScalarOpacityFunction") == legend.Opacities &&
      name != nullptr && legend.Array == name && array.GetInputArrayAssociation() == vtkDataObject::FIELD)
    return false;
  // While the next VDI is being made, the view shows the last one, of another array perhaps.
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(pv::proxyIn(this, "Input"));
  if (view != nullptr && generator != nullptr && this->HasLegend() && generator->IsOutdated()) return false;
  const bool hadBar =
      view != nullptr && before != nullptr && vtkSMTransferFunctionProxy::IsScalarBarVisible(before, view);
  array.SetInputArrayToProcess(vtkDataObject::FIELD, legend.Array.c_str());
  this->Named = legend.Array;
  this->SetMaps(legend.Colors, legend.Opacities);
  if (!hadBar || before == legend.Colors) return true;
  vtkNew<vtkSMTransferFunctionManager> manager;
  manager->HideScalarBarIfNotNeeded(before, view);
  this->SetScalarBarVisibility(view, true);
  this->NameComponent(legend.Colors);
  return true;
}

/// Lets the bars of the map name the component of the filter's array. The view may still show a VDI of
/// another array, and ParaView calls the component of an array that it can't find "Magnitude".
void vtkSMVDIRepresentationProxy::NameComponent(vtkSMProxy* colors) {
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(pv::proxyIn(this, "Input"));
  vtkPVArrayInformation* array = generator != nullptr ? generator->InputArray() : nullptr;
  if (array != nullptr) vtkSMTransferFunctionProxy::UpdateScalarBarsComponentTitle(colors, array);
}

bool vtkSMVDIRepresentationProxy::RescaleTransferFunctionToDataRangeOverTime(const char* arrayname,
                                                                             int attribute_type) {
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(pv::proxyIn(this, "Input"));
  if (generator == nullptr || !this->HasLegend())
    return this->Superclass::RescaleTransferFunctionToDataRangeOverTime(arrayname, attribute_type);
  vtkPVArrayInformation* array = generator->InputArray(true);
  if (array == nullptr) return false;
  double range[2] = {-std::numbers::pi, std::numbers::pi};
  const int wanted = vtkSMPropertyHelper(generator, "Component").GetAsInt();
  const int components = array->GetNumberOfComponents();
  // ParaView knows the ranges of the components and of the magnitude. It crashes when it is asked for others.
  if (wanted != vdi::phase || components != 2) {
    if (components > 1 && (wanted < vdi::magnitude || wanted >= components)) return false;
    array->GetComponentFiniteRange(components > 1 ? wanted : 0, range);
  }
  if (!(range[0] <= range[1])) return false;
  vtkSMCoreUtilities::AdjustRange(range);
  vtkSMTransferFunctionProxy::RescaleTransferFunction(pv::proxyIn(this, "LookupTable"), range);
  vtkSMTransferFunctionProxy::RescaleTransferFunction(pv::proxyIn(this, "ScalarOpacityFunction"), range);
  return true;
}

void vtkSMVDIRepresentationProxy::SetPropertyModifiedFlag(const char* name, int flag) {
  // It skips the superclass, which connects the selection.
  // NOLINTNEXTLINE(bugprone-parent-virtual-call)
  this->vtkSMRepresentationProxy::SetPropertyModifiedFlag(name, flag);
}
