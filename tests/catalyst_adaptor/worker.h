/* For simulations whose frames are made in separate processes: finds those processes. VDI_TEST_RUN in the
 * environment has to tell this run from others. */
#ifndef VDI_TESTS_CATALYST_WORKER_H
#define VDI_TESTS_CATALYST_WORKER_H

#include <dirent.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>

/* Whether a process is the worker of this simulation's rank: a worker with the same VDI_TEST_RUN. */
static inline int is_mine(const char* process, int rank) {
  char path[300];
  static char text[1 << 20];
  snprintf(path, sizeof path, "/proc/%s/environ", process);
  FILE* file = fopen(path, "re");
  if (file == NULL) return 0;
  size_t count = fread(text, 1, sizeof text - 1, file);
  fclose(file);
  text[count] = '\0';
  char run[100];
  char own[100];
  snprintf(run, sizeof run, "VDI_TEST_RUN=%s", getenv("VDI_TEST_RUN"));
  snprintf(own, sizeof own, "OMPI_COMM_WORLD_RANK=%d", rank);
  int found = 0;
  for (const char* one = text; one < text + count; one += strlen(one) + 1)
    found |= strcmp(one, run) == 0 ? 1 : strcmp(one, own) == 0 ? 2 : 0;
  snprintf(path, sizeof path, "/proc/%s/cmdline", process);
  file = fopen(path, "re");
  if (file == NULL) return 0;
  count = fread(text, 1, sizeof text - 1, file);
  fclose(file);
  text[count] = '\0';
  const int is_worker =
      strstr(text, "vdi_catalyst_process") != NULL && strcmp(text + strlen(text) + 1, "work") == 0;
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  return is_worker && found == (ranks > 1 ? 3 : 1);
}

/* The process that makes this rank's frames; 0 if there is none. */
static inline pid_t worker_of(int rank) {
  DIR* folder = opendir("/proc");
  pid_t worker = 0;
  for (const struct dirent* entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
    if (entry->d_name[0] >= '1' && entry->d_name[0] <= '9' && is_mine(entry->d_name, rank))
      worker = (pid_t)atoi(entry->d_name);
  }
  closedir(folder);
  return worker;
}

#endif
