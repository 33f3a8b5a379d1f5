/* The cost of libvdi_catalyst.so before and after it is initialised, and its message if that fails. With
 * VDI_TEST_JSON the program initialises it with that JSON text; it then loads no ParaView, and takes at most
 * VDI_TEST_MEBIBYTES. Arguments: the code that initialising must return, a text that rank 0 must then print
 * once ("-" for any), the library of rank 0, and that of the other ranks (rank 0's unless given). Exit status
 * 0 if all checks hold. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "catalyst_adaptor/vdi_catalyst.h"

enum { MAX_KIB_BEFORE = 2048 };

typedef struct cost {
  int libraries;
  int of_paraview; /* of these, the ones of ParaView and Python */
  int of_vulkan;
  long resident_kib;
} cost;

static void fail(const char* what) {
  fprintf(stderr, "FAILED: %s\n", what);
  MPI_Abort(MPI_COMM_WORLD, 1);
}

static cost measure(void) {
  cost result = {0, 0, 0, 0};
  char line[4096];
  char last[4096] = "";
  FILE* maps = fopen("/proc/self/maps", "r");
  while (maps != NULL && fgets(line, sizeof line, maps) != NULL) {
    const char* path = strchr(line, '/');
    if (path == NULL || strstr(path, ".so") == NULL || strcmp(path, last) == 0) continue;
    strcpy(last, path); /* a library's parts follow each other */
    ++result.libraries;
    result.of_paraview += strstr(path, "libvtk") != NULL || strstr(path, "libpython") != NULL;
    result.of_vulkan += strstr(path, "libvulkan") != NULL;
  }
  FILE* rollup = fopen("/proc/self/smaps_rollup", "r");
  while (rollup != NULL && fgets(line, sizeof line, rollup) != NULL)
    sscanf(line, "Rss: %ld kB", &result.resident_kib);
  if (maps == NULL || rollup == NULL || result.libraries == 0 || result.resident_kib == 0)
    fail("nothing was measured");
  fclose(maps);
  fclose(rollup);
  return result;
}

static void print(int rank, const char* when, cost before, cost now) {
  if (rank > 0) return;
  printf("%s: %d libraries (%d of ParaView and Python, %d of Vulkan), %ld KiB resident\n", when,
         now.libraries - before.libraries, now.of_paraview, now.of_vulkan,
         now.resident_kib - before.resident_kib);
}

/* The number of times that `text` occurs in the file. */
static int count_in(FILE* file, const char* text) {
  static char content[65536];
  rewind(file);
  content[fread(content, 1, sizeof content - 1, file)] = '\0';
  fputs(content, stderr);
  int count = 0;
  for (const char* at = strstr(content, text); at != NULL; at = strstr(at + 1, text)) ++count;
  return count;
}

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (argc < 4) fail("arguments are missing");
  const int wanted = atoi(argv[1]);
  const char* text = argv[2];

  const cost none = measure();
  void* library = dlopen(argv[rank == 0 || argc < 5 ? 3 : 4], RTLD_NOW | RTLD_GLOBAL);
  if (library == NULL) fail(dlerror());
  const cost linked = measure();
  print(rank, "linked", none, linked);
  if (linked.of_paraview + linked.of_vulkan > 0)
    fail("ParaView, Python or Vulkan is loaded before it is needed");
  if (linked.resident_kib - none.resident_kib > MAX_KIB_BEFORE) fail("linking alone costs too much memory");

  int (*initialize)(int32_t, int32_t, const char* const*, vdi_catalyst**) =
      dlsym(library, "vdi_catalyst_initialize");
  int (*initialize_json)(int32_t, const char*, vdi_catalyst**) =
      dlsym(library, "vdi_catalyst_initialize_json");
  int (*execute)(vdi_catalyst*, int64_t, double) = dlsym(library, "vdi_catalyst_execute");
  int (*finalize)(vdi_catalyst*) = dlsym(library, "vdi_catalyst_finalize");
  const char* (*error)(const vdi_catalyst*) = dlsym(library, "vdi_catalyst_error");
  if (initialize == NULL || initialize_json == NULL || execute == NULL || finalize == NULL || error == NULL)
    fail("a function is missing");
  if (execute(NULL, 1, 0.0) != VDI_CATALYST_BAD_ARGUMENT || error(NULL)[0] != '\0')
    fail("a null handle was taken");

  feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW); /* as simulations do to find errors */
  FILE* said = tmpfile();
  const int terminal = dup(STDERR_FILENO);
  fflush(stderr);
  dup2(fileno(said), STDERR_FILENO);
  vdi_catalyst* catalyst = NULL;
  const int32_t comm = MPI_Comm_c2f(MPI_COMM_WORLD);
  const char* json = getenv("VDI_TEST_JSON");
  const int code =
      json != NULL ? initialize_json(comm, json, &catalyst) : initialize(comm, 0, NULL, &catalyst);
  fflush(stderr);
  dup2(terminal, STDERR_FILENO);
  if (fegetexcept() != (FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW)) fail("initialising changed what traps");
  const int times = count_in(said, text);
  if (code != wanted) fail("initialising returned another code than it must");
  if (strcmp(text, "-") != 0 && times != (rank == 0 ? 1 : 0)) fail("rank 0 must print it, once");
  if (code == VDI_CATALYST_OK) {
    const cost initialised = measure();
    print(rank, "initialised", none, initialised);
    if (json != NULL && initialised.of_paraview > 0) fail("ParaView or Python is loaded, which isn't needed");
    const char* most = getenv("VDI_TEST_MEBIBYTES");
    if (most != NULL && initialised.resident_kib - none.resident_kib > 1024 * atol(most))
      fail("initialising costs too much memory");
    if (finalize(catalyst) != VDI_CATALYST_OK) fail("finalising failed");
  } else if (catalyst != NULL || finalize(catalyst) != VDI_CATALYST_BAD_ARGUMENT) {
    fail("there must be no handle");
  }
  MPI_Finalize();
  return 0;
}
