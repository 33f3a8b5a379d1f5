// The main of tests that run under mpirun: every rank runs every test case, in the same order. A rank whose
// test failed makes the whole run fail.
#include <mpi.h>

#include "tests/Main.h"

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  const int result = vdi::test::runCases(argc, argv);
  int worst = 0;
  MPI_Allreduce(&result, &worst, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  MPI_Finalize();
  return worst;
}
