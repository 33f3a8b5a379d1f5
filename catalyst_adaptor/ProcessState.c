#include "catalyst_adaptor/ProcessState.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { VDI_SIGNALS = 65 };

/* The part that belongs to the whole process. */
static struct {
  struct sigaction actions[VDI_SIGNALS]; /* by signal; [0] is unused */
  char* locale;                          /* null: unknown, because there was no memory */
  char** environment;                    /* null-terminated copies; null: no memory */
  int folder;                            /* a descriptor; -1: unknown */
  mode_t umask;
  struct rlimit limits[RLIM_NLIMITS];
} process;
static int users; /* calls under way, each of which is to restore it */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

/* The variables that scripts have set ("NAME=value") or removed ("NAME"), null-terminated; null at first.
 * There is one list a process, as there is one environment. */
static char** kept;

static void complain(const char* what) {
  fprintf(stderr, "vdi_catalyst: %s can't be restored\n", what);
}

static size_t count_of(char* const* variables) {
  size_t count = 0;
  while (variables != NULL && variables[count] != NULL) ++count;
  return count;
}

static void free_all(char** variables) {
  for (size_t i = 0; variables != NULL && variables[i] != NULL; ++i) free(variables[i]);
  free(variables);
}

/* Returns null if there is no memory. */
static char** copy_of(char* const* variables) {
  const size_t count = count_of(variables);
  char** copy = calloc(count + 1, sizeof *copy);
  for (size_t i = 0; copy != NULL && i < count; ++i) {
    copy[i] = strdup(variables[i]);
    if (copy[i] != NULL) continue;
    free_all(copy);
    return NULL;
  }
  return copy;
}

/* The length of the name in "NAME=value" or "NAME". */
static size_t name_length(const char* variable) {
  return strcspn(variable, "=");
}

/* The variable of that name; null if there is none. */
static char* find(char* const* variables, const char* name, size_t length) {
  for (size_t i = 0; variables != NULL && variables[i] != NULL; ++i) {
    if (name_length(variables[i]) == length && strncmp(variables[i], name, length) == 0) return variables[i];
  }
  return NULL;
}

/* "NAME=value" sets a variable, "NAME" removes it. Leaves a variable alone if it has the value already,
 * because other threads may be reading the environment. */
static void apply(const char* variable) {
  const size_t length = name_length(variable);
  const char* current = find(environ, variable, length);
  if (current == NULL ? variable[length] == '\0' : strcmp(current, variable) == 0) return;
  char* name = strndup(variable, length);
  const int failed =
      name == NULL || (variable[length] == '=' ? setenv(name, variable + length + 1, 1) : unsetenv(name));
  if (failed) complain("an environment variable");
  free(name);
}

static void apply_all(char* const* variables) {
  for (size_t i = 0; variables != NULL && variables[i] != NULL; ++i) apply(variables[i]);
}

/* Adds a copy of the first `length` bytes to the list, which has room. Returns whether there was memory. */
static int add(char** list, const char* variable, size_t length) {
  char** end = list + count_of(list);
  *end = strndup(variable, length);
  return *end != NULL;
}

/* The changes that lead from one environment to the other, for apply_all; null if there is no memory. */
static char** difference(char* const* from, char* const* to) {
  char** list = calloc(count_of(from) + count_of(to) + 1, sizeof *list);
  int good = list != NULL;
  for (size_t i = 0; good && to[i] != NULL; ++i) {
    const char* old = find(from, to[i], name_length(to[i]));
    if (old == NULL || strcmp(old, to[i]) != 0) good = add(list, to[i], strlen(to[i]));
  }
  for (size_t i = 0; good && from[i] != NULL; ++i) {
    const size_t length = name_length(from[i]);
    if (find(to, from[i], length) == NULL) good = add(list, from[i], length);
  }
  if (good) return list;
  free_all(list);
  return NULL;
}

static int same(char* const* a, char* const* b) {
  size_t i = 0;
  while (a[i] != NULL && b[i] != NULL && strcmp(a[i], b[i]) == 0) ++i;
  return a[i] == NULL && b[i] == NULL;
}

static void restore_environment(char** before) {
  if (before != NULL && same(before, environ)) { /* kept changes had no effect, or were undone */
    free_all(before);
    free_all(kept);
    kept = NULL;
    return;
  }
  char** changes = before != NULL ? difference(before, environ) : NULL;
  char** back = before != NULL ? difference(environ, before) : NULL;
  if (changes == NULL || back == NULL) complain("for lack of memory, the environment");
  if (changes != NULL) {
    free_all(kept);
    kept = changes;
  }
  apply_all(back);
  free_all(back);
  free_all(before);
}

/* Reads the umask, if possible without changing it, because another thread may be creating a file. */
static mode_t current_umask(void) {
  char line[256];
  unsigned int mask = 0;
  int found = 0;
  FILE* status = fopen("/proc/self/status", "re");
  while (status != NULL && !found && fgets(line, sizeof line, status) != NULL)
    found = sscanf(line, "Umask: %o", &mask) == 1;
  if (status != NULL) fclose(status);
  if (found) return (mode_t)mask;
  const mode_t before = umask(077);
  umask(before);
  return before;
}

static void save_actions(void) {
  for (int i = 1; i < VDI_SIGNALS; ++i) {
    /* libc reserves some signals, for which it returns an error. */
    if (sigaction(i, NULL, &process.actions[i]) != 0)
      memset(&process.actions[i], 0, sizeof process.actions[i]);
  }
  /* A write to a closed pipe or beyond the file size limit then returns an error. */
  if (process.actions[SIGPIPE].sa_handler == SIG_DFL) signal(SIGPIPE, SIG_IGN);
  if (process.actions[SIGXFSZ].sa_handler == SIG_DFL) signal(SIGXFSZ, SIG_IGN);
}

static int same_mask(const sigset_t* a, const sigset_t* b) {
  for (int i = 1; i < VDI_SIGNALS; ++i) {
    if (sigismember(a, i) != sigismember(b, i)) return 0;
  }
  return 1;
}

static void restore_actions(void) {
  for (int i = 1; i < VDI_SIGNALS; ++i) {
    const struct sigaction* before = &process.actions[i];
    struct sigaction now;
    if (sigaction(i, NULL, &now) != 0) continue;
    if (now.sa_sigaction == before->sa_sigaction && now.sa_flags == before->sa_flags &&
        same_mask(&now.sa_mask, &before->sa_mask))
      continue;
    sigaction(i, before, NULL);
  }
}

static void restore_stack(const stack_t* before) {
  stack_t now;
  /* A signal's handler can't change the stack that it runs on, nor can the functions that it calls. */
  if ((before->ss_flags & SS_ONSTACK) == 0 && sigaltstack(NULL, &now) == 0 &&
      (now.ss_sp != before->ss_sp || now.ss_flags != before->ss_flags))
    sigaltstack(before, NULL);
}

static void restore_locale(void) {
  uselocale(LC_GLOBAL_LOCALE);
  const char* now = setlocale(LC_ALL, NULL);
  const int same = now != NULL && process.locale != NULL && strcmp(now, process.locale) == 0;
  if (!same && (process.locale == NULL || setlocale(LC_ALL, process.locale) == NULL)) complain("the locale");
  free(process.locale);
}

static void restore_folder(void) {
  const int folder = process.folder;
  struct stat before;
  struct stat now;
  const int known = folder >= 0 && fstat(folder, &before) == 0;
  const int same =
      known && stat(".", &now) == 0 && now.st_dev == before.st_dev && now.st_ino == before.st_ino;
  if (!same && (!known || fchdir(folder) != 0)) complain("the working directory");
  if (folder >= 0) close(folder);
}

static void restore_limits(void) {
  for (int i = 0; i < RLIM_NLIMITS; ++i) {
    struct rlimit now;
    if (getrlimit((__rlimit_resource_t)i, &now) != 0 || now.rlim_cur == process.limits[i].rlim_cur) continue;
    now.rlim_cur = process.limits[i].rlim_cur; /* a lowered hard limit can't be raised again */
    if (setrlimit((__rlimit_resource_t)i, &now) != 0) complain("a limit of resources");
  }
}

static void save_process(void) {
  save_actions();
  const char* locale = setlocale(LC_ALL, NULL);
  process.locale = locale != NULL ? strdup(locale) : NULL;
  process.environment = copy_of(environ);
  apply_all(kept);
  process.folder = open(".", O_PATH | O_DIRECTORY | O_CLOEXEC);
  process.umask = current_umask();
  for (int i = 0; i < RLIM_NLIMITS; ++i) getrlimit((__rlimit_resource_t)i, &process.limits[i]);
}

static void restore_process(void) {
  restore_limits();
  if (current_umask() != process.umask) umask(process.umask);
  restore_folder();
  restore_environment(process.environment);
  restore_locale();
  restore_actions();
}

void vdi_process_state_save(vdi_process_state* state) {
  fegetenv(&state->floating_point);
  fesetenv(FE_DFL_ENV);
  pthread_sigmask(SIG_SETMASK, NULL, &state->blocked);
  if (sigaltstack(NULL, &state->signal_stack) != 0) state->signal_stack.ss_flags = SS_ONSTACK;
  state->locale = uselocale((locale_t)0);
  pthread_mutex_lock(&lock);
  if (users++ == 0) save_process();
  pthread_mutex_unlock(&lock);
}

void vdi_process_state_restore(const vdi_process_state* state) {
  pthread_mutex_lock(&lock);
  if (--users == 0) restore_process();
  pthread_mutex_unlock(&lock);
  uselocale(state->locale);
  restore_stack(&state->signal_stack);
  pthread_sigmask(SIG_SETMASK, &state->blocked, NULL);
  fesetenv(&state->floating_point);
}
