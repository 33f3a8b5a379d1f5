/* Loaded before a program (LD_PRELOAD): ends the worker of vdi_catalyst_process in one of its stages, and
 * leaves all other programs alone. VDI_TEST_DIE is STAGE:RANK:HOW. Stages: start, initialize, waiting,
 * taking, generating, writing, finalizing. HOW: kill, stop (as by SIGSTOP), exit (with status 7); or sleep,
 * for 3 seconds, which doesn't end it. Two more stages have the HOW fail: in mapping, the worker can't map
 * the pages of a step of more than 64 KiB; in noting, those of the steps that were left out.
 * If VDI_TEST_DIE_ONCE names a file, a worker dies only if that file exists, and removes it first. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <mpi.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include <vulkan/vulkan.h>

#include "catalyst_adaptor/vdi_catalyst.h"

static int is_worker(void) {
  static int answer = -1;
  if (answer >= 0) return answer;
  char line[4096] = "";
  FILE* file = fopen("/proc/self/cmdline", "re");
  const size_t count = file != NULL ? fread(line, 1, sizeof line - 1, file) : 0;
  if (file != NULL) fclose(file);
  const char* second = line + strlen(line) + 1;
  answer = count > 0 && strstr(line, "vdi_catalyst_process") != NULL && strcmp(second, "work") == 0;
  return answer;
}

/* Whether the worker fails in this stage. It has ended unless it does so by failing. */
static int die_if(const char* stage) {
  const char* wish = getenv("VDI_TEST_DIE");
  char at[32] = "";
  char how[32] = "";
  int rank = 0;
  if (wish == NULL || !is_worker() || sscanf(wish, "%31[a-z]:%d:%31s", at, &rank, how) != 3) return 0;
  const char* own = getenv("OMPI_COMM_WORLD_RANK");
  if (strcmp(at, stage) != 0 || rank != (own != NULL ? atoi(own) : 0)) return 0;
  const char* once = getenv("VDI_TEST_DIE_ONCE");
  if (once != NULL && unlink(once) != 0) return 0;
  if (strcmp(how, "fail") == 0) return 1;
  if (strcmp(how, "exit") == 0) _exit(7);
  if (strcmp(how, "sleep") == 0) {
    sleep(3);
    return 0;
  }
  kill(getpid(), strcmp(how, "stop") == 0 ? SIGSTOP : SIGKILL);
  return 0;
}

__attribute__((constructor)) static void begin(void) {
  die_if("start");
}

static int has_initialized;

int MPI_Init_thread(int* argc, char*** argv, int required, int* provided) {
  int (*next)(int*, char***, int, int*) =
      (int (*)(int*, char***, int, int*))dlsym(RTLD_NEXT, "MPI_Init_thread");
  const int code = next(argc, argv, required, provided);
  die_if("initialize");
  has_initialized = 1;
  return code;
}

/* The pages that the simulation shares are those of a memfd named pv-vdi. The run's own come before MPI. */
static int is_shared(int file) {
  char link[64];
  char name[64] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  return readlink(link, name, sizeof name - 1) > 0 && strncmp(name, "/memfd:pv-vdi", 13) == 0;
}

void* mmap(void* at, size_t size, int access, int flags, int file, off_t offset) {
  void* (*next)(void*, size_t, int, int, int, off_t) =
      (void* (*)(void*, size_t, int, int, int, off_t))dlsym(RTLD_NEXT, "mmap");
  if (has_initialized && file >= 0 && is_shared(file) && die_if(size > 65536 ? "mapping" : "noting")) {
    errno = ENOMEM;
    return MAP_FAILED;
  }
  return next(at, size, access, flags, file, offset);
}

/* The worker waits for a step without a limit, on its first thread. */
int poll(struct pollfd* events, nfds_t count, int limit) {
  int (*next)(struct pollfd*, nfds_t, int) = (int (*)(struct pollfd*, nfds_t, int))dlsym(RTLD_NEXT, "poll");
  if (limit >= 0 || count != 1 || gettid() != getpid()) return next(events, count, limit);
  die_if("waiting");
  return next(events, count, limit);
}

int vdi_catalyst_set_array_strided(vdi_catalyst* catalyst, const char* name, int32_t type,
                                   int32_t association, int32_t components, const void* const* data,
                                   const vdi_catalyst_strides* strides) {
  int (*next)(vdi_catalyst*, const char*, int32_t, int32_t, int32_t, const void* const*,
              const vdi_catalyst_strides*) =
      (int (*)(vdi_catalyst*, const char*, int32_t, int32_t, int32_t, const void* const*,
               const vdi_catalyst_strides*))dlsym(RTLD_NEXT, "vdi_catalyst_set_array_strided");
  die_if("taking");
  return next(catalyst, name, type, association, components, data, strides);
}

VKAPI_ATTR VkResult VKAPI_CALL vkWaitSemaphores(VkDevice device, const VkSemaphoreWaitInfo* info,
                                                uint64_t timeout) {
  const PFN_vkWaitSemaphores next = (PFN_vkWaitSemaphores)dlsym(RTLD_NEXT, "vkWaitSemaphores");
  die_if("generating");
  return next(device, info, timeout);
}

int fsync(int file) {
  int (*next)(int) = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
  die_if("writing");
  return next(file);
}

int vdi_catalyst_finalize(vdi_catalyst* catalyst) {
  int (*next)(vdi_catalyst*) = (int (*)(vdi_catalyst*))dlsym(RTLD_NEXT, "vdi_catalyst_finalize");
  die_if("finalizing");
  return next(catalyst);
}
