/* Shared by the simulations in C: their begin and end, and checks of the codes that the adaptor's calls
 * return, isolated runs included. */
#ifndef VDI_TESTS_CATALYST_EXPECT_H
#define VDI_TESTS_CATALYST_EXPECT_H

#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"

/* The working folder becomes VDI_OUTPUT, if the environment has it. */
static inline void begin(int* argc, char*** argv, int* rank, int* ranks) {
  MPI_Init(argc, argv);
  MPI_Comm_rank(MPI_COMM_WORLD, rank);
  MPI_Comm_size(MPI_COMM_WORLD, ranks);
  const char* folder = getenv("VDI_OUTPUT");
  if (folder != NULL && chdir(folder) != 0) MPI_Abort(MPI_COMM_WORLD, 3);
}

/* Returns the exit status: 0 if no rank has counted anything wrong. */
static inline int end(int wrong) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Allreduce(MPI_IN_PLACE, &wrong, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  if (wrong != 0 && rank == 0) fprintf(stderr, "FAILED: %d checks\n", wrong);
  MPI_Finalize();
  return wrong == 0 ? 0 : 1;
}

/* A name that ends in .py is a script; anything else is a JSON text, or the name of a file with one. */
static inline int is_script(const char* what) {
  const size_t length = strlen(what);
  return length > 3 && strcmp(what + length - 3, ".py") == 0;
}

static inline int initialize_any(const char* what, vdi_catalyst** catalyst) {
  const int32_t comm = MPI_Comm_c2f(MPI_COMM_WORLD);
  return is_script(what) ? vdi_catalyst_initialize(comm, 1, &what, catalyst)
                         : vdi_catalyst_initialize_json(comm, what, catalyst);
}

/* The resident memory of a process, in KiB. */
static inline long resident_kib_of(pid_t process) {
  char path[40];
  snprintf(path, sizeof path, "/proc/%d/statm", (int)process);
  long pages = 0;
  FILE* file = fopen(path, "r");
  if (file == NULL || fscanf(file, "%*d %ld", &pages) != 1) abort();
  fclose(file);
  return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

static inline long resident_kib(void) {
  return resident_kib_of(getpid());
}

/* These functions return 1, and say why, if a code isn't the expected one. */
static inline int expect(int rank, const char* what, int wanted, int code) {
  if (code == wanted) return 0;
  fprintf(stderr, "rank %d: %s returned %d, not %d\n", rank, what, code, wanted);
  return 1;
}

/* Frames in separate processes are made later. A later call returns the code of a frame that failed. */
static int is_late;
static int has_failed; /* a frame was to fail */
static int is_untold;  /* and no later call has returned that */

static inline int expect_step(int rank, int wanted, int code) {
  if (!is_late) return expect(rank, "execute", wanted, code);
  int wrong = 0;
  if (code != VDI_CATALYST_OK) wrong = expect(rank, "a call after a frame that fails", 1, has_failed);
  if (code != VDI_CATALYST_OK) is_untold = 0;
  if (wanted != VDI_CATALYST_OK) has_failed = is_untold = 1;
  return wrong;
}

static inline int expect_end(int rank, int code) {
  if (!has_failed) return expect(rank, "finalize", VDI_CATALYST_OK, code);
  return is_untold ? expect(rank, "finalize after a frame that fails", 1, code != VDI_CATALYST_OK) : 0;
}

#endif
