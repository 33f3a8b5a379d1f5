// The main of tests on one rank.
#include "tests/Main.h"

int main(int argc, char** argv) {
  return vdi::test::runCases(argc, argv);
}
