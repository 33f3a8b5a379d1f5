/* libvdi_catalyst.so: what a simulation links. It is small, and loads the engine with ParaView when it is
 * initialised, so that a simulation that doesn't use it doesn't pay for ParaView. */
#include <dlfcn.h>
#include <fenv.h>
#include <mpi.h>
#include <stdio.h>
#include <string.h>

#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/ProcessState.h"

enum { MESSAGE_SIZE = 4096, PATH_SIZE = 2048 };

/* Null until the engine is loaded. Like the loaded library itself, there is one a process. */
static const vdi_catalyst_functions* engine;

/* The engine lies in a folder beside this library. 0 if this library's own place is unknown or too long. */
static int engine_path(char path[PATH_SIZE]) {
  Dl_info self;
  if (dladdr((const void*)&engine, &self) == 0 || self.dli_fname == NULL) return 0;
  const char* slash = strrchr(self.dli_fname, '/');
  const int folder = slash != NULL ? (int)(slash - self.dli_fname) : 1;
  const int length = snprintf(path, PATH_SIZE, "%.*s/" VDI_CATALYST_ENGINE_FILE, folder,
                              slash != NULL ? self.dli_fname : ".");
  return length < PATH_SIZE;
}

/* Loads the engine, unless it is. Returns 0, or 1 with what went wrong in `message`. */
static int load_engine(char message[MESSAGE_SIZE]) {
  if (engine != NULL) return 0;
  char path[PATH_SIZE];
  if (!engine_path(path)) {
    snprintf(message, MESSAGE_SIZE, "the engine can't be found: the path of libvdi_catalyst.so is unknown");
    return 1;
  }
  /* Local: ParaView's symbols and those of the many libraries below it don't mix with the simulation's. */
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  engine = library != NULL ? dlsym(library, VDI_CATALYST_ENGINE_SYMBOL) : NULL;
  const char* reason = engine == NULL ? dlerror() : NULL;
  if (engine != NULL) return 0;
  snprintf(message, MESSAGE_SIZE,
           "the engine %s can't be loaded: %s; it needs " VDI_PARAVIEW
           " with Python on every node (Debian: python3-paraview), its libraries on the loader's path "
           "(LD_LIBRARY_PATH), and libvdi_catalyst.so of the same version of pv-vdi",
           path, reason != NULL ? reason : "no reason is known");
  return 1;
}

/* MPI_COMM_NULL if MPI isn't running or the handle is none. */
static MPI_Comm communicator_of(int32_t fortran_handle) {
  int running = 0;
  int over = 0;
  MPI_Initialized(&running);
  MPI_Finalized(&over);
  if (!running || over) return MPI_COMM_NULL;
  const MPI_Comm comm = MPI_Comm_f2c(fortran_handle);
  return comm != NULL ? comm : MPI_COMM_NULL; /* OpenMPI's answer to a wrong handle */
}

/* Whether a rank failed. Rank 0 prints the message of the lowest one that did. */
static int failed_anywhere(MPI_Comm comm, int failed, char message[MESSAGE_SIZE]) {
  int rank = 0;
  int size = 0;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  int speaker = failed ? rank : size;
  MPI_Allreduce(MPI_IN_PLACE, &speaker, 1, MPI_INT, MPI_MIN, comm);
  if (speaker == size) return 0;
  MPI_Bcast(message, MESSAGE_SIZE, MPI_CHAR, speaker, comm);
  if (rank == 0) fprintf(stderr, "vdi_catalyst: rank %d: %s\n", speaker, message);
  return 1;
}

int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count, const char* const* scripts,
                            vdi_catalyst** catalyst) {
  if (catalyst == NULL) return VDI_CATALYST_BAD_ARGUMENT;
  *catalyst = NULL;
  const MPI_Comm comm = communicator_of(fortran_communicator);
  if (comm == MPI_COMM_NULL) {
    fprintf(stderr, "vdi_catalyst: there is no MPI, or no communicator has this Fortran handle\n");
    return VDI_CATALYST_BAD_ARGUMENT;
  }
  char message[MESSAGE_SIZE] = "";
  int code = VDI_CATALYST_ENGINE;
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int failed = load_engine(message);
  if (!failed_anywhere(comm, failed, message) && engine != NULL)
    code = engine->initialize(fortran_communicator, script_count, scripts, catalyst);
  vdi_process_state_restore(&state);
  return code;
}

/* Without an engine there are no handles either. */
static int usable(const vdi_catalyst* catalyst) {
  int over = 0;
  MPI_Finalized(&over);
  return engine != NULL && catalyst != NULL && !over;
}

/* This and the next two functions run nothing but our own code, which changes no more than that. */
int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  fenv_t floating_point;
  feholdexcept(&floating_point);
  const int code = engine->set_blocks(catalyst, count, blocks);
  fesetenv(&floating_point);
  return code;
}

int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type, int32_t association,
                           const void* const* data) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  fenv_t floating_point;
  feholdexcept(&floating_point);
  const int code = engine->set_array(catalyst, name, type, association, data);
  fesetenv(&floating_point);
  return code;
}

int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                   int32_t association, int32_t components, const void* const* data,
                                   const vdi_catalyst_strides* strides) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  fenv_t floating_point;
  feholdexcept(&floating_point);
  const int code = engine->set_array_strided(catalyst, name, type, association, components, data, strides);
  fesetenv(&floating_point);
  return code;
}

int vdi_catalyst_wants(vdi_catalyst* catalyst, int64_t step, double time) {
  if (!usable(catalyst)) return 0;
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int wants = engine->wants(catalyst, step, time);
  vdi_process_state_restore(&state);
  return wants;
}

int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time) {
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int code = engine->execute(catalyst, step, time);
  vdi_process_state_restore(&state);
  return code;
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  int over = 0;
  MPI_Finalized(&over);
  if (over && engine != NULL && catalyst != NULL)
    fprintf(stderr, "vdi_catalyst: vdi_catalyst_finalize comes after MPI_Finalize, so nothing is ended\n");
  if (!usable(catalyst)) return VDI_CATALYST_BAD_ARGUMENT;
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int code = engine->finalize(catalyst);
  vdi_process_state_restore(&state);
  return code;
}

const char* vdi_catalyst_error(const vdi_catalyst* catalyst) {
  return usable(catalyst) ? engine->error(catalyst) : "";
}
