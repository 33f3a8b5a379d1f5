# The examples on two ranks and, as long tests, on one and with frames made in separate processes.
# Each runs with the adaptor and without it. Its result is the same both times, bit for bit, and on
# any number of ranks. An example is skipped if its Debian package is missing.
set(examplesTest "${CMAKE_CURRENT_SOURCE_DIR}/examples.py")
set(examplesFolder "${CMAKE_SOURCE_DIR}/catalyst_adaptor/examples")

# vdi_compare_examples(<test> <folder> <one> <other>): compares the runs of two tests, which must
# have run.
function(vdi_compare_examples test folder one other)
  add_test(
    NAME ${test}
    COMMAND "${Python3_EXECUTABLE}" "${examplesTest}" compare "${examplesFolder}/${folder}/vdi.json" ${one} ${other}
    WORKING_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}")
  vdi_test_properties(${test} TIMEOUT 60 LABELS paraview ENVIRONMENT "PYTHONPATH=${CMAKE_BINARY_DIR}/python")
  set_tests_properties(${test} PROPERTIES FIXTURES_REQUIRED "${one}_done;${other}_done")
endfunction()

# vdi_add_example_test(<folder> program...)
function(vdi_add_example_test folder)
  set(example example_${folder})
  foreach(run np1 np2 isolated)
    set(name ${example}_${run})
    set(ranks 2)
    set(variables "PYTHONPATH=${CMAKE_BINARY_DIR}/python")
    if(run STREQUAL np1)
      set(ranks 1)
    elseif(run STREQUAL isolated)
      list(APPEND variables VDI_ISOLATION=process)
    endif()
    add_test(
      NAME ${name}
      COMMAND
        ${CMAKE_COMMAND} -E env --unset=DISPLAY "${Python3_EXECUTABLE}" "${examplesTest}" run
        "${CMAKE_CURRENT_BINARY_DIR}/${name}" "${examplesFolder}/${folder}/vdi.json" "${MPIEXEC_EXECUTABLE}" --oversubscribe
        ${MPIEXEC_NUMPROC_FLAG} ${ranks} ${ARGN})
    vdi_test_properties(${name} TIMEOUT 120 LABELS paraview ENVIRONMENT ${variables})
    set_tests_properties(${name} PROPERTIES FIXTURES_SETUP ${name}_done)
  endforeach()
  vdi_compare_examples(${example}_ranks ${folder} ${example}_np1 ${example}_np2)
  vdi_compare_examples(${example}_isolated_same ${folder} ${example}_np2 ${example}_isolated)
  set_tests_properties(${example}_np1 ${example}_ranks ${example}_isolated ${example}_isolated_same
                       PROPERTIES LABELS "paraview;long")
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
