/* A simulation of heat, whose steps are timed: one box of N x N x N cells of doubles per rank, side
 * by side along x. Arguments: a JSON text, a script that ends in .py, or "-" for no library at all;
 * the number of steps. The first rank prints "initialize CODE MICROSECONDS", a line "step NUMBER
 * CODE MICROSECONDS BUSY" for each step, and "finalize CODE MICROSECONDS"; the time is that of the
 * slowest rank. BUSY is 1 if a frame is made meanwhile: of the last step before this one that
 * VDI_TEST_EVERY divides, vdi_NUMBER.vdi doesn't exist yet. Exit status 0 if all ranks have the same
 * codes. VDI_TEST_SIZE: N, 16 unless given. VDI_TEST_PAUSE: milliseconds after each step.
 * VDI_TEST_REPEAT: the number of times that the heat spreads in a step. VDI_TEST_KILL=STEP: kills
 * the last rank's worker while that step is handed over. VDI_TEST_FILE_LIMIT: the largest file, in
 * bytes, that the last rank may make during the first three steps. VDI_TEST_UNEQUAL: the first rank
 * has a second array, "W", which the others lack. VDI_TEST_HURRY: how many times as fast the steady
 * clock runs in this process while it finalizes. */
#define _GNU_SOURCE
#include <mpi.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"
#include "tests/catalyst_adaptor/worker.h"

static int size = 16;
static double* now;
static double* next;

static int number_of(const char* name, int usual) {
  const char* value = getenv(name);
  return value != NULL ? atoi(value) : usual;
}

static const int64_t second = 1000000000; /* ns */
static atomic_llong hurry = 1;
static atomic_llong since; /* ns, when the clock began to hurry */
static atomic_llong ahead; /* ns, when it ended */

/* The libraries find this function, and not that of libc, because the program exports it. */
int clock_gettime(clockid_t clock, struct timespec* time) {
  const int code = (int)syscall(SYS_clock_gettime, clock, time);
  if (code != 0 || clock != CLOCK_MONOTONIC) return code;
  const int64_t real = second * time->tv_sec + time->tv_nsec;
  const int64_t shown = real + ahead + (hurry - 1) * (real - since);
  time->tv_sec = shown / second;
  time->tv_nsec = shown % second;
  return 0;
}

static void set_hurry(int times) {
  struct timespec time;
  syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &time);
  const int64_t real = second * time.tv_sec + time.tv_nsec;
  ahead += (hurry - 1) * (real - since);
  since = real;
  hurry = times;
}

static double* at(double* field, int x, int y, int z) {
  const size_t side = (size_t)size + 2;
  return field + ((size_t)z * side + (size_t)y) * side + (size_t)x;
}

/* Each rank's box is hottest in its middle. */
static void heat_middle(void) {
  const size_t side = (size_t)size + 2;
  now = calloc(side * side * side, sizeof *now);
  next = calloc(side * side * side, sizeof *next);
  if (now == NULL || next == NULL) MPI_Abort(MPI_COMM_WORLD, 3);
  for (int z = 1; z <= size; ++z) {
    for (int y = 1; y <= size; ++y) {
      for (int x = 1; x <= size; ++x) {
        const double dx = (x - 0.5) / size - 0.5;
        const double dy = (y - 0.5) / size - 0.5;
        const double dz = (z - 0.5) / size - 0.5;
        *at(now, x, y, z) = 1.0 / (1.0 + 20.0 * (dx * dx + dy * dy + dz * dz));
      }
    }
  }
}

static void spread(void) {
  for (int z = 1; z <= size; ++z) {
    for (int y = 1; y <= size; ++y) {
      for (int x = 1; x <= size; ++x) {
        const double sum = *at(now, x - 1, y, z) + *at(now, x + 1, y, z) + *at(now, x, y - 1, z) +
                           *at(now, x, y + 1, z) + *at(now, x, y, z - 1) + *at(now, x, y, z + 1);
        *at(next, x, y, z) = 0.4 * *at(now, x, y, z) + 0.1 * sum;
      }
    }
  }
  double* const old = now;
  now = next;
  next = old;
}

static void* kill_soon(void* worker) {
  usleep(2000);
  kill(*(const pid_t*)worker, SIGKILL);
  return NULL;
}

static int differs(int code) {
  int extremes[2] = {code, -code};
  MPI_Allreduce(MPI_IN_PLACE, extremes, 2, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  return extremes[0] != -extremes[1];
}

static long microseconds_since(double start) {
  double spent = MPI_Wtime() - start;
  MPI_Allreduce(MPI_IN_PLACE, &spent, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  return (long)(1e6 * spent);
}

static void set_arrays(vdi_catalyst* catalyst, int rank) {
  const int64_t row = (int64_t)sizeof *now * (size + 2);
  const vdi_catalyst_strides strides = {{sizeof *now, row, row * (size + 2)}, 0};
  const void* data[] = {at(now, 1, 1, 1)};
  const int is_unequal = getenv("VDI_TEST_UNEQUAL") != NULL;
  for (int i = 0; i < 1 + is_unequal; ++i) {
    const char* name = i == 0 || rank > 0 ? "T" : "W";
    vdi_catalyst_set_array_strided(catalyst, name, VDI_CATALYST_F64, VDI_CATALYST_CELLS, 1, data, &strides);
  }
}

/* Files can't grow beyond VDI_TEST_FILE_LIMIT during the first three steps. */
static void limit_files(int step) {
  const int most = number_of("VDI_TEST_FILE_LIMIT", 0);
  if (most == 0 || (step != 0 && step != 3)) return;
  struct rlimit limit;
  getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = step == 0 ? (rlim_t)most : limit.rlim_max;
  setrlimit(RLIMIT_FSIZE, &limit);
}

static int is_frame_missing(int step) {
  char file[40];
  snprintf(file, sizeof file, "vdi_%06d.vdi", step);
  return access(file, F_OK) != 0;
}

int main(int argc, char** argv) {
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  if (argc != 3) MPI_Abort(MPI_COMM_WORLD, 2);
  size = number_of("VDI_TEST_SIZE", size);
  const int steps = atoi(argv[2]);
  const int repeat = number_of("VDI_TEST_REPEAT", 1);
  const int kill_step = number_of("VDI_TEST_KILL", -1);
  const int pause = number_of("VDI_TEST_PAUSE", 0);
  const int every = number_of("VDI_TEST_EVERY", 0);
  heat_middle();

  vdi_catalyst* catalyst = NULL;
  const int has_library = strcmp(argv[1], "-") != 0;
  int wrong = 0;
  if (has_library) {
    const double start = MPI_Wtime();
    const int code = initialize_any(argv[1], &catalyst);
    const long spent = microseconds_since(start);
    if (rank == 0) printf("initialize %d %ld\n", code, spent);
    wrong += differs(code);
    const vdi_catalyst_block block = {
        {size, size, size}, {0, 0, 0}, {0, 0, 0}, {rank, 0.0, 0.0}, {1.0 / size, 1.0 / size, 1.0 / size}};
    wrong += differs(vdi_catalyst_set_blocks(catalyst, 1, &block));
  }
  for (int step = 0; step < steps; ++step) {
    if (rank == ranks - 1) limit_files(step);
    const int is_busy = every > 0 && step > 0 && is_frame_missing((step - 1) / every * every);
    pid_t worker = 0;
    pthread_t killer;
    MPI_Barrier(MPI_COMM_WORLD);
    const double start = MPI_Wtime();
    for (int i = 0; i < repeat; ++i) spread();
    int code = 0;
    if (has_library) {
      set_arrays(catalyst, rank);
      if (step == kill_step && rank == ranks - 1) {
        worker = worker_of(rank);
        if (worker == 0) fprintf(stderr, "rank %d has no worker\n", rank);
        if (worker != 0) pthread_create(&killer, NULL, kill_soon, &worker);
      }
      if (vdi_catalyst_wants(catalyst, step, step)) code = vdi_catalyst_execute(catalyst, step, step);
    }
    const long spent = microseconds_since(start);
    if (worker != 0) pthread_join(killer, NULL);
    if (rank == 0) printf("step %d %d %ld %d\n", step, code, spent, is_busy);
    wrong += differs(code);
    if (pause > 0) usleep((useconds_t)pause * 1000);
  }
  if (has_library) {
    const double start = MPI_Wtime();
    set_hurry(number_of("VDI_TEST_HURRY", 1));
    const int code = vdi_catalyst_finalize(catalyst);
    set_hurry(1);
    const long spent = microseconds_since(start);
    if (rank == 0) printf("finalize %d %ld\n", code, spent);
    wrong += differs(code);
  }
  free(now);
  free(next);
  return end(wrong);
}
