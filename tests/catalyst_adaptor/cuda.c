/* A simulation whose values lie on the host or in memory of CUDA. Each rank has two blocks of cells with the
 * scalars V, padded and with y mirrored, and the vectors w, interleaved with a fourth number; and particles,
 * P. They change at each step. VDI_TEST_CUDA names the library (cuda.h).
 *
 * Arguments: where values lie, and JSON texts or a script, which make frames at steps 0 and 2 of 4.
 *   host    on the host
 *   device  in CUDA's memory, written on a stream of its own
 *   mixed   those of the second block and the particles' positions in CUDA's memory, written on a stream for
 *           which the default stream waits
 *   faults  V in CUDA's memory. The last rank makes mistakes, and each step returns what it must.
 * Exit status 0 if all calls return what they should. VDI_ISOLATION: frames are made in processes of their
 * own. */
#include <math.h>
#include <mpi.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "tests/catalyst_adaptor/cuda.h"
#include "tests/catalyst_adaptor/expect.h"

enum { N = 32, PAD = 8, BLOCKS = 2, COUNT = 500, STEPS = 4 };

typedef struct block_values {
  double v[N][N][N + PAD]; /* [x][N - 1 - y][z] */
  float w[N][N][N][4];     /* [z][y][x] */
} block_values;

typedef struct particle {
  double position[3];
  float weight;
  float length;
} particle;

static block_values values[BLOCKS];
static particle particles[COUNT];
/* Where the adaptor finds them. */
static char* given_values[BLOCKS];
static char* given_positions;
static char* given_weights;
static void* stream;
static int rank;
static int ranks;

/* The blocks lie side by side along x, from 0 to 1. */
static double spacing(void) {
  return 1.0 / (BLOCKS * ranks * N);
}

static void simulate(int step) {
  for (int b = 0; b < BLOCKS; ++b) {
    for (int x = 0; x < N; ++x) {
      for (int y = 0; y < N; ++y) {
        for (int z = 0; z < N; ++z) {
          const double dx = (BLOCKS * rank + b) * N + x + 0.5 - 0.5 * BLOCKS * ranks * N - step;
          const double dy = y + 0.5 - 0.5 * N;
          const double dz = z + 0.5 - 0.5 * N;
          const double value = 1.0 / (1.0 + 0.03 * (dx * dx + dy * dy + dz * dz));
          values[b].v[x][N - 1 - y][z] = value;
          for (int c = 0; c < 4; ++c) values[b].w[z][y][x][c] = (float)value * (float)(c + 1);
        }
      }
    }
  }
  for (int i = 0; i < COUNT; ++i) {
    particles[i].position[0] = BLOCKS * N * spacing() * (rank + (double)i / COUNT);
    particles[i].position[1] = N * spacing() * (0.5 + 0.3 * sin(0.1 * i + 0.2 * step));
    particles[i].position[2] = N * spacing() * (0.5 + 0.3 * cos(0.37 * i));
    particles[i].weight = 1.0F;
    particles[i].length = (float)(2.0 * spacing());
  }
}

static void place(const char* where) {
  const int is_device = strcmp(where, "device") == 0 || strcmp(where, "faults") == 0;
  const int is_mixed = strcmp(where, "mixed") == 0;
  if (is_device || is_mixed) stream = cuda_stream(is_mixed);
  for (int b = 0; b < BLOCKS; ++b)
    given_values[b] = is_device || (is_mixed && b == 1) ? cuda_allocate(sizeof *values) : (char*)&values[b];
  given_positions = is_device || is_mixed ? cuda_allocate(sizeof particles) : (char*)particles;
  given_weights = is_device ? given_positions : (char*)particles;
}

/* Queues the transfer of what lies in CUDA's memory, and spoils it on the host. */
static void transfer(void) {
  for (int b = 0; b < BLOCKS; ++b) {
    if (given_values[b] == (char*)&values[b]) continue;
    cuda_write(stream, given_values[b], &values[b], sizeof *values);
    memset(&values[b], 0xff, sizeof *values);
  }
  if (given_positions == (char*)particles) return;
  cuda_write(stream, given_positions, particles, sizeof particles);
  for (int i = 0; i < COUNT; ++i) memset(particles[i].position, 0xff, sizeof particles[i].position);
}

static int set_v(vdi_catalyst* catalyst, char* first_of_last_block) {
  const void* data[BLOCKS];
  vdi_catalyst_strides strides[BLOCKS];
  for (int b = 0; b < BLOCKS; ++b) {
    char* const at = b == BLOCKS - 1 ? first_of_last_block : given_values[b];
    data[b] = at + (N - 1) * sizeof(values->v[0][0]);
    strides[b] =
        (vdi_catalyst_strides){{sizeof(values->v[0]), -(int64_t)sizeof(values->v[0][0]), sizeof(double)}, 0};
  }
  return vdi_catalyst_set_array_strided(catalyst, "V", VDI_CATALYST_F64, VDI_CATALYST_CELLS, 1, data,
                                        strides);
}

static int set_w(vdi_catalyst* catalyst) {
  const void* data[BLOCKS];
  vdi_catalyst_strides strides[BLOCKS];
  for (int b = 0; b < BLOCKS; ++b) {
    data[b] = given_values[b] + sizeof values->v;
    strides[b] = (vdi_catalyst_strides){
        {sizeof(values->w[0][0][0]), sizeof(values->w[0][0]), sizeof(values->w[0])}, sizeof(float)};
  }
  return vdi_catalyst_set_array_strided(catalyst, "w", VDI_CATALYST_F32, VDI_CATALYST_CELLS, 3, data,
                                        strides);
}

static vdi_catalyst_particles given_particles(void) {
  vdi_catalyst_particles given = {
      .count = COUNT, .kind = VDI_CATALYST_SUM, .position_type = VDI_CATALYST_F64};
  for (int axis = 0; axis < 3; ++axis) given.positions[axis] = given_positions + axis * (int)sizeof(double);
  given.position_stride = given.weight_stride = given.length_stride = sizeof(particle);
  given.weights = given_weights + offsetof(particle, weight);
  given.lengths = given_weights + offsetof(particle, length);
  given.weight_type = given.length_type = VDI_CATALYST_F32;
  return given;
}

static int begin_run(const char* run, vdi_catalyst** catalyst) {
  int wrong = expect(rank, "initialize", VDI_CATALYST_OK, initialize_any(run, catalyst));
  if (cuda_library == NULL) {
    wrong += expect(rank, "a stream without CUDA", VDI_CATALYST_BAD_ARGUMENT,
                    vdi_catalyst_set_stream(*catalyst, &wrong));
    wrong += expect(rank, "its text", 1, strstr(vdi_catalyst_error(*catalyst), "hasn't loaded CUDA") != NULL);
  }
  vdi_catalyst_block blocks[BLOCKS];
  for (int b = 0; b < BLOCKS; ++b) {
    blocks[b] = (vdi_catalyst_block){{N, N, N},
                                     {0, 0, 0},
                                     {0, 0, 0},
                                     {(BLOCKS * rank + b) * N * spacing(), 0.0, 0.0},
                                     {spacing(), spacing(), spacing()}};
  }
  return wrong +
         expect(rank, "set_blocks", VDI_CATALYST_OK, vdi_catalyst_set_blocks(*catalyst, BLOCKS, blocks));
}

static int run_steps(const char* run, int has_stream) {
  vdi_catalyst* catalyst = NULL;
  int wrong = begin_run(run, &catalyst);
  if (has_stream)
    wrong += expect(rank, "set_stream", VDI_CATALYST_OK, vdi_catalyst_set_stream(catalyst, stream));
  const vdi_catalyst_particles particles_given = given_particles();
  for (int step = 0; step < STEPS; ++step) {
    wrong += expect(rank, "V", VDI_CATALYST_OK, set_v(catalyst, given_values[BLOCKS - 1]));
    wrong += expect(rank, "w", VDI_CATALYST_OK, set_w(catalyst));
    wrong += expect(rank, "P", VDI_CATALYST_OK, vdi_catalyst_set_particles(catalyst, "P", &particles_given));
    simulate(step);
    transfer();
    const uint64_t before = cuda_library != NULL ? cuda_copies() : 0;
    wrong += expect_step(rank, VDI_CATALYST_OK, vdi_catalyst_execute(catalyst, step, 0.5 * step));
    if (step % 2 == 1 && cuda_library != NULL)
      wrong += expect(rank, "copies without a frame", 0, (int)(cuda_copies() - before));
    if (stream != NULL) transfer(); /* what was spoilt: the values may change now */
  }
  return wrong + expect_end(rank, vdi_catalyst_finalize(catalyst));
}

static vdi_catalyst* faulty;
static int step_number;

/* A step whose frame fails because of the last rank's `text`, or succeeds (null). */
static int expect_frame(const char* what, const char* text) {
  const int code = vdi_catalyst_execute(faulty, step_number++, 0.0);
  int wrong = expect(rank, what, text != NULL ? VDI_CATALYST_SCRIPT : VDI_CATALYST_OK, code);
  if (text == NULL) return wrong;
  char speaker[32];
  snprintf(speaker, sizeof speaker, "rank %d: ", ranks - 1);
  const char* error = vdi_catalyst_error(faulty);
  if (strstr(error, text) == NULL || strstr(error, speaker) != error) {
    fprintf(stderr, "rank %d: %s: '%s' doesn't say '%s'\n", rank, what, error, text);
    ++wrong;
  }
  return wrong;
}

/* The last rank gives V at another place, which is refused because of `text`, or taken (null). */
static int give(const char* what, char* at, const char* text) {
  const int code = set_v(faulty, rank == ranks - 1 ? at : given_values[BLOCKS - 1]);
  int wrong = expect(rank, what, text != NULL ? VDI_CATALYST_BAD_ARGUMENT : VDI_CATALYST_OK, code);
  if (text != NULL) wrong += expect(rank, text, 1, strstr(vdi_catalyst_error(faulty), text) != NULL);
  return wrong;
}

static int give_good(void) {
  int wrong = give("V", given_values[BLOCKS - 1], NULL);
  return wrong + expect_frame("a good step after a bad one", NULL);
}

static volatile int is_released;

static void wait_for_release(void* unused) {
  (void)unused;
  while (!is_released) usleep(1000);
}

/* Pieces of device memory at adjacent addresses, of which the first `count` are mapped. */
static char* reserve(size_t piece, int count) {
  const struct {
    int type, handles, location, device;
    void* unused;
    uint64_t flags;
  } properties = {1, 0, 1, 0, NULL, 0};
  const struct { int location, device, flags; } access = {1, 0, 3};
  cuda_address memory = 0;
  CUDA("cuMemAddressReserve", (cuda_address*, size_t, size_t, cuda_address, uint64_t), &memory, 2 * piece, 0,
       0, 0);
  for (int i = 0; i < count; ++i) {
    const cuda_address at = memory + (unsigned)i * piece;
    uint64_t handle = 0;
    CUDA("cuMemCreate", (uint64_t*, size_t, const void*, uint64_t), &handle, piece, &properties, 0);
    CUDA("cuMemMap", (cuda_address, size_t, size_t, uint64_t, uint64_t), at, piece, 0, handle, 0);
    CUDA("cuMemSetAccess", (cuda_address, size_t, const void*, size_t), at, piece, &access, 1);
  }
  return (char*)(uintptr_t)memory;
}

static int refuse_memory(void) {
  int wrong = give("beyond the end",
                   given_values[BLOCKS - 1] + sizeof(*values) - sizeof values->v + PAD * sizeof(double) + 8,
                   "block 1 of the array 'V' of cells reaches ");
  wrong += expect_frame("a step after it", NULL);

  char* own = cuda_allocate(sizeof *values);
  cuda_write(stream, own, &values[BLOCKS - 1], sizeof *values);
  wrong += give("an allocation", own, NULL);
  wrong += expect_frame("its step", NULL);
  if (rank == ranks - 1) cuda_free(own);
  wrong +=
      expect_frame("freed memory", "block 1 of the array 'V' of cells lies in a GPU's memory that was freed");
  wrong += give("freed memory", own, NULL);
  wrong += expect_frame("memory that was freed before", "can't be read");
  wrong += give_good();

  void* context = NULL;
  CUDA("cuCtxCreate_v2", (void**, unsigned, int), &context, 0, 0);
  own = cuda_allocate(sizeof *values);
  wrong += give("another context's memory", own, NULL);
  wrong += expect_frame("its step", NULL);
  if (rank == ranks - 1) CUDA("cuCtxDestroy_v2", (void*), context);
  wrong += expect_frame("a context that is gone", "whose context is gone");
  wrong += give_good();

  const size_t piece = (size_t)2 << 20U;
  own = reserve(piece, 2);
  cuda_write(stream, own + piece - 1000, &values[BLOCKS - 1], sizeof *values);
  wrong += give("mapped pieces", own + piece - 1000, NULL);
  wrong += expect_frame("their step", NULL);
  cuda_synchronize(stream);
  if (rank == ranks - 1)
    CUDA("cuMemUnmap", (cuda_address, size_t), (cuda_address)(uintptr_t)(own + piece), piece);
  wrong += expect_frame("a piece that is gone", "isn't mapped from byte 1000 on");
  if (rank == ranks - 1)
    wrong += give("a missing piece", own + piece - 1000, "isn't mapped from byte 1000 on");
  else
    wrong += give("a missing piece", NULL, "isn't mapped from byte 1000 on");
  wrong += give_good();

  char* const host = mmap(NULL, sizeof *values, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  wrong += give("memory of the host", host, NULL);
  wrong += expect_frame("its step", NULL);
  if (rank == ranks - 1) munmap(host + sizeof(values->v) / 2 / 4096 * 4096, 8192);
  wrong += expect_frame("a hole in it", "block 1 of the array 'V' of cells can't be read");
  return wrong + give_good();
}

static int refuse_particles(void) {
  vdi_catalyst_particles given = given_particles();
  given.positions[0] = given.positions[1] = given.positions[2] = given_positions;
  if (rank == ranks - 1) given.count = COUNT + 1;
  int wrong = expect(rank, "too many particles", VDI_CATALYST_BAD_ARGUMENT,
                     vdi_catalyst_set_particles(faulty, "P", &given));
  return wrong + expect(rank, "their text", 1,
                        strstr(vdi_catalyst_error(faulty), "a part of the particles 'P' reaches ") != NULL);
}

static int refuse_calls(void) {
  void (*fail)(const char*, int) =
      (void (*)(const char*, int))(uintptr_t)dlsym(cuda_library, "cuda_stand_in_fail");
  int wrong = 0;
  if (fail != NULL) {
    if (rank == ranks - 1) fail("cuMemcpy3DAsync", 700);
    wrong += expect_frame("a copy that fails", "cuMemcpy3DAsync failed: CUDA_ERROR_ILLEGAL_ADDRESS");
    if (rank == ranks - 1) fail("cuEventQuery", 719);
    wrong += expect_frame("work that fails", "cuEventQuery failed: CUDA's error 719");
  }
  if (rank == ranks - 1) {
    CUDA("cuLaunchHostFunc", (void*, void (*)(void*), void*), stream, wait_for_release, NULL);
    setenv("VDI_CUDA_PATIENCE", "1", 1);
  }
  wrong += expect_frame("a stream that never ends", "hasn't ended in 1 s");
  is_released = 1;
  cuda_synchronize(stream);
  return wrong + give_good();
}

/* Memory of other GPUs. */
static int refuse_others(void) {
  const char* const hip = getenv("VDI_TEST_HIP");
  const char* const zero = getenv("VDI_TEST_LEVEL_ZERO");
  if (hip == NULL || zero == NULL) return 0;
  void* own = NULL;
  void* const cuda = cuda_library;
  cuda_library = dlopen(hip, RTLD_NOW | RTLD_LOCAL);
  CUDA("hipMalloc", (void**, size_t), &own, sizeof *values);
  int wrong = give("HIP's memory", own, "lies in a HIP device's memory");
  cuda_library = dlopen(zero, RTLD_NOW | RTLD_LOCAL);
  CUDA("zeMemAllocDevice", (void*, void*, size_t, size_t, void*, void**), NULL, NULL, sizeof *values, 8, NULL,
       &own);
  wrong += give("Level Zero's memory", own, "lies in a Level Zero device's memory");
  cuda_library = cuda;
  return wrong + give_good();
}

static int run_faults(const char* run) {
  int wrong = begin_run(run, &faulty);
  wrong += expect(rank, "set_stream", VDI_CATALYST_OK, vdi_catalyst_set_stream(faulty, stream));
  simulate(0);
  for (int b = 0; b < BLOCKS; ++b) cuda_write(stream, given_values[b], &values[b], sizeof *values);
  wrong += give_good();
  wrong += refuse_memory();
  wrong += refuse_particles();
  wrong += refuse_calls();
  wrong += refuse_others();
  return wrong + expect(rank, "finalize", VDI_CATALYST_OK, vdi_catalyst_finalize(faulty));
}

int main(int argc, char** argv) {
  begin(&argc, &argv, &rank, &ranks);
  if (argc < 3) MPI_Abort(MPI_COMM_WORLD, 2);
  is_late = getenv("VDI_ISOLATION") != NULL;
  if (strcmp(argv[1], "host") != 0) cuda_begin();
  place(argv[1]);
  int wrong = 0;
  for (int i = 2; i < argc; ++i)
    wrong += strcmp(argv[1], "faults") == 0 ? run_faults(argv[i])
                                            : run_steps(argv[i], strcmp(argv[1], "device") == 0);
  return end(wrong);
}
