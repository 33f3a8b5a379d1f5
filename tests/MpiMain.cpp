// Catch2's main for tests that run under mpirun: every rank runs every test case, in the same order. A rank
// whose test failed makes the whole run fail.
#include <mpi.h>

#define CATCH_CONFIG_RUNNER
#include "tests/Catch.h"
#include "tests/Devices.h"

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int result = Catch::Session().run(argc, argv);
  vdi::test::keptDevices() = {};
  int worst = 0;
  MPI_Allreduce(&result, &worst, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  MPI_Finalize();
  return worst;
}
