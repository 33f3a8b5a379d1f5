# Finds ParaView 5.11 to 6.x and handles the differences between its versions. The C++ half is
# plugin/VolumetricDepthImages/ParaViewVersions.h. Defines, in addition to ParaView's own variables:
#   VDI_PARAVIEW_NAME  name of the folder with its libraries and headers, for example paraview-5.11
#   VDI_QT             the Qt of ParaView's window: Qt5 or Qt6
#   VDI_PLUGIN_HELP    whether this ParaView makes the help of a plugin's panel
#   VDI_GL_LOADER      the VTK target that loads OpenGL's functions
#   VDI_NEEDS_DISPLAY  whether its views need an X server; ParaView 6 draws them without one, too
#   VDI_CONVERTS_ARRAYS  whether a filter that asks for cell data gets them from the points of a simulation's blocks, as
#                      from ParaView 6 on
#   VDI_COLORS_BY_PARTS  whether views of pvbatch --symmetric can colour by an array that only some ranks have; such a
#                        run aborts: observed with ParaView 6.1, assumed from 6 on
#   VDI_LOADS_STATES_ON_RANKS  whether pvbatch on several ranks can load a state; it hangs: observed with
#                        ParaView 6.1, assumed from 6 on
#   VDI_PLUGIN_UNITY   whether a unity build compiles the plugin's sources together

# vdi_pass_over_python_modules(<folder of a ParaView's CMake files>): makes CMake accept Debian 13's
# paraview-dev. That package names vtkmodules/X.so, but python3-paraview has
# X.cpython-313-x86_64-linux-gnu.so. CMake checks that every exported file exists and refuses the
# package, although nothing here links to these modules. CMake skips this check for a target that it
# takes for an Apple XCFramework. The function thus marks each module that exists under its longer
# name. CMake still refuses a module that is missing.
function(vdi_pass_over_python_modules folder)
  file(GLOB exports "${folder}/vtk/VTKPython-targets-*.cmake" "${folder}/ParaViewPython*-targets-*.cmake")
  foreach(export IN LISTS exports)
    file(STRINGS "${export}" checks REGEX "_cmake_import_check_files_for_")
    foreach(check IN LISTS checks)
      string(REGEX MATCH "_cmake_import_check_files_for_([^ ]+) +\"\\\${_IMPORT_PREFIX}/([^\"]+)[.]so\"" matched "${check}")
      set(target "${CMAKE_MATCH_1}")
      set(module "${CMAKE_MATCH_2}")
      string(REGEX REPLACE "/lib/.*" "" prefix "${folder}")
      file(GLOB longer "${prefix}/${module}.cpython-*.so")
      if(matched AND longer AND NOT EXISTS "${prefix}/${module}.so")
        set(skip "_cmake_import_check_xcframework_for_${target}")
        set(${skip} "${folder}" PARENT_SCOPE)
      endif()
    endforeach()
  endforeach()
endfunction()

# No ParaView has this version. The call only finds ParaView's folder and version.
find_package(ParaView 1000 QUIET CONFIG)
foreach(config IN LISTS ParaView_CONSIDERED_CONFIGS)
  get_filename_component(folder "${config}" DIRECTORY)
  vdi_pass_over_python_modules("${folder}")
endforeach()

find_package(ParaView REQUIRED CONFIG)
if(ParaView_VERSION VERSION_LESS 5.11)
  message(FATAL_ERROR "pv-vdi needs ParaView 5.11 or later; this is ${ParaView_VERSION}, in ${ParaView_DIR}")
endif()

set(VDI_PARAVIEW_NAME "paraview-${ParaView_VERSION_MAJOR}.${ParaView_VERSION_MINOR}")
set(VDI_QT "Qt5")
if(PARAVIEW_QT_MAJOR_VERSION)
  set(VDI_QT "Qt${PARAVIEW_QT_MAJOR_VERSION}")
endif()
set(VDI_PLUGIN_HELP ON)
if(VDI_QT STREQUAL "Qt6" AND ParaView_VERSION VERSION_LESS 6)
  set(VDI_PLUGIN_HELP OFF)
endif()
set(VDI_NEEDS_DISPLAY ON)
set(VDI_CONVERTS_ARRAYS OFF)
set(VDI_COLORS_BY_PARTS ON)
set(VDI_LOADS_STATES_ON_RANKS ON)
set(VDI_PLUGIN_UNITY "${CMAKE_UNITY_BUILD}")
if(ParaView_VERSION VERSION_GREATER_EQUAL 5.12)
  set(VDI_PLUGIN_UNITY OFF) # the header that it generates has no include guard
endif()
if(ParaView_VERSION VERSION_GREATER_EQUAL 6)
  set(VDI_NEEDS_DISPLAY OFF)
  set(VDI_CONVERTS_ARRAYS ON)
  set(VDI_COLORS_BY_PARTS OFF)
  set(VDI_LOADS_STATES_ON_RANKS OFF)
endif()
set(VDI_GL_LOADER VTK::glew)
if(TARGET VTK::glad)
  set(VDI_GL_LOADER VTK::glad)
endif()
