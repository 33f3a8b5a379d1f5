// The part of vtkSMVDIGeneratorProxy that chooses the filter's colour map, and keeps map, array and component
// together.
#include <vtkClientServerStream.h>
#include <vtkCommand.h>
#include <vtkDataObject.h>
#include <vtkNew.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkSMCoreUtilities.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMTrace.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionProxy.h>
#include <vtkSMViewProxy.h>
#include <vtkScalarsToColors.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "VDIMaps.h"
#include "VDIServer.h"
#include "vdi/core/ComponentValues.h"
#include "vtkSMVDIGeneratorProxy.h"

/// Lets map, component and unit distance follow the array and the input after the first update.
void vtkSMVDIGeneratorProxy::FollowArray() {
  Subject now = this->CurrentSubject();
  if (!this->Shown) this->Shown = now;  // after a state file was loaded
  if (now == *this->Shown || now.Input == nullptr) return;
  const Raised choosing(this->Choosing);
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
  vtkSMProxy* map = pv::proxyIn(this, "LookupTable");
  if (map != nullptr && now.Array == before.Array && now.Component != before.Component &&
      this->RangeOfScalars(now.Array.c_str(), now.Association, std::nullopt, range))
    this->AnnounceComponent(map, range);
}

void vtkSMVDIGeneratorProxy::WatchMap() {
  vtkSMProxy* map = pv::proxyIn(this, "LookupTable");
  if (map == this->WatchedMap) return;
  if (this->WatchedMap != nullptr) this->WatchedMap->RemoveObserver(this->MapObserver);
  this->WatchedMap = map;
  if (map == nullptr) return;
  this->NamedComponent = pv::componentNamedBy(map);
  this->MapObserver = map->AddObserver(vtkCommand::UpdateEvent, this, &vtkSMVDIGeneratorProxy::MapUpdated);
}

void vtkSMVDIGeneratorProxy::MapUpdated() {
  const int named = pv::componentNamedBy(this->WatchedMap);
  if (std::exchange(this->NamedComponent, named) == named || this->Choosing || !this->Taken ||
      !pv::isConnected(this->GetSession()))
    return;
  if (RanksWithClients() != nullptr) {
    this->FollowsMap = true;  // the number of components is known once the ranks have met
  } else if (this->TakeNamedComponent()) {
    this->FitToComponent();
  }
}

bool vtkSMVDIGeneratorProxy::TakeNamedComponent() {
  const Subject before = this->CurrentSubject();
  const int components = this->ComponentsOf(before.Array, before.Association);
  if (before.Component == vdi::together) return false;  // no map names these
  if (components < 2 || this->NamedComponent >= components || this->NamedComponent == before.Component)
    return false;
  SM_SCOPED_TRACE(PropertiesModified).arg("proxy", this).arg("comment", "the component that the map names");
  vtkSMPropertyHelper(this, "Component").Set(this->NamedComponent);
  this->Superclass::UpdateVTKObjects();
  this->Shown = this->CurrentSubject();
  return true;
}

void vtkSMVDIGeneratorProxy::FitToComponent() {
  const Raised choosing(this->Choosing);
  const Subject now = this->CurrentSubject();
  double range[2];
  vtkSMProxy* map = this->WatchedMap;
  const bool hasRange = this->RangeOfScalars(now.Array.c_str(), now.Association, std::nullopt, range);
  if (hasRange && pv::mayRescale(map)) {
    vtkSMTransferFunctionProxy::RescaleTransferFunction(map, range);
    vtkSMTransferFunctionProxy::RescaleTransferFunction(this->OpacityFunction(), range);
  }
  if (hasRange) this->AnnounceComponent(map, range);
  // The window holds a filter whose map changes, and would make a VDI of the old component with the new map.
  pv::command(this, "Release");
  this->MarkDirty(this);
}

vtkSMProxy* vtkSMVDIGeneratorProxy::OpacityFunction() {
  vtkSMProxy* set = pv::proxyIn(this, "ScalarOpacityFunction");
  return set != nullptr ? set : pv::proxyIn(pv::proxyIn(this, "LookupTable"), "ScalarOpacityFunction");
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
  vtkSMProxy* map = pv::proxyIn(this, "LookupTable");
  if (map == nullptr) return false;
  if (map == this->ChosenMap) return true;
  // The map may come from a state file. ParaView removes spaces and similar characters from maps' names.
  const char* registered = this->GetSessionProxyManager()->GetProxyName("lookup_tables", map);
  return registered != nullptr && !name.empty() &&
         std::string_view(registered).starts_with(vtkSMCoreUtilities::SanitizeName(name) + ".");
}

bool vtkSMVDIGeneratorProxy::LacksLookupTable() {
  return pv::proxyIn(this, "LookupTable") == nullptr && this->Chosen.empty();
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
  vtkSMProxy* opacity = pv::proxyIn(map, "ScalarOpacityFunction");
  if (opacity == nullptr) opacity = manager->GetOpacityTransferFunction(name, this->GetSessionProxyManager());
  const bool another = this->NameComponent(map, name, scalars.GetAsInt(3), before) && before != nullptr;
  // A function that has not been used yet is still on [0, 1]. It gets the array's range, as in a
  // representation.
  const bool mapWaits = pv::waitsForRange(map, "RGBPoints") || another;
  const bool opacityWaits = opacity != nullptr && (pv::waitsForRange(opacity, "Points") || another);
  if (mapWaits || opacityWaits) {
    double range[2];
    if (!this->RangeOfScalars(name, scalars.GetAsInt(3), time, range)) return;  // there are no data yet
    if (mapWaits) vtkSMTransferFunctionProxy::RescaleTransferFunction(map, range);
    if (opacityWaits) vtkSMTransferFunctionProxy::RescaleTransferFunction(opacity, range);
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
  const bool isNamed = pv::componentNamedBy(map) == std::max(component, vdi::magnitude);
  const bool wasPhase = before != nullptr && before->Component == vdi::phase;
  if (isNamed && (before == nullptr || wasPhase == (component == vdi::phase))) return false;
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  if (this->MapInView(name, association) == map && vtkSMPropertyHelper(shown, "Visibility").GetAsInt() != 0)
    return false;
  mode.Set(component < 0 ? vtkScalarsToColors::MAGNITUDE : vtkScalarsToColors::COMPONENT);
  if (component >= 0) number.Set(component);
  map->UpdateVTKObjects();
  return pv::mayRescale(map);
}

vtkSMProxy* vtkSMVDIGeneratorProxy::MapInView(const std::string& name, int association) {
  vtkSMProxy* shown = this->RepresentationIn(this->ActiveView());
  if (shown == nullptr || shown->GetProperty("ColorArrayName") == nullptr) return nullptr;
  const vtkSMPropertyHelper colored(shown, "ColorArrayName");
  const char* by = colored.GetInputArrayNameToProcess();
  if (by == nullptr || name != by || association != colored.GetInputArrayAssociation()) return nullptr;
  return vtkSMPropertyHelper(shown, "LookupTable", true).GetAsProxy();
}
