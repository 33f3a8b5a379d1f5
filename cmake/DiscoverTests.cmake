# Writes OUTPUT, a file for ctest. It has a test "NAME: case" for each case of the Catch2 program
# PROGRAM. If TAGS is set, the cases that have such a tag run together in one process instead, as the
# test "NAME_tag" with the tag as a label, and those without any as the test "NAME": compiling shaders
# again for each case takes longer than most cases. If RANKS is set, there is a test "NAME_np3" of
# all cases for each number of ranks, for the same reason. For the numbers in LONG_RANKS this test
# has the additional label long. For the others, cases with the tag long are in "NAME_long_np3".
# LAUNCHER (mpiexec ... -n) starts programs on several ranks. Each test gets TIMEOUT, LABELS and
# ENVIRONMENT. LIST_OPTIONS make the program list its cases. NO_TESTS is the warning that makes it
# fail if no case has the given name. Catch2's own catch_discover_tests supports neither several
# launchers nor lists as properties.
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
# add_group(<test> <pattern of cases> [ranks])
function(add_group test pattern)
  set(command "[==[${PROGRAM}]==] [==[${pattern}]==] --warn ${NO_TESTS}")
  if(${ARGC} GREATER 2)
    add("[==[${test}_np${ARGV2}]==]" "${launcher} ${ARGV2} ${command}")
  else()
    add("[==[${test}]==]" "${command}")
  endif()
  set(tests "${tests}" PARENT_SCOPE)
endfunction()
set(labels ${LABELS})
set(usual "*")
list(FIND TAGS long found)
if(found GREATER -1)
  set(usual "~[long]")
endif()
foreach(ranks IN LISTS RANKS)
  add_group(${NAME} "${usual}" ${ranks})
endforeach()
set(LABELS ${labels} long)
foreach(ranks IN LISTS LONG_RANKS)
  add_group(${NAME} "*" ${ranks})
endforeach()
if(NOT usual STREQUAL "*")
  foreach(ranks IN LISTS RANKS)
    add_group(${NAME}_long "[long]" ${ranks})
  endforeach()
endif()
set(LABELS ${labels})
if(TAGS AND NOT RANKS)
  set(untagged "")
  foreach(tag IN LISTS TAGS)
    set(LABELS ${labels} ${tag})
    add_group(${NAME}_${tag} "[${tag}]")
    string(APPEND untagged "~[${tag}]")
  endforeach()
  set(LABELS ${labels})
  add_group(${NAME} "${untagged}")
endif()
if(RANKS OR TAGS)
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
