# Writes a header OUTPUT with the short commit of SOURCE_DIR. The commit is "unknown" outside a
# checkout, and ends in "-dirty" with uncommitted changes.
execute_process(
  COMMAND git describe --always --dirty --exclude=*
  WORKING_DIRECTORY "${SOURCE_DIR}"
  OUTPUT_VARIABLE commit
  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT commit)
  set(commit "unknown")
endif()
set(text "#pragma once\ninline constexpr const char* buildCommit = \"${commit}\";\n")
set(existing "")
if(EXISTS "${OUTPUT}")
  file(READ "${OUTPUT}" existing)
endif()
if(NOT text STREQUAL existing)
  file(WRITE "${OUTPUT}" "${text}")
endif()
