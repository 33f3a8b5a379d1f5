/* A simulation in C: one block of 8-bit point data per rank, along x. Arguments: the script, or "-" for none,
 * then the code that each step must return, or CODE*STEPS. Exit status 0 if all did and each failure had a
 * text. Environment: VDI_TEST_INITIALIZE=CODE: initialize returns that, and nothing else happens, unless
 * VDI_TEST_THEN=SCRIPT: initialize with that script succeeds and is finalized.
 * VDI_TEST_WANTS=1010: the answers of vdi_catalyst_wants before the steps.
 * VDI_TEST_LATE=1: finalize is called after MPI_Finalize.
 * VDI_TEST_GROWTH=KIB: the resident memory grows by less from a quarter of the steps to the last.
 * VDI_ISOLATION: the same in processes of their own. */
#include <limits.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"

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

/* While another process makes a frame, the adaptor may not know yet that a step isn't wanted. */
static int wants_in_the_end(vdi_catalyst* catalyst, int step, int wanted) {
  int wants = vdi_catalyst_wants(catalyst, step, 0.5 * step);
  for (int i = 0; is_late && i < 600 && wants > wanted; ++i) {
    usleep(100000);
    wants = vdi_catalyst_wants(catalyst, step, 0.5 * step);
  }
  return wants;
}

/* Impossible blocks are an error, and the earlier blocks stay. */
static int bad_blocks(int rank, vdi_catalyst* catalyst, vdi_catalyst_block good) {
  int wrong = 0;
  vdi_catalyst_block block = good;
  block.spacing[1] = 0.0;
  wrong += expect(rank, "a block without extent", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_blocks(catalyst, 1, &block));
  block = good;
  block.cells[0] = INT_MAX;
  wrong +=
      expect(rank, "INT_MAX cells", VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_set_blocks(catalyst, 1, &block));
  block = good;
  block.cells[0] = block.cells[1] = block.cells[2] = INT_MAX - 1;
  wrong += expect(rank, "cells beyond 64 bits", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_blocks(catalyst, 1, &block));
  block = good;
  block.ghost_lo[0] = block.ghost_hi[0] = INT_MAX;
  wrong += expect(rank, "ghosts that overflow", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_blocks(catalyst, 1, &block));
  block = good;
  block.ghost_lo[2] = N;
  wrong += expect(rank, "nothing but ghosts", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_blocks(catalyst, 1, &block));
  block = good;
  if (rank == 0) {
    block.cells[0] = block.cells[1] = block.cells[2] = 1 << 19;
    block.ghost_lo[0] = 1;
  }
  wrong += expect(rank, "one rank's marks beyond its memory", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_blocks(catalyst, 1, &block));
  return wrong;
}

/* Numbers that ParaView would truncate are refused, so that no file gets a wrong name. */
static int bad_steps(int rank, int ranks, vdi_catalyst* catalyst) {
  const int64_t steps[] = {3000000000, 4294967301, -1};
  int wrong = 0;
  for (int i = 0; i < 3; ++i) {
    wrong += expect(rank, "a step that is no int", VDI_CATALYST_BAD_ARGUMENT,
                    vdi_catalyst_execute(catalyst, steps[i], 0.0));
  }
  if (ranks == 1) return wrong;
  return wrong + expect(rank, "a step that the ranks don't share", VDI_CATALYST_BAD_ARGUMENT,
                        vdi_catalyst_execute(catalyst, rank == 0 ? 8 : 9, 0.0));
}

/* "3*200": 200 steps that return 3. */
static int run_steps(int rank, vdi_catalyst* catalyst, int argc, char** argv) {
  int wrong = 0;
  int total = 0;
  for (int i = 2; i < argc; ++i) total += strchr(argv[i], '*') != NULL ? atoi(strchr(argv[i], '*') + 1) : 1;
  const char* wanted = getenv("VDI_TEST_WANTS");
  int count = 0;
  long before = 0;
  for (int i = 2; i < argc; ++i) {
    for (int left = strchr(argv[i], '*') != NULL ? atoi(strchr(argv[i], '*') + 1) : 1; left > 0; --left) {
      const int step = ++count;
      simulate(rank, step);
      if (wanted != NULL && wanted[count - 1] != '\0')
        wrong += expect(rank, "wants", wanted[count - 1] - '0',
                        wants_in_the_end(catalyst, step, wanted[count - 1] - '0'));
      const int code = vdi_catalyst_execute(catalyst, step, 0.5 * step);
      wrong += expect_step(rank, atoi(argv[i]), code);
      const int told = vdi_catalyst_error(catalyst)[0] != '\0';
      if (code != VDI_CATALYST_OK) wrong += expect(rank, "the error's text", 1, told);
      if (count == total / 4) before = resident_kib();
    }
  }
  const char* maximum = getenv("VDI_TEST_GROWTH");
  if (maximum == NULL) return wrong;
  const long growth = resident_kib() - before;
  printf("rank %d: resident memory grew by %ld KiB in %d steps\n", rank, growth, total - total / 4);
  return wrong + (growth < atol(maximum) ? 0 : expect(rank, "growth of memory", 0, 1));
}

int main(int argc, char** argv) {
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  int wrong = 0;
  if (argc < 3) MPI_Abort(MPI_COMM_WORLD, 2);
  is_late = getenv("VDI_ISOLATION") != NULL;

  vdi_catalyst* catalyst = NULL;
  const char* scripts[] = {argv[1]};
  const char* initialize = getenv("VDI_TEST_INITIALIZE");
  if (initialize != NULL) {
    wrong = expect(rank, "initialize", atoi(initialize),
                   vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, scripts, &catalyst));
    wrong += expect(rank, "the handle of a failed initialize", 1, catalyst == NULL);
    const char* then[] = {getenv("VDI_TEST_THEN")};
    if (then[0] != NULL) {
      const char* nothing[] = {NULL};
      wrong += expect(rank, "initialize without a path", VDI_CATALYST_BAD_ARGUMENT,
                      vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, nothing, &catalyst));
      wrong += expect(rank, "initialize again", VDI_CATALYST_OK,
                      vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, then, &catalyst));
      wrong += expect(rank, "finalize", VDI_CATALYST_OK, vdi_catalyst_finalize(catalyst));
    }
    return end(wrong);
  }
  wrong += expect(rank, "initialize with a wrong handle", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_initialize(12345, 1, scripts, &catalyst));
  const int count = strcmp(argv[1], "-") == 0 ? 0 : 1;
  wrong += expect(
      rank, "initialize", VDI_CATALYST_OK,
      vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), count, count > 0 ? scripts : NULL, &catalyst));
  vdi_catalyst* second = NULL;
  wrong += expect(rank, "a second initialize", VDI_CATALYST_ENGINE,
                  vdi_catalyst_initialize(MPI_Comm_c2f(MPI_COMM_WORLD), 1, scripts, &second));
  wrong += expect(rank, "execute before blocks", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_execute(catalyst, 0, 0.0));

  const vdi_catalyst_block good = {
      {N, N, N}, {0, 0, 0}, {0, 0, 0}, {(double)rank * N, 0.0, 0.0}, {1.0, 1.0, 1.0}};
  const void* data[] = {field};
  wrong += expect(rank, "set_blocks", VDI_CATALYST_OK, vdi_catalyst_set_blocks(catalyst, 1, &good));
  wrong += bad_blocks(rank, catalyst, good);
  wrong += expect(rank, "an unknown type", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_set_array(catalyst, "V", 99, VDI_CATALYST_POINTS, data));
  wrong += expect(rank, "set_array", VDI_CATALYST_OK,
                  vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_U8, VDI_CATALYST_POINTS, data));
  wrong += bad_steps(rank, ranks, catalyst);
  wrong += run_steps(rank, catalyst, argc, argv);
  if (getenv("VDI_TEST_LATE") != NULL) {
    MPI_Finalize();
    wrong += expect(rank, "finalize after MPI_Finalize", VDI_CATALYST_BAD_ARGUMENT,
                    vdi_catalyst_finalize(catalyst));
    return wrong == 0 ? 0 : 1;
  }
  wrong += expect(rank, "a step that is no int is wanted", 0, vdi_catalyst_wants(catalyst, 3000000000, 0.0));
  wrong += expect_end(rank, vdi_catalyst_finalize(catalyst));
  wrong += expect(rank, "a second finalize", VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_finalize(catalyst));
  wrong +=
      expect(rank, "execute after it", VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_execute(catalyst, 1, 0.0));
  wrong += expect(rank, "a step is wanted after it", 0, vdi_catalyst_wants(catalyst, 1, 0.0));
  wrong += expect(rank, "the error's text after it", 0, vdi_catalyst_error(catalyst)[0] != '\0');
  wrong +=
      expect(rank, "execute without a handle", VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_execute(NULL, 1, 0.0));
  return end(wrong);
}
