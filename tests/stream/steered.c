/* A simulation that viewers steer: one block of point data per rank, and three parameters, one of
 * which ends it. Each rank writes one line per step, with the values that it was given, to
 * parameters_RANK.txt in VDI_OUTPUT. Argument: the script, or the text of a run without one. */
#include <math.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"

enum { N = 12, MOST_STEPS = 100000 };

static int wrong;

static void ensure(int holds, const char* what) {
  if (holds) return;
  fprintf(stderr, "FAILED  %s\n", what);
  wrong = 1;
}

/* If a parameter can't be declared, the call returns the given value, and the error's text has the reason. */
static void declare_badly(vdi_catalyst* catalyst, int rank, int ranks) {
  const struct {
    const char* name;
    double value, low, high;
    const char* told;
  } bad[] = {{NULL, 1.0, 0.0, 2.0, "needs a name"},     {"", 1.0, 0.0, 2.0, "1 to 64 letters"},
             {"two words", 1.0, 0.0, 2.0, "letters"},   {"a", 3.0, 0.0, 2.0, "out of its bounds"},
             {"a", NAN, 0.0, 2.0, "out of its bounds"}, {"a", 1.0, 2.0, 0.0, "out of its bounds"},
             {"a", 1.0, 0.0, INFINITY, "aren't finite"}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    const double value =
        vdi_catalyst_parameter_f64(catalyst, bad[i].name, bad[i].value, bad[i].low, bad[i].high);
    ensure(memcmp(&value, &bad[i].value, sizeof value) == 0, "a parameter that can't be has its value");
    ensure(strstr(vdi_catalyst_error(catalyst), bad[i].told) != NULL, bad[i].told);
  }
  if (ranks > 1) {
    const double differs = vdi_catalyst_parameter_f64(catalyst, rank == 0 ? "a" : "b", 1.0, 0.0, 2.0);
    ensure(differs == 1.0 && strstr(vdi_catalyst_error(catalyst), "different parameters") != NULL,
           "ranks ask for different parameters");
  }
  ensure(vdi_catalyst_parameter_i64(catalyst, "a", 1, 0, INT64_MAX) == 1 &&
             strstr(vdi_catalyst_error(catalyst), "beyond 2^53") != NULL,
         "whole numbers that a double doesn't have");
  ensure(vdi_catalyst_parameter_f64(NULL, "a", 7.0, 0.0, 2.0) == 7.0, "a null handle");
}

static void check(int code) {
  if (code == VDI_CATALYST_OK) return;
  fprintf(stderr, "FAILED  a call returned %d\n", code);
  MPI_Abort(MPI_COMM_WORLD, 1);
}

int main(int argc, char** argv) {
  static float field[N + 1][N + 1][N + 1];
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  if (argc < 2) MPI_Abort(MPI_COMM_WORLD, 2);
  vdi_catalyst* catalyst = NULL;
  check(initialize_any(argv[1], &catalyst));
  declare_badly(catalyst, rank, ranks);

  const vdi_catalyst_block block = {
      {N, N, N}, {0, 0, 0}, {0, 0, 0}, {(double)rank * N, 0.0, 0.0}, {1.0, 1.0, 1.0}};
  const void* data[] = {field};
  check(vdi_catalyst_set_blocks(catalyst, 1, &block));
  check(vdi_catalyst_set_array(catalyst, "V", VDI_CATALYST_F32, VDI_CATALYST_POINTS, data));
  char path[4096];
  snprintf(path, sizeof path, "%s/parameters_%d.txt", getenv("VDI_OUTPUT"), rank);
  FILE* said = fopen(path, "w");
  if (said == NULL) MPI_Abort(MPI_COMM_WORLD, 2);
  for (int step = 1; step <= MOST_STEPS; ++step) {
    /* The first rank's value counts, and bounds only when the parameter is declared. */
    const double low = step > 1 && rank == 0 ? NAN : 0.0;
    const double level = vdi_catalyst_parameter_f64(catalyst, "level", rank == 0 ? 0.5 : NAN, low, 1.0);
    const int64_t waves = vdi_catalyst_parameter_i64(catalyst, "waves", step > 1 ? 70 : 3, 1, 9);
    if (vdi_catalyst_parameter_i64(catalyst, "stop", 0, 0, 1) != 0) break;
    fprintf(said, "%d %.17g %lld\n", step, level, (long long)waves);
    fflush(said);
    for (int z = 0; z <= N; ++z) {
      for (int y = 0; y <= N; ++y) {
        for (int x = 0; x <= N; ++x)
          field[z][y][x] = (float)(level + 0.5 * sin((double)waves * (x + rank * N) / N) * cos(0.3 * y + z));
      }
    }
    check(vdi_catalyst_execute(catalyst, step, 0.5 * step));
    usleep(20000);
  }
  ensure(vdi_catalyst_parameter_i64(catalyst, "level", 1, 0, 2) == 1 &&
             strstr(vdi_catalyst_error(catalyst), "another type") != NULL,
         "a parameter of another type");
  fclose(said);
  check(vdi_catalyst_finalize(catalyst));
  return end(wrong);
}
