# Finds IceT, which composites whole pictures of many ranks: ParaView's, or a separate installation.
# Defines IceT_FOUND and the target IceT::MPI. ParaView's own target for IceT requires all of
# ParaView.
set(_icet_suffix "-pv${ParaView_VERSION_MAJOR}.${ParaView_VERSION_MINOR}") # as in the found ParaView
find_path(IceT_INCLUDE_DIR IceTMPI.h PATH_SUFFIXES "${VDI_PARAVIEW_NAME}/vtkicet/src/include")
find_library(IceT_CORE_LIBRARY NAMES IceTCore "vtkIceTCore${_icet_suffix}")
find_library(IceT_MPI_LIBRARY NAMES IceTMPI "vtkIceTMPI${_icet_suffix}")
unset(_icet_suffix)
mark_as_advanced(IceT_INCLUDE_DIR IceT_CORE_LIBRARY IceT_MPI_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(IceT REQUIRED_VARS IceT_MPI_LIBRARY IceT_CORE_LIBRARY IceT_INCLUDE_DIR)
if(IceT_FOUND AND NOT TARGET IceT::MPI)
  add_library(IceT::Core UNKNOWN IMPORTED)
  set_property(TARGET IceT::Core PROPERTY IMPORTED_LOCATION "${IceT_CORE_LIBRARY}")
  target_include_directories(IceT::Core INTERFACE "${IceT_INCLUDE_DIR}")
  add_library(IceT::MPI UNKNOWN IMPORTED)
  set_property(TARGET IceT::MPI PROPERTY IMPORTED_LOCATION "${IceT_MPI_LIBRARY}")
  target_link_libraries(IceT::MPI INTERFACE IceT::Core MPI::MPI_C)
endif()
