# The examples on one rank and on four. Each runs with the adaptor and without it. Its result is the same both times, bit for
# bit, and on any number of ranks. An example is skipped if its Debian package is missing.
set(examplesTest "${CMAKE_CURRENT_SOURCE_DIR}/examples.py")
set(examplesFolder "${CMAKE_SOURCE_DIR}/catalyst_adaptor/examples")

# vdi_add_example_test(<folder> program...)
function(vdi_add_example_test folder)
  foreach(ranks 1 4)
    set(name example_${folder}_np${ranks})
    add_test(
      NAME ${name}
      COMMAND
        ${CMAKE_COMMAND} -E env --unset=DISPLAY "${Python3_EXECUTABLE}" "${examplesTest}" run
        "${CMAKE_CURRENT_BINARY_DIR}/${name}" "${examplesFolder}/${folder}/vdi.json" "${MPIEXEC_EXECUTABLE}" --oversubscribe
        ${MPIEXEC_NUMPROC_FLAG} ${ranks} ${ARGN})
    vdi_test_properties(${name} TIMEOUT 120 LABELS paraview ENVIRONMENT "PYTHONPATH=${CMAKE_BINARY_DIR}/python")
    set_tests_properties(${name} PROPERTIES FIXTURES_SETUP example_${folder})
  endforeach()
  add_test(
    NAME example_${folder}_ranks
    COMMAND "${Python3_EXECUTABLE}" "${examplesTest}" compare "${examplesFolder}/${folder}/vdi.json" example_${folder}_np1
            example_${folder}_np4
    WORKING_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}")
  vdi_test_properties(example_${folder}_ranks TIMEOUT 60 LABELS paraview ENVIRONMENT "PYTHONPATH=${CMAKE_BINARY_DIR}/python")
  set_tests_properties(example_${folder}_ranks PROPERTIES FIXTURES_REQUIRED example_${folder})
  add_test(NAME example_${folder}_json COMMAND $<TARGET_FILE:vdi_tool> check "${examplesFolder}/${folder}/vdi.json")
  vdi_test_properties(example_${folder}_json TIMEOUT 20 LABELS paraview)
endfunction()

get_property(examples GLOBAL PROPERTY VDI_EXAMPLES)
foreach(example IN LISTS examples)
  get_property(package GLOBAL PROPERTY VDI_EXAMPLE_MISSES_${example})
  get_property(program GLOBAL PROPERTY VDI_EXAMPLE_${example})
  if(package)
    add_test(NAME example_${example} COMMAND ${CMAKE_COMMAND} -E echo "skipped: Debian's package ${package} is missing")
    vdi_test_properties(example_${example} TIMEOUT 20 LABELS paraview)
    set_tests_properties(example_${example} PROPERTIES SKIP_REGULAR_EXPRESSION "skipped: ")
  elseif(VDI_BUILD_PYTHON)
    vdi_add_example_test(${example} $<TARGET_FILE:${program}>)
  endif()
endforeach()
if(VDI_BUILD_PYTHON)
  vdi_add_example_test(numpy_waves "${Python3_EXECUTABLE}" "${examplesFolder}/numpy_waves/waves.py")
endif()
