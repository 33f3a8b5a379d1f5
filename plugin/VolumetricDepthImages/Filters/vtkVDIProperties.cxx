#include "vtkVDIProperties.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <vtkPiecewiseFunction.h>
#include <vtkScalarsToColors.h>

#include <algorithm>
#include <utility>

#include "VDIFrameInputs.h"
#include "VDILoad.h"
#include "VDITransferFunctions.h"
#include "vdi/core/Blending.h"
#include "vdi/core/Box.h"
#include "vdi/core/Error.h"
#include "vdi/core/ScalarRange.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/UnitDistance.h"

vtkVDIProperties::vtkVDIProperties() {
  for (const vdi::Setting& setting : vdi::settingsTable())
    this->Settings.push_back(setting.get({.samplesPerVoxel = vdi::automaticRate}));
}

vtkVDIProperties::~vtkVDIProperties() = default;

void vtkVDIProperties::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Resolution: " << this->Resolution[0] << " x " << this->Resolution[1] << "\n";
  for (std::size_t i = 0; i < this->Settings.size(); ++i) {
    const vdi::Setting& setting = vdi::settingsTable()[i];
    os << indent << setting.property << ": " << this->Settings[i] << "\n";
  }
  os << indent << "MissingValues: " << fmt::format("{}", fmt::join(this->MissingValues, " ")) << "\n"
     << indent << "Lights: " << this->Lights.size() << "\n"
     << indent << "Cropping: " << this->Cropping << "\n"
     << indent << "CroppingBox: " << fmt::format("{}", fmt::join(this->CroppingBox, " ")) << "\n"
     << indent << "ClippingPlanes: " << this->ClippingPlanes.size() << "\n"
     << indent << "BlendMode: " << this->BlendMode << "\n"
     << indent << "IsosurfaceValues: " << fmt::format("{}", fmt::join(this->IsosurfaceValues, " ")) << "\n"
     << indent << "ScalarOpacityUnitDistance: " << this->ScalarOpacityUnitDistance << "\n";
}

void vtkVDIProperties::SetLookupTable(vtkScalarsToColors* table) {
  if (this->LookupTable == table) return;
  this->LookupTable = table;
  this->Modified();
}

void vtkVDIProperties::SetScalarOpacityFunction(vtkPiecewiseFunction* function) {
  if (this->ScalarOpacityFunction == function) return;
  this->ScalarOpacityFunction = function;
  this->Modified();
}

void vtkVDIProperties::AddLight(double right, double up, double back, double red, double green, double blue) {
  this->Lights.push_back({right, up, back, red, green, blue});
  this->Modified();
}

void vtkVDIProperties::RemoveAllLights() {
  if (this->Lights.empty()) return;
  this->Lights.clear();
  this->Modified();
}

void vtkVDIProperties::AddClippingPlane(double originX, double originY, double originZ, double normalX,
                                        double normalY, double normalZ) {
  this->ClippingPlanes.push_back({originX, originY, originZ, normalX, normalY, normalZ});
  this->Modified();
}

void vtkVDIProperties::RemoveAllClippingPlanes() {
  if (this->ClippingPlanes.empty()) return;
  this->ClippingPlanes.clear();
  this->Modified();
}

void vtkVDIProperties::AddMissingValue(double value) {
  this->MissingValues.push_back(value);
  this->Modified();
}

void vtkVDIProperties::RemoveAllMissingValues() {
  if (this->MissingValues.empty()) return;
  this->MissingValues.clear();
  this->Modified();
}

void vtkVDIProperties::AddIsosurfaceValue(double value) {
  this->IsosurfaceValues.push_back(value);
  this->Modified();
}

void vtkVDIProperties::RemoveAllIsosurfaceValues() {
  if (this->IsosurfaceValues.empty()) return;
  this->IsosurfaceValues.clear();
  this->Modified();
}

vdi::Blending vtkVDIProperties::CurrentBlending() const {
  vdi::Blending blending;
  blending.mode = static_cast<vdi::BlendMode>(this->BlendMode);
  if (blending.mode == vdi::BlendMode::Isosurface) blending.isovalues = this->IsosurfaceValues;
  if (blending.mode != vdi::BlendMode::Composite && !this->PictureOnly)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                     "a VDI holds only composite blending. Choose Composite as Blend Mode, or Picture Only "
                     "(PictureOnly, an advanced property) for a picture of this mode without a VDI");
  return blending;
}

vdi::Region vtkVDIProperties::CurrentRegion() const {
  vdi::Region region;
  const double* b = this->CroppingBox;
  const bool isSet = std::any_of(b, b + 6, [](double bound) { return bound != 0.0; });
  if (this->Cropping && isSet) region.box = {{b[0], b[2], b[4]}, {b[1], b[3], b[5]}};
  for (const std::array<double, 6>& plane : this->ClippingPlanes)
    region.planes.push_back({{plane[0], plane[1], plane[2]}, {plane[3], plane[4], plane[5]}});
  return region;
}

void vtkVDIProperties::SetSetting(const char* property, double value) {
  double& setting = this->Settings[vdi::indexOfSetting(property)];
  if (setting == value) return;
  setting = value;
  this->Modified();
}

vtkMTimeType vtkVDIProperties::CurrentMTime() {
  vtkMTimeType time = this->Superclass::GetMTime();
  if (this->LookupTable) time = std::max(time, this->LookupTable->GetMTime());
  if (this->ScalarOpacityFunction) time = std::max(time, this->ScalarOpacityFunction->GetMTime());
  return time;
}

vdi::Camera vtkVDIProperties::Viewpoint(const vdi::Box& bounds) const {
  const auto vector = [](const double* v) { return glm::dvec3(v[0], v[1], v[2]); };
  vdi::Camera camera{vector(this->CameraPosition), vector(this->CameraFocalPoint), vector(this->CameraViewUp),
                     this->CameraViewAngle,        this->CameraParallelProjection, this->CameraParallelScale};
  // vdi::View reports an unusable angle later.
  const bool usable = this->CameraViewAngle > 0.0 && this->CameraViewAngle < 180.0;
  if (camera.position != camera.focalPoint || !usable) return camera;
  camera = vdi::Camera::framing(bounds, {0.0, 0.0, -1.0}, camera.viewUp, camera.viewAngle);
  camera.parallelProjection = this->CameraParallelProjection;
  return camera;
}

std::array<int, 2> vtkVDIProperties::PictureSize() const {
  if (this->Resolution[0] == 0 && this->Resolution[1] == 0) return {1280, 720};
  return {this->Resolution[0], this->Resolution[1]};
}

pv::FrameInputs vtkVDIProperties::CurrentFrame(const vdi::Box& bounds, double voxelVolume,
                                               const vdi::ScalarRange& range,
                                               const pv::OpacityStretch& stretch) {
  double unit = this->ScalarOpacityUnitDistance;
  if (unit <= 0.0) unit = vdi::unitDistanceOf(bounds, voxelVolume);
  vdi::TransferFunction function =
      pv::transferFunctionOf(this->LookupTable, this->ScalarOpacityFunction, range.min, range.max, unit);
  if (stretch.top > 0.0 && stretch.range.min < stretch.range.max)
    function.opacities = pv::stretched(function, stretch.range.min, stretch.range.max, stretch.top);
  return {.camera = this->Viewpoint(bounds),
          .function = std::move(function),
          .settings = this->CurrentSettings()};
}

vdi::GenerateSettings vtkVDIProperties::CurrentSettings() const {
  vdi::GenerateSettings settings;
  const auto [width, height] = this->PictureSize();
  settings.width = width;
  settings.height = height;
  for (std::size_t i = 0; i < this->Settings.size(); ++i)
    vdi::settingsTable()[i].put(settings, this->Settings[i]);
  if (!this->Lights.empty()) settings.shading.lights.clear();
  for (const std::array<double, 6>& light : this->Lights)
    settings.shading.lights.push_back({{light[0], light[1], light[2]}, {light[3], light[4], light[5]}});
  settings.region = this->CurrentRegion();
  settings.blending = this->CurrentBlending();
  if (this->PictureOnly)
    settings.terminationOpacity = std::min(settings.terminationOpacity, vdi::pictureTermination);
  return settings;
}
