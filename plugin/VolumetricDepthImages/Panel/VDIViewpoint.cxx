#include "VDIViewpoint.h"

#include <vtkSMPropertyHelper.h>
#include <vtkSMProxy.h>
#include <vtkSMRenderViewProxy.h>

#include <algorithm>

namespace pv {

std::optional<ViewpointNumbers> viewpointOf(vtkSMProxy* reader) {
  reader->UpdatePropertyInformation(reader->GetProperty("Viewpoint"));
  ViewpointNumbers numbers{};
  vtkSMPropertyHelper(reader, "Viewpoint").Get(numbers.data(), static_cast<unsigned int>(numbers.size()));
  if (std::equal(numbers.begin(), numbers.begin() + 3, numbers.begin() + 3)) return std::nullopt;
  return numbers;
}

void lookFrom(const ViewpointNumbers& viewpoint, vtkSMRenderViewProxy* view) {
  vtkSMPropertyHelper(view, "CameraPosition").Set(viewpoint.data(), 3);
  vtkSMPropertyHelper(view, "CameraFocalPoint").Set(&viewpoint[3], 3);
  vtkSMPropertyHelper(view, "CameraViewUp").Set(&viewpoint[6], 3);
  vtkSMPropertyHelper(view, "CameraViewAngle").Set(viewpoint[9]);
  vtkSMPropertyHelper(view, "CameraParallelProjection").Set(viewpoint[10] != 0.0 ? 1 : 0);
  vtkSMPropertyHelper(view, "CameraParallelScale").Set(viewpoint[11]);
  view->UpdateVTKObjects();
}

}  // namespace pv
