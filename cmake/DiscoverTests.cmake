# Writes OUTPUT, a file for ctest with a test for each case of the Catch2 program PROGRAM: "NAME:
# case". Where there are RANKS it's a test for each number of them, "NAME_np3", of all cases: to
# start many processes with a device each takes longer than most cases. With SOME_RANKS as many it
# has only the cases of the tag [ranks]; the others are "NAME_np3_rest", whose label is long too. So
# is that of all cases with LONG_RANKS as many. They're started by LAUNCHER (mpiexec ... -n). Each
# test gets TIMEOUT, LABELS and ENVIRONMENT. With LIST_OPTIONS the program lists its cases; NO_TESTS
# is the warning by which it fails where no case has the name. Catch2's own catch_discover_tests knows neither several
# launchers nor lists as properties.
execute_process(
  COMMAND ${CMAKE_COMMAND} -E env ASAN_OPTIONS=detect_leaks=0 "${PROGRAM}" ${LIST_OPTIONS}
  OUTPUT_VARIABLE cases
  OUTPUT_STRIP_TRAILING_WHITESPACE)
if(NOT cases)
  message(FATAL_ERROR "${PROGRAM} lists no tests")
endif()
set(semicolon "<semicolon>") # in a name; else it separates names
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
foreach(ranks IN LISTS SOME_RANKS)
  add("[==[${NAME}_np${ranks}]==]" "${launcher} ${ranks} [==[${PROGRAM}]==] [ranks] --warn ${NO_TESTS}")
endforeach()
set(labels ${LABELS})
list(APPEND LABELS long)
foreach(ranks IN LISTS SOME_RANKS)
  add("[==[${NAME}_np${ranks}_rest]==]" "${launcher} ${ranks} [==[${PROGRAM}]==] ~[ranks] --warn ${NO_TESTS}")
endforeach()
foreach(ranks IN LISTS LONG_RANKS)
  add("[==[${NAME}_np${ranks}]==]" "${launcher} ${ranks} [==[${PROGRAM}]==] --warn ${NO_TESTS}")
endforeach()
set(LABELS ${labels})
if(RANKS)
  set(cases "")
endif()
foreach(case IN LISTS cases)
  string(REPLACE "${semicolon}" ";" case "${case}")
  # What Catch2's command line would take for more than a name.
  string(REGEX REPLACE "([][,\\])" "\\\\\\1" pattern "${case}")
  set(command "[==[${PROGRAM}]==] [==[${pattern}]==] --warn ${NO_TESTS}") # or no match would pass
  add("[==[${NAME}: ${case}]==]" "${command}")
endforeach()
file(WRITE "${OUTPUT}" "${tests}")
