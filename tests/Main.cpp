// Catch2's main.
#define CATCH_CONFIG_RUNNER
#include "tests/Catch.h"

int main(int argc, char** argv) {
  return Catch::Session().run(argc, argv);
}
