/* A simulation without a script: 24 x 24 x 24 cells, of which each rank has a slab along x. Three
 * fields move over them: V, of cells, z fastest; p, of 64-bit integers at points; and w, of vectors
 * of cells. Arguments: a JSON text or the name of a file with one (or of a script, which ends in
 * .py), then the code that each step must return. Exit status 0 if all did. VDI_TEST_BAD=1: the
 * program first tries bad JSON texts and files, which must be refused. VDI_TEST_REFUSED: the code
 * that initialising must return; then the program ends. VDI_TEST_FULL: the name of an output for
 * which there is no room. VDI_TEST_FIRST: the first step's number.
 * VDI_TEST_WANTS: for each step whether it is wanted, such as 1010; others aren't handed over.
 * VDI_TEST_OWN_TIMES=1: each rank gives a step another time. VDI_TEST_PAUSE: milliseconds between steps.
 * VDI_TEST_ALARM=1: SIGALRM interrupts each rank every millisecond, and its handler restarts no call.
 * VDI_TEST_THREADS=1: within each call of the handle, at each MPI_Allreduce, another thread and then this one
 * make all calls of the same handle, which must be refused.
 * VDI_TEST_STOP=MILLISECONDS: the last rank is stopped for so long within each step. VDI_TEST_LIMIT: the
 * bytes beyond which no file can grow while the third step is executed. VDI_ISOLATION: frames are made in
 * processes of their own. */
#include <math.h>
#include <mpi.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/expect.h"

enum { N = 24, DEPTH = 10000 };

static double cells[N][N][N];               /* [x][y][z] */
static int64_t points[N + 1][N + 1][N + 1]; /* [z][y][x] */
static float vectors[N][N][N][3];           /* [z][y][x] */

/* A hump, which is in the middle at step 0 and moves along y. */
static double hump(int x, int y, int z, int step) {
  const double dx = x - N / 2.0 + 0.5;
  const double dy = y - N / 2.0 - 0.5 * step;
  const double dz = z - N / 2.0 + 1.0;
  return 1.0 / (1.0 + 0.02 * (dx * dx + dy * dy + dz * dz));
}

static void simulate(int first, int count, int step) {
  for (int z = 0; z <= N; ++z) {
    for (int y = 0; y <= N; ++y) {
      for (int x = 0; x <= count; ++x) {
        const double value = hump(first + x, y, z, step);
        points[z][y][x] = (int64_t)(1e6 * value);
        if (x == count || y == N || z == N) continue;
        cells[x][y][z] = value;
        for (int c = 0; c < 3; ++c) vectors[z][y][x][c] = (float)value * (float)(c + 1);
      }
    }
  }
}

static volatile sig_atomic_t alarms;

static void count_alarm(int number) {
  (void)number;
  ++alarms;
}

static void begin_alarms(void) {
  struct sigaction action;
  memset(&action, 0, sizeof action);
  action.sa_handler = count_alarm;
  sigaction(SIGALRM, &action, NULL);
  const struct itimerval often = {{0, 1000}, {0, 1000}};
  setitimer(ITIMER_REAL, &often, NULL);
}

/* A child stops this process soon, and resumes it after some milliseconds. */
static pid_t stop_soon(int milliseconds) {
  const pid_t child = fork();
  if (child != 0) return child;
  usleep(5000);
  kill(getppid(), SIGSTOP);
  usleep((useconds_t)milliseconds * 1000);
  kill(getppid(), SIGCONT);
  _exit(0);
}

static vdi_catalyst* entered; /* the handle in whose calls others intrude; null: they don't */
static int intrusions;
static int admissions; /* calls that weren't refused */

static void* intrude(void* unused) {
  (void)unused;
  static const vdi_catalyst_block block = {{1, 1, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {1, 1, 1}};
  static const double offset[3] = {0, 0, 0};
  static const vdi_catalyst_strides strides = {{8, 8, 8}, 8};
  static const vdi_catalyst_particles none = {.positions = {offset, offset, offset}};
  const void* data[] = {cells};
  const int codes[] = {
      vdi_catalyst_set_blocks(entered, 1, &block),
      vdi_catalyst_set_array(entered, "V", VDI_CATALYST_F64, VDI_CATALYST_CELLS, data),
      vdi_catalyst_set_array_strided(entered, "V", VDI_CATALYST_F64, VDI_CATALYST_CELLS, 1, data, &strides),
      vdi_catalyst_set_array_offset(entered, "V", VDI_CATALYST_CELLS, offset),
      vdi_catalyst_set_array_missing(entered, "V", VDI_CATALYST_CELLS, 1, offset),
      vdi_catalyst_set_particles(entered, "P", &none),
      vdi_catalyst_set_stream(entered, NULL),
      vdi_catalyst_execute(entered, 0, 0.0),
      vdi_catalyst_finalize(entered)};
  for (size_t i = 0; i < sizeof codes / sizeof *codes; ++i) admissions += codes[i] != VDI_CATALYST_BUSY;
  admissions += vdi_catalyst_wants(entered, 0, 0.0) != 0;
  admissions += vdi_catalyst_parameter_f64(entered, "feed", 0.25, 0.0, 1.0) != 0.25;
  admissions += vdi_catalyst_parameter_i64(entered, "count", 4, 0, 9) != 4;
  admissions += strstr(vdi_catalyst_error(entered), "VDI_CATALYST_BUSY") == NULL;
  return NULL;
}

/* The libraries find this function, and not MPI's, because the program exports it. */
int MPI_Allreduce(const void* from, void* to, int count, MPI_Datatype type, MPI_Op op, MPI_Comm comm) {
  if (entered != NULL) {
    pthread_t other;
    if (pthread_create(&other, NULL, intrude, NULL) != 0) abort();
    pthread_join(other, NULL);
    intrude(NULL);
    ++intrusions;
  }
  return PMPI_Allreduce(from, to, count, type, op, comm);
}

static int refuse(int rank, const char* json, int wanted) {
  vdi_catalyst* catalyst = NULL;
  const int wrong = expect(rank, "initialize_json", wanted,
                           vdi_catalyst_initialize_json(MPI_Comm_c2f(MPI_COMM_WORLD), json, &catalyst));
  return wrong + expect(rank, "the handle of a failed initialize_json", 1, catalyst == NULL);
}

/* Files come and go on rank 0, the only one that reads them. */
static int refuse_bad(int rank) {
  static char deep[6 * DEPTH + 1];
  for (int i = 0; i < DEPTH; ++i) strcpy(deep + i * 5, "{\"a\":");
  int wrong = refuse(rank, deep, VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "{\"field\": \"V\", \"every\": 10, \"every\": 5}", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "{\"field\": \"V\",\n\"camera\": {\"positon\": [0, 0, 1]}}", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "{\"field\": \"V\", \"colors\": {\"range\": [NaN, 1]}}", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "{\"field\": \"V\", \"colors\": {\"file\": \"none.json\"}}", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "none.json", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, rank == 0 ? NULL : "{}", VDI_CATALYST_BAD_ARGUMENT);
  if (rank == 0) {
    unlink("pipe.json");
    if (mkfifo("pipe.json", 0600) != 0) abort();
    FILE* file = fopen("large.json", "w");
    if (file == NULL || ftruncate(fileno(file), 1 << 30) != 0) abort();
    fclose(file);
  }
  wrong += refuse(rank, "pipe.json", VDI_CATALYST_SCRIPT);
  wrong += refuse(rank, "large.json", VDI_CATALYST_SCRIPT);
  if (rank == 0) {
    unlink("pipe.json");
    unlink("large.json");
  }
  return wrong;
}

static int give_arrays(int rank, vdi_catalyst* catalyst) {
  const void* data[] = {cells};
  vdi_catalyst_strides strides = {{sizeof(cells[0]), sizeof(cells[0][0]), sizeof(double)}, 0};
  int wrong = expect(rank, "an unknown type", VDI_CATALYST_BAD_ARGUMENT,
                     vdi_catalyst_set_array(catalyst, "V", 99, VDI_CATALYST_CELLS, data));
  wrong += expect(
      rank, "V", VDI_CATALYST_OK,
      vdi_catalyst_set_array_strided(catalyst, "V", VDI_CATALYST_F64, VDI_CATALYST_CELLS, 1, data, &strides));
  data[0] = points;
  strides = (vdi_catalyst_strides){{sizeof(int64_t), sizeof(points[0][0]), sizeof(points[0])}, 0};
  wrong += expect(rank, "p", VDI_CATALYST_OK,
                  vdi_catalyst_set_array_strided(catalyst, "p", VDI_CATALYST_I64, VDI_CATALYST_POINTS, 1,
                                                 data, &strides));
  data[0] = vectors;
  strides = (vdi_catalyst_strides){{sizeof(vectors[0][0][0]), sizeof(vectors[0][0]), sizeof(vectors[0])},
                                   sizeof(float)};
  wrong += expect(
      rank, "w", VDI_CATALYST_OK,
      vdi_catalyst_set_array_strided(catalyst, "w", VDI_CATALYST_F32, VDI_CATALYST_CELLS, 3, data, &strides));
  return wrong;
}

static int refuse_steps(int rank, int ranks, vdi_catalyst* catalyst) {
  int wrong = expect(rank, "a step before the first is wanted", 0, vdi_catalyst_wants(catalyst, -1, 0.0));
  wrong += expect(rank, "a step before the first", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_execute(catalyst, -1, 0.0));
  wrong += expect(rank, "a time that is no number", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_execute(catalyst, 0, (double)NAN));
  wrong += expect(rank, "a time that isn't finite on one rank", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_execute(catalyst, 0, rank == ranks - 1 ? (double)INFINITY : 0.0));
  wrong += expect(rank, "its text", 1,
                  strstr(vdi_catalyst_error(catalyst), "the time isn't a finite number") != NULL);
  return wrong;
}

int main(int argc, char** argv) {
  int rank = 0;
  int ranks = 0;
  begin(&argc, &argv, &rank, &ranks);
  if (argc < 2) MPI_Abort(MPI_COMM_WORLD, 2);
  is_late = getenv("VDI_ISOLATION") != NULL;
  int wrong = getenv("VDI_TEST_BAD") != NULL ? refuse_bad(rank) : 0;

  const char* full = getenv("VDI_TEST_FULL");
  if (full != NULL && rank == 0) {
    unlink(full);
    if (symlink("/dev/full", full) != 0) abort();
  }

  const char* refused = getenv("VDI_TEST_REFUSED");
  if (refused != NULL) {
    wrong += refuse(rank, argv[1], atoi(refused));
    return end(wrong);
  }

  vdi_catalyst* catalyst = NULL;
  wrong += expect(rank, "initialize", VDI_CATALYST_OK, initialize_any(argv[1], &catalyst));
  if (getenv("VDI_TEST_THREADS") != NULL) entered = catalyst;
  if (!is_script(argv[1])) wrong += refuse(rank, argv[1], VDI_CATALYST_ENGINE); /* one at a time */

  const int first = rank * N / ranks;
  const int count = (rank + 1) * N / ranks - first;
  const vdi_catalyst_block block = {
      {count, N, N}, {0, 0, 0}, {0, 0, 0}, {(double)first / N, 0.0, 0.0}, {1.0 / N, 1.0 / N, 1.0 / N}};
  wrong += expect(rank, "execute before blocks", VDI_CATALYST_BAD_ARGUMENT,
                  vdi_catalyst_execute(catalyst, 0, 0.0));
  wrong += expect(rank, "set_blocks", VDI_CATALYST_OK, vdi_catalyst_set_blocks(catalyst, 1, &block));
  wrong += give_arrays(rank, catalyst);
  const char* wanted = getenv("VDI_TEST_WANTS");
  const char* first_step = getenv("VDI_TEST_FIRST");
  const char* pause = getenv("VDI_TEST_PAUSE");
  const double late = getenv("VDI_TEST_OWN_TIMES") != NULL ? 0.01 * rank : 0.0;
  const char* bytes = getenv("VDI_TEST_LIMIT");
  const char* stop = getenv("VDI_TEST_STOP");
  struct rlimit limit;
  getrlimit(RLIMIT_FSIZE, &limit);
  if (getenv("VDI_TEST_ALARM") != NULL) begin_alarms();
  for (int i = 0; i < argc - 2; ++i) {
    const int step = i + (first_step != NULL ? atoi(first_step) : 0);
    simulate(first, count, step);
    if (pause != NULL) usleep((useconds_t)atoi(pause) * 1000);
    if (wanted != NULL) {
      const int wants = vdi_catalyst_wants(catalyst, step, 0.5 * step - late);
      wrong += expect(rank, "wants", wanted[i] - '0', wants);
      if (wants == 0) continue;
    }
    if (bytes != NULL && i == 2) {
      const struct rlimit tight = {(rlim_t)atoi(bytes), limit.rlim_max};
      setrlimit(RLIMIT_FSIZE, &tight);
    }
    const pid_t stopping = stop != NULL && rank == ranks - 1 ? stop_soon(atoi(stop)) : 0;
    const int code = vdi_catalyst_execute(catalyst, step, 0.5 * step - late);
    if (stopping > 0) waitpid(stopping, NULL, 0);
    setrlimit(RLIMIT_FSIZE, &limit);
    wrong += expect_step(rank, atoi(argv[i + 2]), code);
    if (code != VDI_CATALYST_OK)
      wrong += expect(rank, "the error's text", 1, vdi_catalyst_error(catalyst)[0] != '\0');
  }
  wrong += refuse_steps(rank, ranks, catalyst);
  const int intruded = intrusions;
  wrong += expect_end(rank, vdi_catalyst_finalize(catalyst));
  if (entered != NULL) {
    wrong += expect(rank, "intrusions before finalize", 1, intruded > 20);
    wrong += expect(rank, "intrusions into finalize", 1, intrusions > intruded);
    wrong += expect(rank, "admissions", 0, admissions);
    entered = NULL;
  }
  const struct itimerval never = {{0, 0}, {0, 0}};
  setitimer(ITIMER_REAL, &never, NULL);
  if (getenv("VDI_TEST_ALARM") != NULL) wrong += expect(rank, "alarms", 1, alarms > 0);
  wrong += expect(rank, "a second finalize", VDI_CATALYST_BAD_ARGUMENT, vdi_catalyst_finalize(catalyst));
  wrong += expect(rank, "a step is wanted after it", 0, vdi_catalyst_wants(catalyst, 0, 0.0));
  return end(wrong);
}
