# `cpack` in the build folder makes pv-vdi_<version>_<architecture>.deb for the Debian of the build.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME pv-vdi)
set(CPACK_PACKAGE_VENDOR "pv-vdi developers")
set(CPACK_PACKAGE_CONTACT "pv-vdi developers <pv-vdi@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Volumetric Depth Images for ParaView and Catalyst")
set(CPACK_PACKAGE_DESCRIPTION
    "Turns a volume that is scattered over MPI ranks into a Volumetric Depth Image:
a picture with depth that can be viewed from new viewpoints without the volume.
Has the plugin for ParaView, the library that simulations link, a library
without VTK, and the tool vdi.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Dependencies that no library lists: Vulkan's driver, modules that scripts import, headers that our
# headers include.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "mesa-vulkan-drivers | vulkan-icd, libglm-dev")
if(VDI_BUILD_PARAVIEW)
  string(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS ", paraview, python3-paraview")
endif()
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS openmpi-bin)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "cmake, libopenmpi-dev, python3-skimage, xvfb") # simulations; the demo's script
include(CPack)
