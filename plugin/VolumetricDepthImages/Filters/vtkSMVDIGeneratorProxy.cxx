#include "vtkSMVDIGeneratorProxy.h"

#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVArrayInformation.h>
#include <vtkPVDataInformation.h>
#include <vtkProcessModule.h>
#include <vtkSMInputProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionPresets.h>
#include <vtkSMTransferFunctionProxy.h>
#include <vtkSmartPointer.h>
#include <vtk_jsoncpp.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "VDISession.h"
#include "vdi/core/Error.h"

namespace {

/// A function's control points: `values` numbers each, the first of them the place.
struct ControlPoints {
  std::vector<double> numbers;
  std::size_t values = 4;

  std::size_t size() const { return numbers.size() / values; }
  double place(std::size_t i) const { return numbers[i * values]; }

  /// Whether it's `preset`, whose places count from its first to its last, moved to [0, 1].
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

/// Whether somebody has set the control points of a colour map (`RGBPoints`) or opacity function (`Points`):
/// they are neither ParaView's own nor those of a preset on [0, 1], which wait for a range.
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

/// Whether a function is still without a range. One that somebody has set is said to have one, so that
/// ParaView's own views leave it alone as well.
bool WaitsForRange(vtkSMProxy* function, const char* property) {
  vtkSMPropertyHelper initialized(function, "ScalarRangeInitialized", true);
  if (initialized.GetAsInt() != 0) return false;
  if (!IsSetExplicitly(function, property)) return true;
  initialized.Set(1);
  function->UpdateVTKObjects();
  return false;
}

/// Where each rank has a client of its own (pvbatch --symmetric, Catalyst), each knows the range of its own
/// data only. False where another rank doesn't come along, which the update that follows says.
bool WidenOverRanks(double range[2]) {
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  if (!vtkProcessModule::GetProcessModule()->GetSymmetricMPIMode() || controller == nullptr) return true;
  try {
    pv::enterCollective(controller, "range of VolumetricDepthImage's colour map");
  } catch (const vdi::Error&) {
    return false;
  }
  const double mine[2] = {-range[0], range[1]};
  double all[2];
  controller->AllReduce(mine, all, 2, vtkCommunicator::MAX_OP);
  range[0] = -all[0];
  range[1] = all[1];
  return true;
}

}  // namespace

vtkStandardNewMacro(vtkSMVDIGeneratorProxy);

void vtkSMVDIGeneratorProxy::UpdatePipeline() {
  this->ChooseLookupTable(std::nullopt);
  this->Superclass::UpdatePipeline();
}

void vtkSMVDIGeneratorProxy::UpdatePipeline(double time) {
  this->ChooseLookupTable(time);
  this->Superclass::UpdatePipeline(time);
}

void vtkSMVDIGeneratorProxy::PrepareUpstream(vtkSMProxy* proxy, std::optional<double> time) {
  if (proxy == nullptr) return;
  for (unsigned int i = 0; i < proxy->GetNumberOfProducers(); ++i) {
    vtkSMProxy* producer = proxy->GetProducerProxy(i);
    if (vtkSMSourceProxy::SafeDownCast(producer) == nullptr) continue;  // not maps and the like
    PrepareUpstream(producer, time);
    if (auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(producer)) generator->ChooseLookupTable(time);
  }
}

void vtkSMVDIGeneratorProxy::ChooseLookupTable(std::optional<double> time) {
  vtkSMPropertyHelper table(this, "LookupTable");
  vtkSMPropertyHelper scalars(this, "SelectInputScalars");
  const char* name = scalars.GetNumberOfElements() > 4 ? scalars.GetAsString(4) : nullptr;
  const bool ours =
      table.GetNumberOfElements() == 0 || table.GetAsProxy() == nullptr || !this->Chosen.empty();
  if (!ours || name == nullptr || *name == '\0' || this->Chosen == name) return;
  vtkNew<vtkSMTransferFunctionManager> manager;
  vtkSMProxy* map = manager->GetColorTransferFunction(name, this->GetSessionProxyManager());
  if (map == nullptr) return;
  vtkSMProxy* opacity = manager->GetOpacityTransferFunction(name, this->GetSessionProxyManager());
  // What nobody has used yet is still on [0, 1]: give it the array's range, as a representation does.
  const bool mapWaits = WaitsForRange(map, "RGBPoints");
  const bool opacityWaits = opacity != nullptr && WaitsForRange(opacity, "Points");
  if (mapWaits || opacityWaits) {
    double range[2];
    if (!this->RangeOfScalars(name, scalars.GetAsInt(3), time, range))
      return;  // not now: there are no data yet
    if (mapWaits) vtkSMTransferFunctionProxy::RescaleTransferFunction(map, range[0], range[1]);
    if (opacityWaits) vtkSMTransferFunctionProxy::RescaleTransferFunction(opacity, range[0], range[1]);
  }
  table.Set(map);
  this->UpdateVTKObjects();
  this->Chosen = name;
}

bool vtkSMVDIGeneratorProxy::RangeOfScalars(const char* name, int association, std::optional<double> time,
                                            double range[2]) {
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
      // The filter's component; one that isn't there is an error of the filter's.
      const int wanted = vtkSMPropertyHelper(this, "Component").GetAsInt();
      const int components = array->GetNumberOfComponents();
      const int component = components == 1 ? 0 : std::clamp(wanted, -1, components - 1);
      array->GetComponentFiniteRange(component, range);
    }
  }
  return WidenOverRanks(range) && range[0] <= range[1];
}
