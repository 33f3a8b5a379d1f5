/* A simulation whose values lie in memory in orders other than VTK's. Argument: the script, which compares
 * each array with "plain", an array with the same values in VTK's order. Exit status 0 if all went well and
 * the array "in order" was used in place, so that the script's writes reached it. With VDI_ISOLATION in the
 * environment, they must not reach it. */
#include <limits.h>
#include <mpi.h>
#include <stdlib.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"

enum { NX = 20, NY = 17, NZ = 18, HALO = 2, PAD = 3, SIZE = sizeof(double) };

static double plain[NZ][NY][NX];
static double in_order[NZ][NY][NX];
static double planes[3][NZ][NY][NX]; /* a vector's components, one behind the other */
static double interleaved[NZ][NY][NX][2];
static double padded[NZ][NY][NX + PAD];
static double z_fastest[NX][NY][NZ];
static double with_halo[NZ + 2 * HALO][NY + 2 * HALO][NX + 2 * HALO];
static double backwards[NZ][NY][NX];
static struct __attribute__((packed)) {
  char what;
  double value;
} packed[NZ][NY][NX];
static int64_t integers[NX][NY][NZ];

static int rank = 0;
static int wrong = 0;

static void check(const char* what, int wanted, int code) {
  wrong += expect(rank, what, wanted, code);
}

static void simulate(int step) {
  for (size_t i = 0; i < sizeof with_halo / SIZE; ++i) (&with_halo[0][0][0])[i] = 1e30; /* never to be read */
  for (int z = 0; z < NZ; ++z) {
    for (int y = 0; y < NY; ++y) {
      for (int x = 0; x < NX; ++x) {
        const double value = 1000 * step + (x + rank * NX) + 0.25 * y * z;
        plain[z][y][x] = in_order[z][y][x] = value;
        for (int c = 0; c < 3; ++c) planes[c][z][y][x] = value + c;
        interleaved[z][y][x][0] = -1e30;
        interleaved[z][y][x][1] = padded[z][y][x] = z_fastest[x][y][z] = value;
        with_halo[z + HALO][y + HALO][x + HALO] = packed[z][y][x].value = value;
        backwards[NZ - 1 - z][NY - 1 - y][NX - 1 - x] = value;
        integers[x][y][z] = (int64_t)(4 * value) + (INT64_C(1) << 40);
      }
    }
  }
}

static int set(vdi_catalyst* catalyst, const char* name, int type, int components, const void* first,
               int64_t x, int64_t y, int64_t z, int64_t component) {
  const vdi_catalyst_strides strides = {{x, y, z}, component};
  return vdi_catalyst_set_array_strided(catalyst, name, type, VDI_CATALYST_CELLS, components, &first,
                                        &strides);
}

static void set_arrays(vdi_catalyst* catalyst) {
  const int f64 = VDI_CATALYST_F64;
  const void* data[] = {plain};
  check("plain", 0, vdi_catalyst_set_array(catalyst, "plain", f64, VDI_CATALYST_CELLS, data));
  check("in order", 0, set(catalyst, "in order", f64, 1, in_order, SIZE, NX * SIZE, NX * NY * SIZE, 0));
  check("planes", 0,
        set(catalyst, "vectors", f64, 3, planes, SIZE, NX * SIZE, NX * NY * SIZE, NX * NY * NZ * SIZE));
  check("interleaved", 0,
        set(catalyst, "interleaved", f64, 1, &interleaved[0][0][0][1], 2 * SIZE, 2 * NX * SIZE,
            2 * NX * NY * SIZE, 0));
  check("padded", 0,
        set(catalyst, "padded", f64, 1, padded, SIZE, (NX + PAD) * SIZE, (NX + PAD) * NY * SIZE, 0));
  check("z fastest", 0, set(catalyst, "z fastest", f64, 1, z_fastest, NY * NZ * SIZE, NZ * SIZE, SIZE, 0));
  check("untouched", 0, set(catalyst, "untouched", f64, 1, z_fastest, NY * NZ * SIZE, NZ * SIZE, SIZE, 0));
  check("partial", 0,
        set(catalyst, "partial", f64, 1, rank == 1 ? NULL : z_fastest, NY * NZ * SIZE, NZ * SIZE, SIZE, 0));
  check("shifted", 0, set(catalyst, "shifted", f64, 1, z_fastest, NY * NZ * SIZE, NZ * SIZE, SIZE, 0));
  const double offset[] = {-0.5, 0.0, 0.0};
  check("offset", 0, vdi_catalyst_set_array_offset(catalyst, "shifted", VDI_CATALYST_CELLS, offset));
  check("with halo", 0,
        set(catalyst, "with halo", f64, 1, &with_halo[HALO][HALO][HALO], SIZE, (NX + 2 * HALO) * SIZE,
            (int64_t)(NX + 2 * HALO) * (NY + 2 * HALO) * SIZE, 0));
  check("backwards", 0,
        set(catalyst, "backwards", f64, 1, &backwards[NZ - 1][NY - 1][NX - 1], -SIZE, -NX * SIZE,
            -NX * NY * SIZE, 0));
  const int64_t unit = (int64_t)sizeof packed[0][0][0];
  check("packed", 0,
        set(catalyst, "packed", f64, 1, &packed[0][0][0].value, unit, NX * unit, NX * NY * unit, 0));
  check("integers", 0,
        set(catalyst, "integers", VDI_CATALYST_I64, 1, integers, NY * NZ * SIZE, NZ * SIZE, SIZE, 0));
  check("one value for all", 0, set(catalyst, "one", f64, 1, plain, 0, 0, 0, 0));
}

static void set_bad_arrays(vdi_catalyst* catalyst) {
  const int bad = VDI_CATALYST_BAD_ARGUMENT;
  const int f64 = VDI_CATALYST_F64;
  check("strides that overflow", bad, set(catalyst, "plain", f64, 1, plain, INT64_MAX, SIZE, SIZE, 0));
  check("strides whose sum overflows", bad,
        set(catalyst, "plain", f64, 1, plain, INT64_MAX / NX, INT64_MAX / NY, SIZE, 0));
  check("strides to below 0", bad, set(catalyst, "plain", f64, 1, plain, INT64_MIN / NX, SIZE, SIZE, 0));
  check("the least stride", bad, set(catalyst, "plain", f64, 1, plain, INT64_MIN, SIZE, SIZE, 0));
  check("components that overflow", bad, set(catalyst, "plain", f64, 3, plain, SIZE, SIZE, SIZE, INT64_MAX));
  check("no components", bad, set(catalyst, "plain", f64, 0, plain, SIZE, SIZE, SIZE, 0));
  check("too many components", bad, set(catalyst, "plain", f64, 17, plain, SIZE, SIZE, SIZE, 0));
  const void* data[] = {plain};
  check("no strides", bad,
        vdi_catalyst_set_array_strided(catalyst, "plain", f64, VDI_CATALYST_CELLS, 1, data, NULL));
}

int main(int argc, char** argv) {
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  const char* const arguments[] = {"--compare", "plain"};
  vdi_catalyst_pipeline script = {NULL, 2, arguments};
  vdi_catalyst* catalyst = NULL;
  const int32_t comm = MPI_Comm_c2f(MPI_COMM_WORLD);
  check("no script", VDI_CATALYST_BAD_ARGUMENT,
        vdi_catalyst_initialize_pipelines(comm, 1, &script, &catalyst));
  script.file = argc > 1 ? argv[1] : "";
  check("initialize", 0, vdi_catalyst_initialize_pipelines(comm, 1, &script, &catalyst));
  const vdi_catalyst_block block = {
      {NX, NY, NZ}, {0, 0, 0}, {0, 0, 0}, {(double)rank * NX, 0.0, 0.0}, {1.0, 1.0, 1.0}};
  check("set_blocks", 0, vdi_catalyst_set_blocks(catalyst, 1, &block));
  set_arrays(catalyst);
  set_bad_arrays(catalyst);
  for (int step = 1; step <= 2; ++step) {
    simulate(step);
    check("execute", 0, vdi_catalyst_execute(catalyst, step, 0.5 * step));
    check("where the script wrote", getenv("VDI_ISOLATION") == NULL, in_order[1][2][3] == -step);
  }
  check("finalize", 0, vdi_catalyst_finalize(catalyst));
  return end(wrong);
}
