#include "VDIVolumeDisplay.h"

#include <vtkCamera.h>
#include <vtkCollection.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkPVDataInformation.h>
#include <vtkRenderer.h>
#include <vtkSMProperty.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMRenderViewProxy.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "plugin/VolumetricDepthImages/ParaViewVersions.h"
#include "vdi/core/Blending.h"
#include "vdi/core/Box.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Shading.h"

namespace pv {

namespace {

glm::dvec3 vectorOf(const double* v) {
  return {v[0], v[1], v[2]};
}

/// Whether the representation has the property Representation, and is a Volume now.
bool isVolume(vtkSMProxy* shown) {
  if (shown == nullptr || shown->GetProperty("Representation") == nullptr) return false;
  const char* kind = vtkSMPropertyHelper(shown, "Representation").GetAsString();
  return kind != nullptr && std::string(kind) == "Volume";
}

/// vtkVolumeMapper::BlendModes.
enum VolumeBlend {
  Composite,
  MaximumIntensity,
  MinimumIntensity,
  AverageIntensity,
  Additive,
  Isosurface,
  Slice
};

/// Whether a property, which only some kinds of volumes have, exists and is on.
bool isOn(vtkSMProxy* shown, const char* name) {
  return shown->GetProperty(name) != nullptr && vtkSMPropertyHelper(shown, name).GetAsInt() != 0;
}

std::vector<vtkLight*> shiningLights(vtkSMRenderViewProxy* view) {
  std::vector<vtkLight*> lights;
  vtkLightCollection* all = view->GetRenderer()->GetLights();
  vtkCollectionSimpleIterator next;
  all->InitTraversal(next);
  while (vtkLight* light = all->GetNextLight(next)) {
    if (light->GetSwitch() != 0) lights.push_back(light);
  }
  return lights;
}

/// VTK's mapper has code of its own for one headlight of full intensity: it shines along each ray.
bool isPlainHeadlight(const std::vector<vtkLight*>& lights) {
  return lights.size() == 1 && lights.front()->LightTypeIsHeadlight() != 0 &&
         lights.front()->GetIntensity() == 1.0;
}

/// The direction towards the light, in the camera's axes.
glm::dvec3 directionOf(vtkLight* light, vtkCamera* camera) {
  if (light->LightTypeIsHeadlight() != 0) return {0.0, 0.0, 1.0};
  const glm::dvec3 towards = vectorOf(light->GetPosition()) - vectorOf(light->GetFocalPoint());
  if (light->LightTypeIsCameraLight() != 0) return towards;
  const vdi::View view({.position = vectorOf(camera->GetPosition()),
                        .focalPoint = vectorOf(camera->GetFocalPoint()),
                        .viewUp = vectorOf(camera->GetViewUp())},
                       1, 1);
  return {glm::dot(towards, view.right()), glm::dot(towards, view.up()), -glm::dot(towards, view.forward())};
}

std::vector<vdi::Light> lightsOf(vtkSMRenderViewProxy* view) {
  const std::vector<vtkLight*> shining = shiningLights(view);
  std::vector<vdi::Light> lights;
  for (vtkLight* light : shining) {
    const glm::dvec3 color = light->GetIntensity() * vectorOf(light->GetDiffuseColor());
    const glm::dvec3 direction = directionOf(light, view->GetActiveCamera());
    const double length = glm::length(direction);
    lights.push_back({length > 0.0 ? direction / length : glm::dvec3(0.0, 0.0, 1.0), color});
  }
  if (isPlainHeadlight(shining)) lights.front().direction = glm::dvec3(0.0);
  // An empty list means the light kit.
  if (lights.empty()) lights.push_back({glm::dvec3(0.0), glm::dvec3(0.0)});
  return lights;
}

/// Whether the lights are the light kit of ParaView's new views, in any order.
bool areDefault(const std::vector<vdi::Light>& lights) {
  const std::vector<vdi::Light> kit = vdi::lightKit();
  constexpr double tolerance = 1e-4;
  return lights.size() == kit.size() && std::all_of(kit.begin(), kit.end(), [&](const vdi::Light& one) {
           return std::any_of(lights.begin(), lights.end(), [&](const vdi::Light& other) {
             return glm::distance(one.direction, other.direction) < tolerance &&
                    glm::distance(one.color, other.color) < tolerance;
           });
         });
}

/// True if none of these properties of the filter has been set. All are taken or none: a mix of the user's
/// and the view's shading would be unexpected.
bool areUnset(vtkSMProxy* filter, std::initializer_list<const char*> properties) {
  return std::all_of(properties.begin(), properties.end(), [filter](const char* property) {
    return filter->GetProperty(property)->IsValueDefault();
  });
}

/// Whether a property, whose name differs among versions of ParaView, exists and isn't the default.
bool isChanged(vtkSMProxy* shown, const char* name) {
  vtkSMProperty* property = shown->GetProperty(name);
  return property != nullptr && !property->IsValueDefault();
}

/// Empty if the filter has the volume's blend mode.
std::string blendModeIssue(vtkSMProxy* shown) {
  if (shown->GetProperty("BlendMode") == nullptr) return {};
  const char* name = nullptr;
  switch (vtkSMPropertyHelper(shown, "BlendMode").GetAsInt()) {
    case VolumeBlend::Composite:
    case VolumeBlend::MaximumIntensity:
    case VolumeBlend::MinimumIntensity:
    case VolumeBlend::Isosurface:
      return {};
    case VolumeBlend::AverageIntensity:
      name = "average intensities";
      break;
    case VolumeBlend::Additive:
      name = "additive intensities";
      break;
    case VolumeBlend::Slice:
      name = "a slice";
      break;
    default:
      name = "something other than the composite";
  }
  return std::string("The view shows ") + name +
         " of this volume (its Blend Mode), which VolumetricDepthImage doesn't support. It shows what "
         "Blend Mode Composite shows.";
}

}  // namespace

void takeLights(vtkSMProxy* filter, vtkSMRenderViewProxy* view) {
  const std::vector<vdi::Light> lights = lightsOf(view);
  vtkSMPropertyHelper property(filter, "Lights");
  if (areDefault(lights)) {
    if (property.GetNumberOfElements() > 0) property.SetNumberOfElements(0);
    return;
  }
  std::vector<double> numbers;
  for (const vdi::Light& light : lights) {
    for (const glm::dvec3& v : {light.direction, light.color}) numbers.insert(numbers.end(), {v.x, v.y, v.z});
  }
  property.Set(numbers.data(), static_cast<unsigned int>(numbers.size()));
}

void takeShading(vtkSMProxy* filter, vtkSMProxy* shown, vtkSMRenderViewProxy* view) {
  if (areUnset(filter, {"Lights"})) takeLights(filter, view);
  if (!isVolume(shown) || !isOn(shown, "Shade") || shown->GetProperty("Diffuse") == nullptr) return;
  if (!areUnset(filter, {"Shade", "Diffuse", "Ambient"})) return;
  vtkSMPropertyHelper(filter, "Shade").Set(1);
  vtkSMPropertyHelper(filter, "Diffuse").Set(vtkSMPropertyHelper(shown, "Diffuse").GetAsDouble());
  if (isPlainHeadlight(shiningLights(view)))
    vtkSMPropertyHelper(filter, "Ambient").Set(vtkSMPropertyHelper(shown, "Ambient").GetAsDouble());
}

// pv::cropsByExtent tells which box that is. ParaView has no useful extent for several data sets, so their
// box comes from their bounds in each version.
vdi::Box wholeToCrop(vtkPVDataInformation* data) {
  if (data == nullptr) return {};
  std::array<double, 6> b{};
  data->GetBounds(b.data());
  if (cropsByExtent && (data->DataSetTypeIsA("vtkImageData") || data->DataSetTypeIsA("vtkRectilinearGrid"))) {
    std::array<int, 6> extent{};
    data->GetExtent(extent.data());
    std::copy(extent.begin(), extent.end(), b.begin());
  }
  return {{b[0], b[2], b[4]}, {b[1], b[3], b[5]}};
}

void takeCropping(vtkSMProxy* filter, vtkSMProxy* shown, const vdi::Box& whole) {
  if (!isVolume(shown) || !isOn(shown, "UseCropping") || whole.empty()) return;
  if (!areUnset(filter, {"Cropping", "CroppingBox"})) return;
  const vtkSMPropertyHelper origin(shown, "CroppingOrigin");
  const vtkSMPropertyHelper scale(shown, "CroppingScale");
  std::array<double, 6> box{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<unsigned int>(axis);
    const std::size_t place = 2 * static_cast<std::size_t>(axis);
    box[place] = origin.GetAsDouble(i) + scale.GetAsDouble(i) * whole.lo[axis];
    box[place + 1] = origin.GetAsDouble(i) + scale.GetAsDouble(i) * whole.hi[axis];
  }
  vtkSMPropertyHelper(filter, "Cropping").Set(1);
  vtkSMPropertyHelper(filter, "CroppingBox").Set(box.data(), 6);
}

void takeBlending(vtkSMProxy* filter, vtkSMProxy* shown) {
  if (!isVolume(shown) || shown->GetProperty("BlendMode") == nullptr) return;
  if (!areUnset(filter, {"BlendMode", "IsosurfaceValues"})) return;
  const int shownMode = vtkSMPropertyHelper(shown, "BlendMode").GetAsInt();
  std::optional<vdi::BlendMode> mode;
  if (shownMode == VolumeBlend::MaximumIntensity) mode = vdi::BlendMode::Maximum;
  if (shownMode == VolumeBlend::MinimumIntensity) mode = vdi::BlendMode::Minimum;
  if (shownMode == VolumeBlend::Isosurface && shown->GetProperty("IsosurfaceValues") != nullptr) {
    mode = vdi::BlendMode::Isosurface;
    const std::vector<double> values = vtkSMPropertyHelper(shown, "IsosurfaceValues").GetDoubleArray();
    vtkSMPropertyHelper(filter, "IsosurfaceValues")
        .Set(values.data(), static_cast<unsigned int>(values.size()));
  }
  if (mode) vtkSMPropertyHelper(filter, "BlendMode").Set(static_cast<int>(*mode));
}

void takeInterpolation(vtkSMProxy* filter, vtkSMProxy* shown) {
  if (!isVolume(shown) || shown->GetProperty("InterpolationType") == nullptr) return;
  if (!areUnset(filter, {"InterpolationType"})) return;
  // ParaView's default is Cubic, which renderers on the GPU take for linear.
  const bool isNearest = vtkSMPropertyHelper(shown, "InterpolationType").GetAsInt() == 0;
  const vdi::Interpolation interpolation =
      isNearest ? vdi::Interpolation::Nearest : vdi::Interpolation::Linear;
  vtkSMPropertyHelper(filter, "InterpolationType").Set(static_cast<int>(interpolation));
}

bool takesComponentsTogether(vtkSMProxy* shown) {
  if (!isVolume(shown)) return false;
  const bool maps = shown->GetProperty("MapScalars") == nullptr || isOn(shown, "MapScalars");
  return !maps || isOn(shown, "MultiComponentsMapping");
}

std::string displayIssues(vtkSMProxy* shown, bool isTogether) {
  if (!isVolume(shown)) return {};
  std::string issues = blendModeIssue(shown);
  const auto add = [&issues](const char* issue) {
    if (!issues.empty()) issues += ' ';
    issues += issue;
  };
  if (isOn(shown, "UseTransfer2D")) {
    add("The view colours this volume by a 2-D transfer function (its Use 2D Transfer Function). "
        "VolumetricDepthImage uses the colour map and the opacity function instead.");
  } else if (isOn(shown, "UseSeparateOpacityArray")) {
    add("The view takes this volume's opacity from another array (its Use Separate Opacity Array). "
        "VolumetricDepthImage uses the array that it shows instead.");
  }
  const auto isAnyChanged = [shown](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [shown](const char* name) { return isChanged(shown, name); });
  };
  if (takesComponentsTogether(shown) && !isTogether) {
    add("The view takes the components of this volume's array together (without its Map Scalars, or with its "
        "Multi Components Mapping), for which an array needs two or four. VolumetricDepthImage maps the one "
        "component that it shows.");
  }
  if (isAnyChanged({"VolumetricScatteringBlending", "VolumeAnisotropy", "GlobalIlluminationReach"})) {
    add("The view scatters light in this volume (its Volumetric Scattering, its Anisotropy or its Global "
        "Illumination Reach), but VolumetricDepthImage shows emission and absorption only.");
  }
  if (isOn(shown, "Shade") && isChanged(shown, "Specular")) {
    add("The view shows highlights (its Specular), but VolumetricDepthImage shades without them.");
  }
  // ParaView 5.13 has renamed Position to Translation, and 6.0 can fix a volume to a display.
  if (isAnyChanged({"Position", "Translation", "Scale", "Orientation", "CoordinateSystem"})) {
    add("The view moves, scales or turns this volume (its Transforming, or its Coordinate System), but "
        "VolumetricDepthImage shows it where its data are.");
  }
  return issues;
}

}  // namespace pv
