/* A simulation in C: a slab of the unit cube's cells per rank, along x, and one step. Its argument is the
 * script. */
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <vdi_catalyst.h>

enum { N = 16 };

static float field[N][N][N];

static void must(int code) {
  if (code == VDI_CATALYST_OK) return;
  fprintf(stderr, "FAILED with code %d\n", code);
  MPI_Abort(MPI_COMM_WORLD, 1);
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0;
  int size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  for (int z = 0; z < N; ++z) {
    for (int y = 0; y < N; ++y) {
      for (int x = 0; x < N; ++x) field[z][y][x] = (float)((x + rank * N) * (y + 1) + z);
    }
  }
  const double width = 1.0 / (N * size);
  const vdi_catalyst_block block = {
      {N, N, N}, {0, 0, 0}, {0, 0, 0}, {rank * N * width, 0.0, 0.0}, {width, 1.0 / N, 1.0 / N}};
  const void* data[] = {field};
  const char* scripts[] = {argc > 1 ? argv[1] : ""};
  vdi_catalyst* catalyst = NULL;
  must(vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, scripts, &catalyst));
  must(vdi_catalyst_set_blocks(catalyst, 1, &block));
  must(vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_CELLS, data));
  must(vdi_catalyst_execute(catalyst, 1, 0.5));
  must(vdi_catalyst_finalize(catalyst));
  MPI_Finalize();
  return 0;
}
