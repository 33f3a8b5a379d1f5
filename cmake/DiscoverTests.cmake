# Writes OUTPUT, a file for ctest. It has a test "NAME: case" for each case of the Catch2 program
# PROGRAM. If RANKS is set, it has a test "NAME_np3" of all cases for each number of ranks instead,
# because starting many processes with a device each takes longer than most cases. For the numbers
# in LONG_RANKS this test has the additional label long. LAUNCHER (mpiexec ... -n) starts programs on
# several ranks. Each test gets TIMEOUT, LABELS and ENVIRONMENT. LIST_OPTIONS make the program list
# its cases. NO_TESTS is the warning that makes it fail if no case has the given name. Catch2's own
# catch_discover_tests supports neither several launchers nor lists as properties.
execute_process(
  COMMAND ${CMAKE_COMMAND} -E env ASAN_OPTIONS=detect_leaks=0 "${PROGRAM}" ${LIST_OPTIONS}
  OUTPUT_VARIABLE cases
  OUTPUT_STRIP_TRAILING_WHITESPACE)
if(NOT cases)
  message(FATAL_ERROR "${PROGRAM} lists no tests")
endif()
set(semicolon "<semicolon>") # replaces a semicolon in a name, because others separate names
string(REPLACE ";" "${semicolon}" cases "${cases}")
string(REPLACE "\n" ";" cases "${cases}")

set(tests "")
# add(<test> <arguments of add_test, written as in the file>)
function(add test command)
  set(tests
      "${tests}add_test(${test} ${command})
set_tests_properties(${test} PROPERTIES TIMEOUT ${TIMEOUT} LABELS [==[${LABELS}]==] ENVIRONMENT [==[${ENVIRONMENT}]==])\n"
      PARENT_SCOPE)
endfunction()

list(JOIN LAUNCHER " " launcher)
foreach(ranks IN LISTS RANKS)
  add("[==[${NAME}_np${ranks}]==]" "${launcher} ${ranks} [==[${PROGRAM}]==] --warn ${NO_TESTS}")
endforeach()
set(labels ${LABELS})
list(APPEND LABELS long)
foreach(ranks IN LISTS LONG_RANKS)
  add("[==[${NAME}_np${ranks}]==]" "${launcher} ${ranks} [==[${PROGRAM}]==] --warn ${NO_TESTS}")
endforeach()
set(LABELS ${labels})
if(RANKS)
  set(cases "")
endif()
foreach(case IN LISTS cases)
  string(REPLACE "${semicolon}" ";" case "${case}")
  # Escapes characters that Catch2's command line would interpret.
  string(REGEX REPLACE "([][,\\])" "\\\\\\1" pattern "${case}")
  set(command "[==[${PROGRAM}]==] [==[${pattern}]==] --warn ${NO_TESTS}") # otherwise a name without a match would pass
  add("[==[${NAME}: ${case}]==]" "${command}")
endforeach()
file(WRITE "${OUTPUT}" "${tests}")
