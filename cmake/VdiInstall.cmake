# Rules for `cmake --install`, and the packages that CMake and pkg-config find afterwards.
include(CMakePackageConfigHelpers)

set(headerDir "${CMAKE_INSTALL_INCLUDEDIR}/pv-vdi")
set(dataDir "${CMAKE_INSTALL_DATADIR}/pv-vdi")
set(cmakeDir "${CMAKE_INSTALL_LIBDIR}/cmake/pv-vdi")
set(pkgConfigDir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

# vdi_install_pkg_config(<name>): installs cmake/<name>.pc.in. The file finds the prefix from its
# own path.
function(vdi_install_pkg_config name)
  file(RELATIVE_PATH toPrefix "/prefix/${pkgConfigDir}" /prefix)
  string(REGEX REPLACE "/$" "" toPrefix "${toPrefix}")
  configure_file("${CMAKE_SOURCE_DIR}/cmake/${name}.pc.in" "${CMAKE_BINARY_DIR}/${name}.pc" @ONLY)
  install(FILES "${CMAKE_BINARY_DIR}/${name}.pc" DESTINATION "${pkgConfigDir}")
endfunction()

# The library without VTK. Its public headers are vdi/core/Error.h, vdi/io/VdiFile.h,
# vdi/pipeline/VdiGenerator.h and VdiRenderer.h; the others are those that they include. The test
# install_headers compares this list with the includes.
install(
  TARGETS vdi
  EXPORT pv-vdi-vdi-targets
  INCLUDES DESTINATION "${headerDir}")
foreach(
  header
  comm/Communicator
  comm/Transport
  core/Blending
  core/Block
  core/Box
  core/Budget
  core/Camera
  core/Coloring
  core/Encoding
  core/Error
  core/FunctionRef
  core/GenerateSettings
  core/HostVector
  core/Image
  core/Reconstruction
  core/Region
  core/ScalarRange
  core/ScalarType
  core/Scene
  core/Shading
  core/Strides
  core/Supersegment
  core/TransferFunction
  core/Vdi
  gpu/Device
  gpu/DeviceLimits
  gpu/DeviceRequest
  io/VdiFile
  pipeline/GeneratorOptions
  pipeline/Reports
  pipeline/VdiGenerator
  pipeline/VdiRenderer)
  get_filename_component(folder "${header}" DIRECTORY)
  install(FILES "vdi/${header}.h" DESTINATION "${headerDir}/vdi/${folder}")
endforeach()
install(EXPORT pv-vdi-vdi-targets NAMESPACE pv-vdi:: DESTINATION "${cmakeDir}")
vdi_install_pkg_config(pv-vdi)

install(TARGETS vdi_tool)

# The Python package, in the folder that Debian's Python searches. With another prefix, users add
# the folder to PYTHONPATH.
if(TARGET vdi_python)
  set(pythonDir lib/python3/dist-packages/pv_vdi)
  install(TARGETS vdi_python LIBRARY DESTINATION "${pythonDir}")
  install(FILES vdi/python/pv_vdi/__init__.py DESTINATION "${pythonDir}")
  if(VDI_BUILD_PARAVIEW)
    install(FILES vdi/python/pv_vdi/catalyst.py vdi/python/pv_vdi/_device.py vdi/python/pv_vdi/_faults.py
            DESTINATION "${pythonDir}")
    # Programs link libvdi_catalyst.so. At run time they need only the file with the version.
    file(RELATIVE_PATH library "/prefix/${pythonDir}"
         "/prefix/${CMAKE_INSTALL_LIBDIR}/libvdi_catalyst.so.${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
    file(CONFIGURE OUTPUT _location.py CONTENT "LIBRARY = \"@library@\"\n" @ONLY)
    install(FILES "${CMAKE_CURRENT_BINARY_DIR}/_location.py" DESTINATION "${pythonDir}")
  endif()
endif()

if(VDI_BUILD_PARAVIEW)
  install(
    TARGETS vdi_catalyst
    EXPORT pv-vdi-catalyst-targets
    INCLUDES DESTINATION "${headerDir}")
  install(TARGETS vdi_catalyst_engine vdi_catalyst_json vdi_catalyst_isolated vdi_catalyst_process
          DESTINATION "${CMAKE_INSTALL_LIBDIR}/pv-vdi")
  install(FILES catalyst_adaptor/vdi_catalyst.h catalyst_adaptor/vdi_catalyst.f90 DESTINATION "${headerDir}")
  install(EXPORT pv-vdi-catalyst-targets NAMESPACE pv-vdi:: DESTINATION "${cmakeDir}")
  vdi_install_pkg_config(pv-vdi-catalyst)
  install(DIRECTORY python_pipelines DESTINATION "${dataDir}" FILES_MATCHING PATTERN "*.py" PATTERN "*.json")
  set(pluginDir "${CMAKE_INSTALL_LIBDIR}/${PARAVIEW_PLUGIN_SUBDIR}")
  install(TARGETS VolumetricDepthImages DESTINATION "${pluginDir}/VolumetricDepthImages")
  install(FILES "${CMAKE_BINARY_DIR}/lib/${PARAVIEW_PLUGIN_SUBDIR}/pv-vdi.plugins.xml" DESTINATION "${pluginDir}")
  # A ParaView in the same bin/ finds its plugins by this file. Each line names a list of plugins.
  file(RELATIVE_PATH pluginList "/prefix/${CMAKE_INSTALL_BINDIR}"
       "/prefix/${pluginDir}/pv-vdi.plugins.xml")
  file(CONFIGURE OUTPUT paraview.conf CONTENT "@pluginList@\n" @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/paraview.conf" DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()

configure_package_config_file(cmake/pv-vdi-config.cmake.in pv-vdi-config.cmake INSTALL_DESTINATION "${cmakeDir}"
                              PATH_VARS headerDir)
write_basic_package_version_file(pv-vdi-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/pv-vdi-config.cmake" "${CMAKE_BINARY_DIR}/pv-vdi-config-version.cmake"
        DESTINATION "${cmakeDir}")

# The documents, and the files that they link to, in the places that the links name.
install(FILES README.md CHANGELOG.md CONTRIBUTING.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(FILES LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}" RENAME copyright)
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY python_pipelines DESTINATION "${CMAKE_INSTALL_DOCDIR}" FILES_MATCHING PATTERN "*.py" PATTERN "*.json")
install(FILES catalyst_adaptor/vdi_catalyst.h catalyst_adaptor/vdi_catalyst.f90
        DESTINATION "${CMAKE_INSTALL_DOCDIR}/catalyst_adaptor")
install(DIRECTORY catalyst_adaptor/examples DESTINATION "${CMAKE_INSTALL_DOCDIR}/catalyst_adaptor"
        PATTERN CMakeLists.txt EXCLUDE)
install(DIRECTORY tests/install/project DESTINATION "${CMAKE_INSTALL_DOCDIR}/tests/install")
install(FILES tests/README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}/tests")
