#include "catalyst_adaptor/ProcessState.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

static void save_signals(vdi_process_state* state) {
  for (int i = 1; i < VDI_SIGNALS; ++i) {
    /* libc reserves some signals, for which it returns an error. */
    if (sigaction(i, NULL, &state->actions[i]) != 0) memset(&state->actions[i], 0, sizeof state->actions[i]);
  }
  pthread_sigmask(SIG_SETMASK, NULL, &state->blocked);
  if (sigaltstack(NULL, &state->signal_stack) != 0) state->signal_stack.ss_flags = SS_ONSTACK;
  /* A write to a closed pipe or beyond the file size limit then returns an error. */
  if (state->actions[SIGPIPE].sa_handler == SIG_DFL) signal(SIGPIPE, SIG_IGN);
  if (state->actions[SIGXFSZ].sa_handler == SIG_DFL) signal(SIGXFSZ, SIG_IGN);
}

static int same_mask(const sigset_t* a, const sigset_t* b) {
  for (int i = 1; i < VDI_SIGNALS; ++i) {
    if (sigismember(a, i) != sigismember(b, i)) return 0;
  }
  return 1;
}

static void restore_signals(const vdi_process_state* state) {
  for (int i = 1; i < VDI_SIGNALS; ++i) {
    const struct sigaction* before = &state->actions[i];
    struct sigaction now;
    if (sigaction(i, NULL, &now) != 0) continue;
    if (now.sa_sigaction == before->sa_sigaction && now.sa_flags == before->sa_flags &&
        same_mask(&now.sa_mask, &before->sa_mask))
      continue;
    sigaction(i, before, NULL);
  }
  pthread_sigmask(SIG_SETMASK, &state->blocked, NULL);
  stack_t stack;
  /* A signal's handler can't change the stack that it runs on, nor can the functions that it calls. */
  if ((state->signal_stack.ss_flags & SS_ONSTACK) == 0 && sigaltstack(NULL, &stack) == 0 &&
      (stack.ss_sp != state->signal_stack.ss_sp || stack.ss_flags != state->signal_stack.ss_flags))
    sigaltstack(&state->signal_stack, NULL);
}

static void restore_locale(vdi_process_state* state) {
  uselocale(LC_GLOBAL_LOCALE);
  const char* now = setlocale(LC_ALL, NULL);
  const int same = now != NULL && state->locale != NULL && strcmp(now, state->locale) == 0;
  if (!same && (state->locale == NULL || setlocale(LC_ALL, state->locale) == NULL)) complain("the locale");
  uselocale(state->thread_locale);
  free(state->locale);
}

static void restore_folder(int folder) {
  struct stat before;
  struct stat now;
  const int known = folder >= 0 && fstat(folder, &before) == 0;
  const int same =
      known && stat(".", &now) == 0 && now.st_dev == before.st_dev && now.st_ino == before.st_ino;
  if (!same && (!known || fchdir(folder) != 0)) complain("the working directory");
  if (folder >= 0) close(folder);
}

static void restore_limits(const struct rlimit* limits) {
  for (int i = 0; i < RLIM_NLIMITS; ++i) {
    struct rlimit now;
    if (getrlimit((__rlimit_resource_t)i, &now) != 0 || now.rlim_cur == limits[i].rlim_cur) continue;
    now.rlim_cur = limits[i].rlim_cur; /* a lowered hard limit can't be raised again */
    if (setrlimit((__rlimit_resource_t)i, &now) != 0) complain("a limit of resources");
  }
}

void vdi_process_state_save(vdi_process_state* state) {
  fegetenv(&state->floating_point);
  fesetenv(FE_DFL_ENV);
  save_signals(state);
  state->thread_locale = uselocale((locale_t)0);
  const char* locale = setlocale(LC_ALL, NULL);
  state->locale = locale != NULL ? strdup(locale) : NULL;
  state->environment = copy_of(environ);
  apply_all(kept);
  state->folder = open(".", O_PATH | O_DIRECTORY | O_CLOEXEC);
  state->umask = current_umask();
  for (int i = 0; i < RLIM_NLIMITS; ++i) getrlimit((__rlimit_resource_t)i, &state->limits[i]);
}

void vdi_process_state_restore(vdi_process_state* state) {
  restore_limits(state->limits);
  if (current_umask() != state->umask) umask(state->umask);
  restore_folder(state->folder);
  restore_environment(state->environment);
  restore_locale(state);
  restore_signals(state);
  fesetenv(&state->floating_point);
}
