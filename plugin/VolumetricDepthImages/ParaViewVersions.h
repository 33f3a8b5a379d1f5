#pragma once
// What differs between the ParaViews from 5.11 to 6.x, by what they have rather than by their numbers where
// that tells. The CMake half is cmake/ParaViewVersions.cmake. No other file asks for a version.

#include <vtkPVVersion.h>
#include <vtkType.h>

#include <string>
#include <utility>
#include <vector>

// OpenGL's functions: VTK loads them by glad from 9.5 on, by GLEW before.
#if __has_include(<vtk_glad.h>)
#define VDI_VTK_OPENGL <vtk_glad.h>
#else
#define VDI_VTK_OPENGL <vtk_glew.h>
#endif

namespace pv {

/// What of an image or rectilinear grid a volume's CroppingScale and CroppingOrigin turn into the box that
/// ParaView draws: its bounds up to 5.12; from 5.13 on its whole extent, each index taken for a coordinate.
inline constexpr bool cropsByExtent =
    std::pair(PARAVIEW_VERSION_MAJOR, PARAVIEW_VERSION_MINOR) >= std::pair(5, 13);

/// Starts ParaView's in situ engine, Helper being vtkInSituInitializationHelper, on the communicator of this
/// Fortran handle. Collective. ParaView 6 takes folders of Python modules too; none are given, as before.
template <class Helper>
void initializeInSitu(vtkTypeUInt64 communicator) {
  if constexpr (requires { Helper::Initialize(communicator, std::vector<std::string>{}); }) {
    Helper::Initialize(communicator, std::vector<std::string>{});
  } else {
    Helper::Initialize(communicator);
  }
}

}  // namespace pv
