/* A simulation of particles: a hump of them moves through the unit cube. The cube has 2 x 2 x 2
 * blocks of 8 cells per axis. Blocks are assigned to the ranks in one way and particles in another.
 * The last of several ranks has no particles. Arguments: a JSON text or file (or a script, which
 * ends in .py), then the code that each step must return. The array's name is V. Exit status 0 if
 * all calls return what they should. VDI_TEST_FAULTS=1: there are also particles that can't be
 * deposited. VDI_TEST_LENGTHS=1: half of the particles have smoothing lengths of two cells, and the
 * array's values lie off the middles of cells. */
#include <math.h>
#include <mpi.h>
#include <stdlib.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"

enum { COUNT = 4000, FAULTS = 6, N = 8 };

typedef struct particle {
  double position[3];
  float weight;
  float length;
} particle;

static particle particles[COUNT + FAULTS];

/* A random number from -1 to 1, the same on all ranks. */
static double random_number(uint64_t* state) {
  *state = *state * 6364136223846793005U + 1442695040888963407U;
  return (double)(*state >> 11U) / (double)(1ULL << 52U) - 1.0;
}

/* Returns the number of this rank's particles. */
static int simulate(int rank, int ranks, int step) {
  uint64_t state = 7;
  int count = 0;
  const int dealt_to = ranks > 1 ? ranks - 1 : 1;
  for (int i = 0; i < COUNT; ++i) {
    particle one;
    for (int axis = 0; axis < 3; ++axis) {
      const double r = random_number(&state);
      one.position[axis] = 0.5 + 0.35 * r * fabs(r) + (axis == 0 ? 0.02 * step : 0.0);
    }
    one.weight = 1.2e-5F;
    one.length = i % 2 == 0 ? 0.125F : 0.01F;
    if (i * 7 / 3 % dealt_to == rank) particles[count++] = one;
  }
  if (getenv("VDI_TEST_FAULTS") == NULL || rank != 0) return count;
  for (int i = 0; i < FAULTS; ++i) particles[count + i] = (particle){{0.5, 0.5, 0.5}, 1e-5F, 0.125F};
  particles[count + 0].position[1] = (double)NAN;
  particles[count + 1].weight = INFINITY;
  particles[count + 2].position[0] = 1.5;
  particles[count + 3].length = 0.0F;
  particles[count + 4].length = -1.0F;
  particles[count + 5].length = NAN;
  return count + FAULTS;
}

static vdi_catalyst_particles described(int count) {
  const particle* p = particles;
  vdi_catalyst_particles all = {0};
  all.count = count;
  all.kind = VDI_CATALYST_DENSITY;
  all.position_type = VDI_CATALYST_F64;
  for (int axis = 0; axis < 3; ++axis) all.positions[axis] = &p->position[axis];
  all.position_stride = sizeof(particle);
  all.weights = &p->weight;
  all.weight_type = VDI_CATALYST_F32;
  all.weight_stride = sizeof(particle);
  if (getenv("VDI_TEST_LENGTHS") != NULL || getenv("VDI_TEST_FAULTS") != NULL) all.lengths = &p->length;
  all.length_type = VDI_CATALYST_F32;
  all.length_stride = sizeof(particle);
  return all;
}

static int refused(vdi_catalyst* catalyst, int rank, const char* what, const char* name,
                   const vdi_catalyst_particles* given) {
  return expect(rank, what, VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_set_particles(catalyst, name, given));
}

static int refuse_bad(vdi_catalyst* catalyst, int rank, int ranks) {
  const vdi_catalyst_particles good = described(1);
  int wrong = refused(catalyst, rank, "no name", NULL, &good);
  wrong += refused(catalyst, rank, "an empty name", "", &good);
  wrong += refused(catalyst, rank, "no particles", "V", NULL);
  wrong += refused(NULL, rank, "no handle", "V", &good);
  vdi_catalyst_particles bad = good;
  bad.count = -1;
  wrong += refused(catalyst, rank, "a negative count", "V", &bad);
  bad = good;
  bad.kind = 7;
  wrong += refused(catalyst, rank, "an unknown kind", "V", &bad);
  bad = good;
  bad.position_type = VDI_CATALYST_I32;
  wrong += refused(catalyst, rank, "integer positions", "V", &bad);
  bad = good;
  bad.weight_type = VDI_CATALYST_U8;
  wrong += refused(catalyst, rank, "weights of a byte", "V", &bad);
  bad = good;
  bad.positions[2] = NULL;
  wrong += refused(catalyst, rank, "no z", "V", &bad);
  bad = good;
  bad.count = INT64_MAX;
  wrong += refused(catalyst, rank, "more particles than memory", "V", &bad);
  bad = good;
  bad.count = 3;
  bad.weight_stride = INT64_MIN / 2;
  wrong += refused(catalyst, rank, "weights below address 0", "V", &bad);
  /* If one rank's arguments are wrong, all ranks refuse the call. */
  bad = good;
  if (rank == ranks - 1) bad.count = -1;
  wrong += refused(catalyst, rank, "a negative count on one rank", "V", &bad);
  if (ranks == 1) return wrong;
  bad = good;
  if (rank == 0) bad.kind = VDI_CATALYST_SUM;
  wrong += refused(catalyst, rank, "two kinds", "V", &bad);
  wrong += refused(catalyst, rank, "two names", rank == 0 ? "V" : "W", &good);
  return wrong;
}

int main(int argc, char** argv) {
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  if (argc < 2) MPI_Abort(MPI_COMM_WORLD, 2);

  vdi_catalyst* catalyst = NULL;
  int wrong = expect(rank, "initialize", VDI_CATALYST_OK, initialize_any(argv[1], &catalyst));
  const vdi_catalyst_particles before = described(1);
  wrong += refused(catalyst, rank, "particles before blocks", "V", &before);

  vdi_catalyst_block blocks[8];
  int count = 0;
  for (int i = 0; i < 8; ++i) {
    if ((i * 5 + 3) / 2 % ranks != rank) continue;
    const vdi_catalyst_block block = {{N, N, N},
                                      {0, 0, 0},
                                      {0, 0, 0},
                                      {0.5 * (i & 1), 0.5 * (i >> 1 & 1), 0.5 * (i >> 2)},
                                      {0.5 / N, 0.5 / N, 0.5 / N}};
    blocks[count++] = block;
  }
  wrong += expect(rank, "set_blocks", VDI_CATALYST_OK, vdi_catalyst_set_blocks(catalyst, count, blocks));
  wrong += refuse_bad(catalyst, rank, ranks);
  if (getenv("VDI_TEST_LENGTHS") != NULL) {
    const double offset[] = {0.25, 0.0, -0.5};
    wrong += expect(rank, "an offset", VDI_CATALYST_OK,
                    vdi_catalyst_set_array_offset(catalyst, "V", VDI_CATALYST_CELLS, offset));
  }

  /* Particles replace an array, and an array replaces particles. */
  static double zeros[N * N * N];
  const void* data[8];
  for (int i = 0; i < 8; ++i) data[i] = zeros;
  vdi_catalyst_particles given = described(simulate(rank, ranks, 0));
  wrong += expect(rank, "particles", VDI_CATALYST_OK, vdi_catalyst_set_particles(catalyst, "V", &given));
  wrong += expect(rank, "an array", VDI_CATALYST_OK,
                  vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F64, VDI_CATALYST_CELLS, data));

  for (int step = 0; step < argc - 2; ++step) {
    given = described(simulate(rank, ranks, step));
    wrong += expect(rank, "particles", VDI_CATALYST_OK, vdi_catalyst_set_particles(catalyst, "V", &given));
    wrong += expect(rank, "execute", atoi(argv[step + 2]), vdi_catalyst_execute(catalyst, step, 0.5 * step));
  }
  wrong += expect(rank, "finalize", VDI_CATALYST_OK, vdi_catalyst_finalize(catalyst));
  wrong += refused(catalyst, rank, "particles after finalize", "V", &given);
  return end(wrong);
}
