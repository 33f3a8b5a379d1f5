/* The functions of CUDA's driver that simulations in the tests call. They come from the library that
 * VDI_TEST_CUDA names: a stand-in (gpu_stand_in.c), or libcuda.so.1 on a machine with a GPU. */
#ifndef VDI_TESTS_CATALYST_CUDA_H
#define VDI_TESTS_CATALYST_CUDA_H

#include <dlfcn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef uint64_t cuda_address;

static void* cuda_library;

/* Calls a function of CUDA with arguments of these types, and ends the process if it fails. */
#define CUDA(name, types, ...)                                                   \
  do {                                                                           \
    int(*function) types = (int(*) types)(uintptr_t)dlsym(cuda_library, (name)); \
    const int result = function != NULL ? function(__VA_ARGS__) : -1;            \
    if (result != 0) {                                                           \
      fprintf(stderr, "%s returned %d\n", (name), result);                       \
      abort();                                                                   \
    }                                                                            \
  } while (0)

/* Makes the primary context of the first device current. */
static inline void cuda_begin(void) {
  cuda_library = dlopen(getenv("VDI_TEST_CUDA"), RTLD_NOW | RTLD_LOCAL);
  if (cuda_library == NULL) {
    fprintf(stderr, "VDI_TEST_CUDA: %s\n", dlerror());
    abort();
  }
  void* context = NULL;
  CUDA("cuInit", (unsigned), 0);
  CUDA("cuDevicePrimaryCtxRetain", (void**, int), &context, 0);
  CUDA("cuCtxSetCurrent", (void*), context);
}

/* Memory of the device. The host must not read or write it. */
static inline char* cuda_allocate(size_t bytes) {
  cuda_address memory = 0;
  CUDA("cuMemAlloc_v2", (cuda_address*, size_t), &memory, bytes);
  return (char*)(uintptr_t)memory;
}

static inline void cuda_free(char* memory) {
  CUDA("cuMemFree_v2", (cuda_address), (cuda_address)(uintptr_t)memory);
}

/* `blocking`: the default stream waits for it. */
static inline void* cuda_stream(int blocking) {
  void* stream = NULL;
  CUDA("cuStreamCreate", (void**, unsigned), &stream, blocking ? 0 : 1);
  return stream;
}

/* Queues a copy of the bytes as they are now. */
static inline void cuda_write(void* stream, char* to, const void* from, size_t bytes) {
  CUDA("cuMemcpyHtoDAsync_v2", (cuda_address, const void*, size_t, void*), (cuda_address)(uintptr_t)to, from,
       bytes, stream);
}

static inline void cuda_synchronize(void* stream) {
  CUDA("cuStreamSynchronize", (void*), stream);
}

/* The number of copies to the host; 0 without the stand-in. */
static inline uint64_t cuda_copies(void) {
  uint64_t (*function)(void) = (uint64_t(*)(void))(uintptr_t)dlsym(cuda_library, "cuda_stand_in_copies");
  return function != NULL ? function() : 0;
}

#endif
