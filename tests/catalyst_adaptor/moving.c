/* Blocks that come, go, move, and change size, spacing and rank at each step. Checks that the memory of the
 * process that makes the frames doesn't grow, be it this one or a separate one. Arguments: the number of
 * frames and, instead of a JSON text of its own, a script. In the folder VDI_OUTPUT each frame's file
 * replaces an older one. The blocks of a step are those of 20 steps before. A fifth of the frames, in which
 * memory may grow, therefore includes the largest frame. VDI_ENDURANCE_FRAMES in the environment replaces the
 * number.
 */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"
#include "tests/catalyst_adaptor/worker.h"

enum { PERIOD = 20, SIDE = 4, COARSE = 6, FINE = 12, MAX_VALUES = FINE * FINE * FINE };
enum { UNDER_WAY = 2 }; /* frames that separate processes may have under way */

static float values[SIDE * SIDE * SIDE][MAX_VALUES];

/* A hash of the step and the place, the same on all ranks. */
static unsigned hash(unsigned step, unsigned place) {
  unsigned x = step * 2654435761U + place * 40503U + 12345U;
  x ^= x >> 15;
  x *= 2246822519U;
  return x ^ (x >> 13);
}

static double field(double x, double y, double z, int step) {
  return 0.5 + 0.5 * sin(9.0 * x + 0.1 * step) * sin(8.0 * y) * sin(7.0 * z);
}

/* This rank's blocks of a step: each cell of a grid of 4 x 4 x 4 is missing, coarse or fine. */
static int place_blocks(int step, int rank, int ranks, vdi_catalyst_block* blocks, const void** data) {
  int count = 0;
  for (int place = 0; place < SIDE * SIDE * SIDE; ++place) {
    const unsigned h = hash((unsigned)step, (unsigned)place);
    if (h % 8 == 0 || (int)(h / 8 % (unsigned)ranks) != rank) continue;
    const int cells = h / 64 % 2 == 0 ? COARSE : FINE;
    const int at[3] = {place % SIDE, place / SIDE % SIDE, place / (SIDE * SIDE)};
    vdi_catalyst_block* block = &blocks[count];
    memset(block, 0, sizeof *block);
    for (int axis = 0; axis < 3; ++axis) {
      block->cells[axis] = cells;
      block->spacing[axis] = 1.0 / (SIDE * cells);
      block->origin[axis] = (double)at[axis] / SIDE + 0.01 * step;
    }
    for (int z = 0; z < cells; ++z) {
      for (int y = 0; y < cells; ++y) {
        for (int x = 0; x < cells; ++x) {
          const double* o = block->origin;
          const double s = block->spacing[0];
          values[count][(z * cells + y) * cells + x] =
              (float)field(o[0] + (x + 0.5) * s, o[1] + (y + 0.5) * s, o[2] + (z + 0.5) * s, step);
        }
      }
    }
    data[count] = values[count];
    ++count;
  }
  return count;
}

/* The resident memory of the processes that serve this rank, in KiB. */
static long memory(int rank) {
  if (getenv("VDI_ISOLATION") == NULL) return resident_kib();
  const pid_t worker = worker_of(rank);
  if (worker == 0) {
    fprintf(stderr, "rank %d has no worker\n", rank);
    MPI_Abort(MPI_COMM_WORLD, 3);
  }
  return resident_kib() + resident_kib_of(worker);
}

int main(int argc, char** argv) {
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  if (argc < 2) MPI_Abort(MPI_COMM_WORLD, 2);
  const char* asked = getenv("VDI_ENDURANCE_FRAMES");
  const int frames = atoi(asked != NULL ? asked : argv[1]);
  vdi_catalyst* catalyst = NULL;
  const char* what = argc > 2
                         ? argv[2]
                         : "{\"field\": \"V\", \"resolution\": [64, 48], \"colors\": {\"range\": [0, 1]},"
                           " \"output\": \"moving_{timestep}.vdi\", \"existing\": \"overwrite\"}";
  int wrong = initialize_any(what, &catalyst) != VDI_CATALYST_OK;
  static vdi_catalyst_block blocks[SIDE * SIDE * SIDE];
  static const void* data[SIDE * SIDE * SIDE];
  long early = 0;
  for (int step = 0; step < frames && wrong == 0; ++step) {
    const int count = place_blocks(step % PERIOD, rank, ranks, blocks, data);
    wrong += vdi_catalyst_set_blocks(catalyst, count, blocks) != VDI_CATALYST_OK;
    wrong +=
        vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_CELLS, data) != VDI_CATALYST_OK;
    wrong += vdi_catalyst_execute(catalyst, step, step) != VDI_CATALYST_OK;
    if (rank == 0 && step >= UNDER_WAY) {
      char name[64];
      snprintf(name, sizeof name, "moving_%d.vdi", step - UNDER_WAY);
      wrong += unlink(name) != 0;
    }
    if (step == frames / 5) early = memory(rank);
  }
  const long late = memory(rank);
  wrong += vdi_catalyst_finalize(catalyst) != VDI_CATALYST_OK;
  printf("rank %d: %ld KiB after a fifth of %d frames, %ld KiB after all\n", rank, early, frames, late);
  /* A leak of a hundred bytes per frame shows in 10 000 frames; fewer reveal larger leaks. */
  if (early > 0 && late - early > 2048) {
    fprintf(stderr, "rank %d: the memory has grown by %ld KiB\n", rank, late - early);
    ++wrong;
  }
  return end(wrong);
}
