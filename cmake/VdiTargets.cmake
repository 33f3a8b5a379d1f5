# Functions that define the project's libraries, programs and tests, with the same warnings and
# sanitizers.

# A unity build compiles sources that it includes, and the compiler takes these for headers.
set(VDI_UNITY_OPTIONS "")
if(CMAKE_UNITY_BUILD)
  set(VDI_UNITY_OPTIONS "$<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>")
endif()

# GCC 10 warns of each memcpy to a struct whose members have default values. Newer ones warn only of
# structs that aren't trivially copyable.
set(VDI_COMPILER_OPTIONS "")
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 11)
  set(VDI_COMPILER_OPTIONS "$<$<COMPILE_LANGUAGE:CXX>:-Wno-class-memaccess>")
endif()

# Adds warnings and sanitizers to a target of this project.
function(vdi_target_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow ${VDI_COMPILER_OPTIONS}
                                           ${VDI_UNITY_OPTIONS})
  target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}>")
  if(VDI_SANITIZE)
    # AddressSanitizer finds null pointers and ends of objects, too. Checking them twice slows the compiler down.
    target_compile_options(${target} PUBLIC -fsanitize=${VDI_SANITIZE} -fno-sanitize=null,object-size -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${VDI_SANITIZE})
  endif()
endfunction()

# vdi_add_library(core SOURCES ... [LINK public libraries] [LINK_PRIVATE libraries]): defines the
# static library vdi_core with the alias vdi::core.
function(vdi_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LINK;LINK_PRIVATE")
  add_library(vdi_${name} STATIC ${arg_SOURCES})
  add_library(vdi::${name} ALIAS vdi_${name})
  target_link_libraries(vdi_${name} PUBLIC ${arg_LINK} PRIVATE ${arg_LINK_PRIVATE})
  vdi_target_options(vdi_${name})
endfunction()

# The environment of all tests. It allows mpirun as root in a container, and keeps ranks on few
# cores from disturbing each other.
set(VDI_TEST_ENVIRONMENT OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
                         OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_btl_vader_single_copy_mechanism=none)

# vdi_time_limit(<variable> seconds): sets the variable to a test's time limit. Sanitized code takes
# several times as long, so the limit is ten times as long there.
function(vdi_time_limit variable seconds)
  if(VDI_SANITIZE)
    math(EXPR seconds "10 * ${seconds}")
  endif()
  set(${variable} "${seconds}" PARENT_SCOPE)
endfunction()

# vdi_add_catch_test(core SOURCES ... LINK ... [RANKS 3] [LONG_RANKS 5] [TAGS long] [TIMEOUT
# seconds] [LABELS ...]): defines the program test_<name> with tests/Main.cpp (or tests/MpiMain.cpp
# if RANKS is given), and a ctest for each of its cases, tags or rank counts; see
# cmake/DiscoverTests.cmake. Each test has a time limit.
function(vdi_add_catch_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "TIMEOUT" "SOURCES;LINK;RANKS;LONG_RANKS;TAGS;LABELS;ENVIRONMENT")
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  vdi_time_limit(arg_TIMEOUT "${arg_TIMEOUT}")
  add_executable(test_${name} ${arg_SOURCES})
  if(arg_RANKS)
    target_link_libraries(test_${name} PRIVATE vdi_test_mpi_main MPI::MPI_CXX ${arg_LINK})
  else()
    target_link_libraries(test_${name} PRIVATE vdi_test_main ${arg_LINK})
  endif()
  vdi_target_options(test_${name})
  target_compile_options(test_${name} PRIVATE $<$<CONFIG:Release>:-O1>) # compiles faster; the tested code is optimised
  if("core" IN_LIST arg_LABELS)
    add_dependencies(core_tests test_${name})
  endif()
  set(tests "${CMAKE_CURRENT_BINARY_DIR}/${name}_tests.cmake")
  add_custom_command(
    TARGET test_${name}
    POST_BUILD
    COMMAND
      ${CMAKE_COMMAND} -D "NAME=${name}" -D "PROGRAM=$<TARGET_FILE:test_${name}>" -D "RANKS=${arg_RANKS}" -D
      "LONG_RANKS=${arg_LONG_RANKS}" -D "TAGS=${arg_TAGS}" -D
      "LAUNCHER=${MPIEXEC_EXECUTABLE};--oversubscribe;${MPIEXEC_NUMPROC_FLAG}" -D "TIMEOUT=${arg_TIMEOUT}" -D
      "LABELS=${arg_LABELS}" -D "ENVIRONMENT=${VDI_TEST_ENVIRONMENT};${arg_ENVIRONMENT}" -D "LIST_OPTIONS=${VDI_CATCH_LIST}" -D
      "NO_TESTS=${VDI_CATCH_NO_TESTS}" -D "OUTPUT=${tests}" -P
      "${CMAKE_SOURCE_DIR}/cmake/DiscoverTests.cmake"
    BYPRODUCTS "${tests}"
    VERBATIM)
  # Until the program is built, a failing test takes its place.
  file(CONFIGURE OUTPUT ${name}_include.cmake CONTENT "if(EXISTS \"${tests}\")
  include(\"${tests}\")
else()
  add_test(${name}_not_built ${name}_not_built)
endif()
" @ONLY)
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${CMAKE_CURRENT_BINARY_DIR}/${name}_include.cmake")
endfunction()

# vdi_virtual_screen(<variable>): sets the variable to a command prefix that runs a command with an
# X server. Each server starts its search for a number elsewhere, because a server that is still
# ending removes the socket of a new one with the same number. A server doesn't reset when its last
# client leaves (-noreset). Otherwise a rank that connects at that moment would find no server.
function(vdi_virtual_screen variable)
  find_program(XVFB_RUN xvfb-run REQUIRED)
  get_property(screens GLOBAL PROPERTY VDI_VIRTUAL_SCREENS)
  math(EXPR screens "${screens} + 1")
  set_property(GLOBAL PROPERTY VDI_VIRTUAL_SCREENS ${screens})
  math(EXPR number "200 + 10 * ${screens}")
  set(${variable} "${XVFB_RUN}" -a -n ${number} -s "-screen 0 1280x1024x24 -noreset" PARENT_SCOPE)
endfunction()

# vdi_test_properties(<test> TIMEOUT seconds [LABELS ...] [ENVIRONMENT ...]): sets these properties,
# and adds the environment of all tests.
function(vdi_test_properties test)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "TIMEOUT" "LABELS;ENVIRONMENT")
  vdi_time_limit(arg_TIMEOUT "${arg_TIMEOUT}")
  set_tests_properties(
    ${test} PROPERTIES TIMEOUT "${arg_TIMEOUT}" LABELS "${arg_LABELS}" ENVIRONMENT
                       "${VDI_TEST_ENVIRONMENT};${arg_ENVIRONMENT}")
endfunction()
