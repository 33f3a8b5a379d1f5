// Catch2's own code, which takes a long time to compile.
#define CATCH_CONFIG_RUNNER
#include "tests/Catch.h"
#include "tests/Devices.h"
#include "tests/Main.h"

int vdi::test::runCases(int argc, char** argv) {
  const int result = Catch::Session().run(argc, argv);
  keptDevices() = {};
  return result;
}
