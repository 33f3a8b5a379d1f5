// Catch2's main.
#define CATCH_CONFIG_RUNNER
#include "tests/Catch.h"
#include "tests/Devices.h"

int main(int argc, char** argv) {
  const int result = Catch::Session().run(argc, argv);
  vdi::test::keptDevices() = {};
  return result;
}
