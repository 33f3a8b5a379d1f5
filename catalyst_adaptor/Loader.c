/* libvdi_catalyst.so, which a simulation links. It is small, and loads an engine only when it is
 * initialised. A simulation that doesn't use ParaView therefore doesn't pay for it. */
#include <dlfcn.h>
#include <fenv.h>
#include <mpi.h>
#include <pthread.h>
#include <stdatomic.h>
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
  _Atomic(const vdi_catalyst_functions*) functions; /* null until it is loaded */
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

/* A run under way. A process has at most one of scripts and one of a JSON text. */
typedef struct vdi_run {
  const char* name;
  vdi_engine* engine;            /* of the handle; unchanged while it lives */
  _Atomic(vdi_catalyst*) handle; /* null: no run is under way. Any other handle has been finalized */
  atomic_flag is_entered;        /* a thread initialises the run, or is in a call of its handle */
} vdi_run;

static vdi_run script_run = {"a run of scripts", NULL, NULL, ATOMIC_FLAG_INIT};
static vdi_run json_run = {"a run without a script", NULL, NULL, ATOMIC_FLAG_INIT};
/* The process that initialised first; 0: none has. A child that it forks has copies of its MPI connections,
 * its stream's sockets and its device, which don't work there, so no call reaches an engine. */
static _Atomic(pid_t) owner;

static int is_forked(void) {
  const pid_t first = owner;
  return first != 0 && first != getpid();
}

/* The texts that vdi_catalyst_error returns in this thread: copies, because another thread's call may change
 * the engine's text meanwhile. */
enum { OF_HANDLE, WITHOUT_HANDLE, TEXTS };
static _Thread_local char* texts[TEXTS];
/* The handle of this thread's last call if that was refused because of another thread's call; else null. */
static _Thread_local const vdi_catalyst* refused;

static pthread_key_t texts_key; /* its value is `texts` of a thread that has any */
static pthread_once_t texts_once = PTHREAD_ONCE_INIT;

static void free_texts(void* all) {
  for (int i = 0; i < TEXTS; ++i) free(((char**)all)[i]);
}

static void make_texts_key(void) {
  pthread_key_create(&texts_key, free_texts);
}

/* Returns the thread's own copy, or a shorter text if there is no memory for it. */
static const char* keep_text(int which, const char* text) {
  pthread_once(&texts_once, make_texts_key);
  char* copy = pthread_setspecific(texts_key, texts) == 0 ? strdup(text) : NULL;
  free(texts[which]);
  texts[which] = copy;
  return copy != NULL ? copy : "out of memory";
}

static const char busy_text[] =
    "another thread is in a call of this handle, so this call was refused (VDI_CATALYST_BUSY)";

/* Prints it once in a process. */
static int refuse_busy(const vdi_catalyst* catalyst) {
  static atomic_flag is_told = ATOMIC_FLAG_INIT;
  refused = catalyst;
  if (!atomic_flag_test_and_set(&is_told)) fprintf(stderr, "vdi_catalyst: %s\n", busy_text);
  return VDI_CATALYST_BUSY;
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
  if (wanted->functions != NULL) return 0;
  const char* reason = dlerror();
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
  char text[MESSAGE_SIZE + 32];
  snprintf(text, sizeof text, "rank %d: %s", speaker, message);
  keep_text(WITHOUT_HANDLE, text);
  if (rank == 0) fprintf(stderr, "vdi_catalyst: %s\n", text);
  return 1;
}

/* Prints why this rank can't initialise. Not collective. */
static int refuse_initialize(const char* reason) {
  keep_text(WITHOUT_HANDLE, reason);
  fprintf(stderr, "vdi_catalyst: %s\n", reason);
  return VDI_CATALYST_BAD_ARGUMENT;
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

static int initialize_by(vdi_engine* tried, MPI_Comm comm, int32_t communicator, const vdi_given* given,
                         vdi_catalyst** catalyst) {
  int code = prepare(tried, comm);
  if (code != VDI_CATALYST_OK) return code;
  code = initialize_with(tried, communicator, given, catalyst);
  if (code != VDI_CATALYST_OK && code != VDI_CATALYST_NOT_ISOLATED)
    keep_text(WITHOUT_HANDLE, tried->functions->error(NULL));
  return code;
}

/* If the isolated engine may have to carry out the run, asks it first: a JSON text may ask for isolation,
 * too, and the isolated engine reads it. */
static int initialize_some(int32_t communicator, const vdi_given* given, vdi_run* run,
                           vdi_catalyst** catalyst) {
  const MPI_Comm comm = communicator_of(communicator);
  if (comm == MPI_COMM_NULL)
    return refuse_initialize("MPI isn't initialised, or the handle isn't a communicator's");
  char message[MESSAGE_SIZE];
  snprintf(message, sizeof message, "%s is still active in this process; finalize it first", run->name);
  if (failed_anywhere(comm, run->handle != NULL, message)) return VDI_CATALYST_ENGINE;
  int code = VDI_CATALYST_NOT_ISOLATED;
  if (given->kind == JSON_TEXT ||
      ((given->kind == SCRIPTS || given->kind == PIPELINES) && names_isolation(comm))) {
    run->engine = &isolated_engine;
    code = initialize_by(run->engine, comm, communicator, given, catalyst);
  }
  if (code == VDI_CATALYST_NOT_ISOLATED) {
    run->engine = run == &json_run ? &json_engine : &script_engine;
    code = initialize_by(run->engine, comm, communicator, given, catalyst);
  }
  return code;
}

static int initialize(int32_t communicator, const vdi_given* given, vdi_run* run, vdi_catalyst** catalyst) {
  if (catalyst == NULL) return VDI_CATALYST_BAD_ARGUMENT;
  *catalyst = NULL;
  if (is_forked())
    return refuse_initialize("a process forked after vdi_catalyst_initialize can't call it again");
  owner = getpid();
  if (atomic_flag_test_and_set_explicit(&run->is_entered, memory_order_acquire)) {
    keep_text(WITHOUT_HANDLE, busy_text);
    return refuse_busy(NULL);
  }
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int code = initialize_some(communicator, given, run, catalyst);
  if (code == VDI_CATALYST_OK) {
    keep_text(WITHOUT_HANDLE, "");
    run->handle = *catalyst;
  }
  vdi_process_state_restore(&state);
  atomic_flag_clear_explicit(&run->is_entered, memory_order_release);
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

static vdi_run* run_of(const vdi_catalyst* catalyst) {
  if (catalyst == NULL) return NULL;
  if (catalyst == json_run.handle) return &json_run;
  return catalyst == script_run.handle ? &script_run : NULL;
}

/* Begins a call of the handle, which `leave` ends. Returns null if the call must be refused, by the code
 * `*refusal`. */
static vdi_run* enter(const vdi_catalyst* catalyst, int* refusal) {
  int over = 0;
  MPI_Finalized(&over);
  *refusal = VDI_CATALYST_BAD_ARGUMENT;
  refused = NULL;
  vdi_run* const run = over || is_forked() ? NULL : run_of(catalyst);
  if (run == NULL) return NULL;
  if (atomic_flag_test_and_set_explicit(&run->is_entered, memory_order_acquire)) {
    *refusal = refuse_busy(catalyst);
    return NULL;
  }
  if (run->handle == catalyst) return run;
  atomic_flag_clear_explicit(&run->is_entered, memory_order_release); /* finalized in the meantime */
  return NULL;
}

static void leave(vdi_run* run) {
  refused = NULL; /* a call within this one, of a signal's handler, was an earlier one */
  atomic_flag_clear_explicit(&run->is_entered, memory_order_release);
}

/* The state that a call restores: `all` of the process's, or only the floating-point environment. */
typedef struct vdi_saved {
  int all;
  vdi_process_state state;
  fenv_t floating_point;
} vdi_saved;

static void save(int all, vdi_saved* saved) {
  saved->all = all;
  if (all) {
    vdi_process_state_save(&saved->state);
  } else {
    feholdexcept(&saved->floating_point);
  }
}

static void restore(const vdi_saved* saved) {
  if (saved->all) {
    vdi_process_state_restore(&saved->state);
  } else {
    fesetenv(&saved->floating_point);
  }
}

/* The body of a function that calls the engine's entry. If the call is refused, by the code `refusal`, it
 * returns `otherwise`. */
#define RETURN_RESTORED(type, otherwise, all, call) \
  int refusal;                                      \
  vdi_run* const run = enter(catalyst, &refusal);   \
  if (run == NULL) return (otherwise);              \
  vdi_saved saved;                                  \
  save((all), &saved);                              \
  const type result = run->engine->functions->call; \
  restore(&saved);                                  \
  leave(run);                                       \
  return result

/* For entries that run only our own code, which changes nothing but the floating-point environment. */
#define RETURN_CALL(type, otherwise, call) RETURN_RESTORED(type, otherwise, 0, call)
/* For entries that run other code, too, unless the isolated engine has them. */
#define RETURN_GUARDED_CALL(otherwise, call) \
  RETURN_RESTORED(int, otherwise, run->engine != &isolated_engine, call)

int vdi_catalyst_set_blocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  RETURN_CALL(int, refusal, set_blocks(catalyst, count, blocks));
}

int vdi_catalyst_set_array(vdi_catalyst* catalyst, const char* name, int32_t type, int32_t association,
                           const void* const* data) {
  RETURN_CALL(int, refusal, set_array(catalyst, name, type, association, data));
}

int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                   int32_t association, int32_t components, const void* const* data,
                                   const vdi_catalyst_strides* strides) {
  RETURN_CALL(int, refusal, set_array_strided(catalyst, name, type, association, components, data, strides));
}

int vdi_catalyst_set_array_missing(vdi_catalyst* catalyst, const char* name, int32_t association,
                                   int32_t count, const double* values) {
  RETURN_CALL(int, refusal, set_array_missing(catalyst, name, association, count, values));
}

int vdi_catalyst_set_array_offset(vdi_catalyst* catalyst, const char* name, int32_t association,
                                  const double offset[3]) {
  RETURN_CALL(int, refusal, set_array_offset(catalyst, name, association, offset));
}

int vdi_catalyst_set_particles(vdi_catalyst* catalyst, const char* name,
                               const vdi_catalyst_particles* particles) {
  RETURN_CALL(int, refusal, set_particles(catalyst, name, particles));
}

int vdi_catalyst_set_stream(vdi_catalyst* catalyst, void* stream) {
  RETURN_CALL(int, refusal, set_stream(catalyst, stream));
}

int vdi_catalyst_wants(vdi_catalyst* catalyst, int64_t step, double time) {
  RETURN_GUARDED_CALL(0, wants(catalyst, step, time));
}

int vdi_catalyst_execute(vdi_catalyst* catalyst, int64_t step, double time) {
  RETURN_GUARDED_CALL(refusal, execute(catalyst, step, time));
}

void vdi_catalyst_wanted_steps(vdi_catalyst* catalyst, int64_t first, int32_t count, uint8_t* wanted) {
  int refusal;
  vdi_run* const run = enter(catalyst, &refusal);
  if (run == NULL) return;
  if (run->engine->functions->wanted_steps != NULL) {
    vdi_saved saved;
    save(run->engine != &isolated_engine, &saved);
    run->engine->functions->wanted_steps(catalyst, first, count, wanted);
    restore(&saved);
  }
  leave(run);
}

void vdi_catalyst_set_clock(vdi_catalyst* catalyst, double seconds) {
  int refusal;
  vdi_run* const run = enter(catalyst, &refusal);
  if (run == NULL) return;
  if (run->engine->functions->set_clock != NULL) run->engine->functions->set_clock(catalyst, seconds);
  leave(run);
}

void vdi_catalyst_log_left_out(vdi_catalyst* catalyst, int64_t step, double time) {
  int refusal;
  vdi_run* const run = enter(catalyst, &refusal);
  if (run == NULL) return;
  if (run->engine->functions->log_left_out != NULL)
    run->engine->functions->log_left_out(catalyst, step, time);
  leave(run);
}

double vdi_catalyst_parameter_f64(vdi_catalyst* catalyst, const char* name, double value, double low,
                                  double high) {
  RETURN_CALL(double, value, parameter_f64(catalyst, name, value, low, high));
}

int64_t vdi_catalyst_parameter_i64(vdi_catalyst* catalyst, const char* name, int64_t value, int64_t low,
                                   int64_t high) {
  RETURN_CALL(int64_t, value, parameter_i64(catalyst, name, value, low, high));
}

int vdi_catalyst_refuse(vdi_catalyst* catalyst, const char* reason) {
  RETURN_CALL(int, refusal, refuse(catalyst, reason));
}

/* `keeps_engine`: the engine stays for another run, if it can. */
static int finalize(vdi_catalyst* catalyst, int keeps_engine) {
  if (catalyst != NULL && is_forked()) return VDI_CATALYST_OK; /* the run ends in the process that began it */
  int over = 0;
  MPI_Finalized(&over);
  if (over && catalyst != NULL && owner != 0)
    fprintf(stderr, "vdi_catalyst: vdi_catalyst_finalize comes after MPI_Finalize, so nothing is ended\n");
  int refusal;
  vdi_run* const run = enter(catalyst, &refusal);
  if (run == NULL) return refusal;
  const vdi_catalyst_functions* const engine = run->engine->functions;
  vdi_process_state state;
  vdi_process_state_save(&state);
  const int code =
      keeps_engine && engine->end_run != NULL ? engine->end_run(catalyst) : engine->finalize(catalyst);
  if (code != VDI_CATALYST_OK) keep_text(WITHOUT_HANDLE, engine->error(NULL));
  run->handle = NULL;
  vdi_process_state_restore(&state);
  leave(run);
  return code;
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  return finalize(catalyst, 0);
}

int vdi_catalyst_end_run(vdi_catalyst* catalyst) {
  return finalize(catalyst, 1);
}

const char* vdi_catalyst_error(const vdi_catalyst* catalyst) {
  if (catalyst == NULL) return texts[WITHOUT_HANDLE] != NULL ? texts[WITHOUT_HANDLE] : "";
  if (catalyst == refused && run_of(catalyst) != NULL) return busy_text;
  int refusal;
  vdi_run* const run = enter(catalyst, &refusal);
  if (run == NULL) return refusal == VDI_CATALYST_BUSY ? busy_text : "";
  const char* const text = keep_text(OF_HANDLE, run->engine->functions->error(catalyst));
  leave(run);
  return text;
}
