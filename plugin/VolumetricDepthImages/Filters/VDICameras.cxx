#include "VDICameras.h"

#include <vtkCamera.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMRenderViewProxy.h>
#include <vtkSMSessionProxyManager.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "vdi/core/Camera.h"

namespace pv {

vdi::Camera cameraOf(vtkCamera* camera) {
  const auto vector = [](const double* v) { return glm::dvec3(v[0], v[1], v[2]); };
  return {vector(camera->GetPosition()), vector(camera->GetFocalPoint()),      vector(camera->GetViewUp()),
          camera->GetViewAngle(),        camera->GetParallelProjection() != 0, camera->GetParallelScale()};
}

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

}  // namespace pv
