/* A simulation in C: one block of 8-bit point data a rank, along x. Arguments: the script, then the code that
 * each step must return. Exit status 0 if all did and the error's text was there just when it had to be. */
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>

#include "catalyst_adaptor/vdi_catalyst.h"

enum { N = 16 };

static unsigned char field[N + 1][N + 1][N + 1];

static void simulate(int rank, int step) {
  for (int z = 0; z <= N; ++z) {
    for (int y = 0; y <= N; ++y) {
      for (int x = 0; x <= N; ++x) {
        const int dx = x + rank * N - N;
        const int dy = y - N / 2;
        const int dz = z - N / 2;
        const int value = 250 - 2 * (dx * dx + dy * dy + dz * dz) - 10 * step;
        field[z][y][x] = (unsigned char)(value < 0 ? 0 : value);
      }
    }
  }
}

static int expect(int rank, const char* what, int wanted, int code) {
  if (code == wanted) return 0;
  fprintf(stderr, "rank %d: %s returned %d, not %d\n", rank, what, code, wanted);
  return 1;
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  int wrong = 0;
  if (argc < 3) MPI_Abort(MPI_COMM_WORLD, 2);

  vdi_catalyst* catalyst = NULL;
  const char* scripts[] = {argv[1]};
  wrong += expect(rank, "initialize with a wrong handle", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_initialize(12345, 1, scripts, &catalyst));
  wrong += expect(rank, "initialize", VDI_CATALYST_OK,
                  vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, scripts, &catalyst));
  vdi_catalyst* second = NULL;
  wrong += expect(rank, "a second initialize", VDI_CATALYST_ENGINE,
                  vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, scripts, &second));
  wrong += expect(rank, "execute before blocks", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_execute(catalyst, 0, 0.0));

  vdi_catalyst_block block = {{N, N, N}, {0, 0, 0}, {0, 0, 0}, {(double)rank * N, 0.0, 0.0}, {1.0, 1.0, 1.0}};
  const vdi_catalyst_block good = block;
  const void* data[] = {field};
  block.spacing[1] = 0.0;
  wrong += expect(rank, "a block without extent", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_blocks(catalyst, 1, &block));
  wrong += expect(rank, "set_blocks", VDI_CATALYST_OK, vdi_catalyst_set_blocks(catalyst, 1, &good));
  wrong += expect(rank, "an unknown type", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_array(catalyst, "V", 99, VDI_CATALYST_POINTS, data));
  wrong += expect(rank, "set_array", VDI_CATALYST_OK,
                  vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_U8, VDI_CATALYST_POINTS, data));
  for (int step = 1; step <= argc - 2; ++step) {
    simulate(rank, step);
    const int code = vdi_catalyst_execute(catalyst, step, 0.5 * step);
    wrong += expect(rank, "execute", atoi(argv[step + 1]), code);
    const int told = vdi_catalyst_error(catalyst)[0] != '\0';
    if (code != VDI_CATALYST_OK) wrong += expect(rank, "the error's text", 1, told);
  }
  vdi_catalyst_finalize(catalyst);
  wrong +=
      expect(rank, "execute without a handle", VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_execute(NULL, 1, 0.0));
  MPI_Allreduce(MPI_IN_PLACE, &wrong, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  MPI_Finalize();
  return wrong == 0 ? 0 : 1;
}
