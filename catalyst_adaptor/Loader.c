/* libvdi_catalyst.so, which a simulation links. It is small, and loads an engine only when it is
 * initialised. A simulation that doesn't use ParaView therefore doesn't pay for it. */
#include <dlfcn.h>
#include <fenv.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/ProcessState.h"

enum { MESSAGE_SIZE = 4096, PATH_SIZE = 2048 };

/* An engine: it runs scripts in ParaView, or carries out a JSON text, here or in another process. */
typedef struct vdi_engine {
  const char* file; /* in a folder beside this library */
  const char* needs;
  const vdi_catalyst_functions* functions; /* null until it is loaded */
} vdi_engine;

/* A process has one of each, as it has one of each loaded library. */
static vdi_engine script_engine = {
    VDI_CATALYST_ENGINE_FILE,
    VDI_PARAVIEW
    " with Python on every node (Debian: python3-paraview), its libraries on the loader's path "
    "(LD_LIBRARY_PATH)",
    NULL};
static vdi_engine json_engine = {VDI_CATALYST_JSON_FILE, "the Vulkan loader (Debian: libvulkan1)", NULL};
static vdi_engine isolated_engine = {VDI_CATALYST_ISOLATED_FILE, "no other package", NULL};

/* The engines of the two kinds of runs; null before the first run. */
static vdi_engine* script_run;
static vdi_engine* json_run;
/* The JSON run's handle until it is finalized. All other handles belong to the run of scripts, whose engine
 * knows its own. */
static const vdi_catalyst* json_handle;
/* The process that initialised first; 0: none has. A child that it forks has copies of its MPI connections,
 * its stream's sockets and its device, which don't work there, so no call reaches an engine. */
static pid_t owner;

static int is_forked(void) {
  return owner != 0 && owner != getpid();
}

/* Returns 0 if this library's own path is unknown or too long. */
static int engine_path(const char* file, char path[PATH_SIZE]) {
  Dl_info self;
  if (dladdr((const void*)&script_engine, &self) == 0 || self.dli_fname == NULL) return 0;
  const char* slash = strrchr(self.dli_fname, '/');
  const int folder = slash != NULL ? (int)(slash - self.dli_fname) : 1;
  const int length = snprintf(path, PATH_SIZE, "%.*s/%s", folder, slash != NULL ? self.dli_fname : ".", file);
  return length < PATH_SIZE;
}

/* Loads the engine unless it is loaded. Returns 0, or 1 with the reason in `message`. */
static int load_engine(vdi_engine* wanted, char message[MESSAGE_SIZE]) {
  if (wanted->functions != NULL) return 0;
  char path[PATH_SIZE];
  if (!engine_path(wanted->file, path)) {
    snprintf(message, MESSAGE_SIZE, "the engine can't be found: the path of libvdi_catalyst.so is unknown");
    return 1;
  }
  /* RTLD_LOCAL keeps the symbols of the engine's many libraries apart from the simulation's. */
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  wanted->functions = library != NULL ? dlsym(library, VDI_CATALYST_ENGINE_SYMBOL) : NULL;
  const char* reason = wanted->functions == NULL ? dlerror() : NULL;
  if (wanted->functions != NULL) return 0;
  snprintf(
      message, MESSAGE_SIZE,
      "the engine %s can't be loaded: %s; it needs %s, and libvdi_catalyst.so of the same version of pv-vdi",
      path, reason != NULL ? reason : "no reason is known", wanted->needs);
  return 1;
}

/* Returns MPI_COMM_NULL if MPI isn't running, or the handle is no communicator's. */
static MPI_Comm communicator_of(int32_t fortran_handle) {
  int running = 0;
  int over = 0;
  MPI_Initialized(&running);
  MPI_Finalized(&over);
  if (!running || over) return MPI_COMM_NULL;
  const MPI_Comm comm = MPI_Comm_f2c(fortran_handle);
  return comm != NULL ? comm : MPI_COMM_NULL; /* OpenMPI's answer to a wrong handle */
}

/* Collective: returns whether a rank failed. Rank 0 prints the message of the lowest rank that did. */
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

/* Loads the engine on all ranks. Returns the code for the simulation. */
static int prepare(vdi_engine* wanted, MPI_Comm comm) {
  char message[MESSAGE_SIZE] = "";
  const int failed = load_engine(wanted, message);
  return failed_anywhere(comm, failed, message) || failed ? VDI_CATALYST_ENGINE : VDI_CATALYST_OK;
}

/* Collective: returns whether the first rank's environment sets VDI_ISOLATION. */
static int names_isolation(MPI_Comm comm) {
  const char* value = getenv("VDI_ISOLATION");
  int names = value != NULL && *value != '\0';
  MPI_Bcast(&names, 1, MPI_INT, 0, comm);
  return names;
}

/* The ways to initialise. The last two are those of a process that makes an isolated run's frames. */
typedef enum vdi_kind { SCRIPTS, PIPELINES, JSON_TEXT, FRAMES_OF_JSON, FRAMES_OF_PIPELINES } vdi_kind;

/* The arguments with which a simulation or such a process initialises. */
typedef struct vdi_given {
  const char* const* scripts;
  const vdi_catalyst_pipeline* pipelines;
  int32_t count; /* of scripts or pipelines; FRAMES_OF_JSON: whether the process succeeds another one */
  const char* json;
  vdi_kind kind;
} vdi_given;

static int initialize_with(const vdi_engine* engine, int32_t communicator, const vdi_given* given,
                           vdi_catalyst** catalyst) {
  switch (given->kind) {
    case SCRIPTS:
      return engine->functions->initialize(communicator, given->count, given->scripts, catalyst);
    case PIPELINES:
      return engine->functions->initialize_pipelines(communicator, given->count, given->pipelines, catalyst);
    case JSON_TEXT:
      return engine->functions->initialize_json(communicator, given->json, catalyst);
    case FRAMES_OF_JSON:
      return engine->functions->make_frames_of_json(communicator, given->json, given->count, catalyst);
    case FRAMES_OF_PIPELINES:
      break;
  }
  return engine->functions->make_frames_of_pipelines(communicator, given->count, given->pipelines, catalyst);
}

/* If the isolated engine may have to carry out the run, asks it first. */
static int initialize_some(int32_t communicator, const vdi_given* given, vdi_engine** run,
                           vdi_catalyst** catalyst) {
  const MPI_Comm comm = communicator_of(communicator);
  if (comm == MPI_COMM_NULL) {
    fprintf(stderr, "vdi_catalyst: MPI isn't initialised, or the handle isn't a communicator's\n");
    return VDI_CATALYST_BAD_ARGUMENT;
  }
  /* A JSON text may ask for isolation, too, and the isolated engine reads it. The engine of a JSON run under
   * way refuses another one. */
  const int goes_on = run == &json_run && json_handle != NULL;
  vdi_engine* const own = run == &json_run ? &json_engine : &script_engine;
  const int isolated =
      goes_on ? *run == &isolated_engine
              : given->kind == JSON_TEXT ||
                    ((given->kind == SCRIPTS || given->kind == PIPELINES) && names_isolation(comm));
  vdi_engine* tried = isolated ? &isolated_engine : own;
  int code = prepare(tried, comm);
  if (code == VDI_CATALYST_OK) code = initialize_with(tried, communicator, given, catalyst);
  if (code == VDI_CATALYST_NOT_ISOLATED) {
    tried = own;
    code = prepare(tried, comm);
    if (code == VDI_CATALYST_OK) code = initialize_with(tried, communicator, given, catalyst);
  }
  if (code == VDI_CATALYST_OK) *run = tried;
  return code;
}

static int initialize(int32_t communicator, const vdi_given* given, vdi_engine** run,
                      vdi_catalyst** catalyst) {
  if (catalyst == NULL) return VDI_CATALYST_BAD_ARGUMENT;
  *catalyst = NULL;
  if (is_forked()) {
    fprintf(stderr, "vdi_catalyst: a process forked after vdi_catalyst_initialize can't call it again\n");
    return VDI_CATALYST_BAD_ARGUMENT;
  }
  owner = getpid();
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int code = initialize_some(communicator, given, run, catalyst);
  if (code == VDI_CATALYST_OK && run == &json_run) json_handle = *catalyst;
  vdi_process_state_restore(&state);
  return code;
}

int vdi_catalyst_initialize(int32_t fortran_communicator, int32_t script_count, const char* const* scripts,
                            vdi_catalyst** catalyst) {
  const vdi_given given = {scripts, NULL, script_count, NULL, SCRIPTS};
  return initialize(fortran_communicator, &given, &script_run, catalyst);
}

int vdi_catalyst_initialize_pipelines(int32_t fortran_communicator, int32_t script_count,
                                      const vdi_catalyst_pipeline* scripts, vdi_catalyst** catalyst) {
  const vdi_given given = {NULL, scripts, script_count, NULL, PIPELINES};
  return initialize(fortran_communicator, &given, &script_run, catalyst);
}

int vdi_catalyst_initialize_json(int32_t fortran_communicator, const char* json, vdi_catalyst** catalyst) {
  const vdi_given given = {NULL, NULL, 0, json, JSON_TEXT};
  return initialize(fortran_communicator, &given, &json_run, catalyst);
}

int vdi_catalyst_make_frames_of_json(int32_t fortran_communicator, const char* json, int goes_on,
                                     vdi_catalyst** catalyst) {
  const vdi_given given = {NULL, NULL, goes_on, json, FRAMES_OF_JSON};
  return initialize(fortran_communicator, &given, &json_run, catalyst);
}

int vdi_catalyst_make_frames_of_pipelines(int32_t fortran_communicator, int32_t script_count,
                                          const vdi_catalyst_pipeline* scripts, vdi_catalyst** catalyst) {
  const vdi_given given = {NULL, scripts, script_count, NULL, FRAMES_OF_PIPELINES};
  return initialize(fortran_communicator, &given, &script_run, catalyst);
}

/* The engine for this handle; null if none may be called. Without an engine there are no handles. */
static const vdi_engine* engine_of(const vdi_catalyst* catalyst) {
  int over = 0;
  MPI_Finalized(&over);
  if (over || catalyst == NULL || is_forked()) return NULL;
  return catalyst == json_handle ? json_run : script_run;
}

static const vdi_catalyst_functions* functions_of(const vdi_catalyst* catalyst) {
  const vdi_engine* engine = engine_of(catalyst);
  return engine != NULL ? engine->functions : NULL;
}

/* The part of the process's state that a call may change, and that it restores. The isolated engine runs only
 * our own code here, which changes nothing but the floating-point environment. */
typedef struct vdi_saved {
  int all;
  vdi_process_state state;
  fenv_t floating_point;
} vdi_saved;

static void save(const vdi_engine* engine, vdi_saved* saved) {
  saved->all = engine != &isolated_engine;
  if (saved->all) {
    vdi_process_state_save(&saved->state);
  } else {
    feholdexcept(&saved->floating_point);
  }
}

static void restore(vdi_saved* saved) {
  if (saved->all) {
    vdi_process_state_restore(&saved->state);
  } else {
    fesetenv(&saved->floating_point);
  }
}

/* The body of a function that calls the engine's entry, if there is one. These entries run only our own code,
 * which changes nothing but the floating-point environment. */
#define RETURN_CALL(type, without_engine, call)                  \
  const vdi_catalyst_functions* engine = functions_of(catalyst); \
  if (engine == NULL) return (without_engine);                   \
  fenv_t floating_point;                                         \
  feholdexcept(&floating_point);                                 \
  const type result = engine->call;                              \
  fesetenv(&floating_point);                                     \
  return result

int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  RETURN_CALL(int, VDI_CATALYST_BAD_ARGUMENT, set_blocks(catalyst, count, blocks));
}

int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type, int32_t association,
                           const void* const* data) {
  RETURN_CALL(int, VDI_CATALYST_BAD_ARGUMENT, set_array(catalyst, name, type, association, data));
}

int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                   int32_t association, int32_t components, const void* const* data,
                                   const vdi_catalyst_strides* strides) {
  RETURN_CALL(int, VDI_CATALYST_BAD_ARGUMENT,
              set_array_strided(catalyst, name, type, association, components, data, strides));
}

int vdi_catalyst_set_array_offset(vdi_catalyst* catalyst, const char* name, int32_t association,
                                  const double offset[3]) {
  RETURN_CALL(int, VDI_CATALYST_BAD_ARGUMENT, set_array_offset(catalyst, name, association, offset));
}

int vdi_catalyst_set_particles(vdi_catalyst* catalyst, const char* name,
                               const vdi_catalyst_particles* particles) {
  RETURN_CALL(int, VDI_CATALYST_BAD_ARGUMENT, set_particles(catalyst, name, particles));
}

int vdi_catalyst_wants(vdi_catalyst* catalyst, int64_t step, double time) {
  const vdi_engine* engine = engine_of(catalyst);
  if (engine == NULL) return 0;
  vdi_saved saved;
  save(engine, &saved);
  const int wants = engine->functions->wants(catalyst, step, time);
  restore(&saved);
  return wants;
}

int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time) {
  const vdi_engine* engine = engine_of(catalyst);
  if (engine == NULL) return VDI_CATALYST_BAD_ARGUMENT;
  vdi_saved saved;
  save(engine, &saved);
  const int code = engine->functions->execute(catalyst, step, time);
  restore(&saved);
  return code;
}

void vdi_catalyst_wanted_steps(vdi_catalyst* catalyst, int64_t first, int32_t count, uint8_t* wanted) {
  const vdi_engine* engine = engine_of(catalyst);
  if (engine == NULL || engine->functions->wanted_steps == NULL) return;
  vdi_saved saved;
  save(engine, &saved);
  engine->functions->wanted_steps(catalyst, first, count, wanted);
  restore(&saved);
}

void vdi_catalyst_set_clock(vdi_catalyst* catalyst, double seconds) {
  const vdi_catalyst_functions* engine = functions_of(catalyst);
  if (engine != NULL && engine->set_clock != NULL) engine->set_clock(catalyst, seconds);
}

void vdi_catalyst_log_left_out(vdi_catalyst* catalyst, int64_t step, double time) {
  const vdi_catalyst_functions* engine = functions_of(catalyst);
  if (engine != NULL && engine->log_left_out != NULL) engine->log_left_out(catalyst, step, time);
}

double vdi_catalyst_parameter_f64(vdi_catalyst* catalyst, const char* name, double value, double low,
                                  double high) {
  RETURN_CALL(double, value, parameter_f64(catalyst, name, value, low, high));
}

int64_t vdi_catalyst_parameter_i64(vdi_catalyst* catalyst, const char* name, int64_t value, int64_t low,
                                   int64_t high) {
  RETURN_CALL(int64_t, value, parameter_i64(catalyst, name, value, low, high));
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  if (catalyst != NULL && is_forked()) return VDI_CATALYST_OK; /* the run ends in the process that began it */
  int over = 0;
  MPI_Finalized(&over);
  if (over && catalyst != NULL && (script_run != NULL || json_run != NULL))
    fprintf(stderr, "vdi_catalyst: vdi_catalyst_finalize comes after MPI_Finalize, so nothing is ended\n");
  const vdi_catalyst_functions* engine = functions_of(catalyst);
  if (engine == NULL) return VDI_CATALYST_BAD_ARGUMENT;
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int code = engine->finalize(catalyst);
  if (catalyst == json_handle) json_handle = NULL;
  vdi_process_state_restore(&state);
  return code;
}

const char* vdi_catalyst_error(const vdi_catalyst* catalyst) {
  const vdi_catalyst_functions* engine = functions_of(catalyst);
  return engine != NULL ? engine->error(catalyst) : "";
}
