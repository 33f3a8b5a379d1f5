#pragma once
// The differences among the versions of ParaView from 5.11 to 6.x. The code tests features rather than
// version numbers where it can. The CMake half is cmake/ParaViewVersions.cmake. The two hold all tests of
// versions and of C++ features, as tests/IncludesTest.cmake checks for versions. Other files list the names
// of several versions where a look-up decides.

#include <vtkPVVersion.h>
#include <vtkType.h>

#include <string>
#include <utility>
#include <vector>

// OpenGL's functions. VTK loads them with glad from 9.5 on, and with GLEW before.
#if __has_include(<vtk_glad.h>)
#define VDI_VTK_OPENGL <vtk_glad.h>
#else
#define VDI_VTK_OPENGL <vtk_glew.h>
#endif

namespace pv {

/// Whether CroppingScale and CroppingOrigin apply to the whole extent of an image or rectilinear grid, with
/// each index taken as a coordinate, as from ParaView 5.13 on. Up to 5.12 they apply to its bounds. The
/// result is the box that ParaView draws.
inline constexpr bool cropsByExtent =
    std::pair(PARAVIEW_VERSION_MAJOR, PARAVIEW_VERSION_MINOR) >= std::pair(5, 13);

/// Whether ranks agree on errors in each update of a proxy, as in ParaView 6. There, each update is
/// collective, even if nothing has changed.
inline constexpr bool updatesAreCollective = PARAVIEW_VERSION_MAJOR >= 6;

/// Starts ParaView's in situ engine on the communicator of this Fortran handle. Helper is
/// vtkInSituInitializationHelper. Collective. ParaView 6 also takes folders of Python modules; this passes
/// none.
template <class Helper>
void initializeInSitu(vtkTypeUInt64 communicator) {
  if constexpr (requires { Helper::Initialize(communicator, std::vector<std::string>{}); }) {
    Helper::Initialize(communicator, std::vector<std::string>{});
  } else {
    Helper::Initialize(communicator);
  }
}

}  // namespace pv
