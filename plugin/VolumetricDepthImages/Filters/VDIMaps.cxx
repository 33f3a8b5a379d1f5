#include "VDIMaps.h"

#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMTransferFunctionManager.h>
#include <vtkSMTransferFunctionPresets.h>
#include <vtkScalarsToColors.h>
#include <vtk_jsoncpp.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "vdi/core/ComponentValues.h"

namespace pv {

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
bool isSetExplicitly(vtkSMProxy* function, const char* property) {
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

}  // namespace

bool waitsForRange(vtkSMProxy* function, const char* property) {
  vtkSMPropertyHelper initialized(function, "ScalarRangeInitialized", true);
  if (initialized.GetAsInt() != 0) return false;
  if (!isSetExplicitly(function, property)) return true;
  initialized.Set(1);
  function->UpdateVTKObjects();
  return false;
}

int componentNamedBy(vtkSMProxy* map) {
  if (map->GetProperty("VectorMode") == nullptr) return vdi::magnitude;
  const bool isOne = vtkSMPropertyHelper(map, "VectorMode").GetAsInt() == vtkScalarsToColors::COMPONENT;
  return isOne ? vtkSMPropertyHelper(map, "VectorComponent").GetAsInt() : vdi::magnitude;
}

bool mayRescale(vtkSMProxy* map) {
  return vtkSMPropertyHelper(map, "AutomaticRescaleRangeMode", true).GetAsInt() !=
         vtkSMTransferFunctionManager::NEVER;
}

vtkSMProxy* proxyIn(vtkSMProxy* owner, const char* property) {
  if (owner == nullptr || owner->GetProperty(property) == nullptr) return nullptr;
  const vtkSMPropertyHelper helper(owner, property);
  return helper.GetNumberOfElements() > 0 ? helper.GetAsProxy() : nullptr;
}

}  // namespace pv
