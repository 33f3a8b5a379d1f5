/* Stands in for a GPU's library, on machines without that GPU. It is built as three libraries: STAND_IN_CUDA,
 * STAND_IN_HIP and STAND_IN_LEVEL_ZERO choose the functions. Memory of its device is mapped where the host
 * may not touch it; only CUDA's copies can, through a second mapping. Streams are threads, which are late.
 * Names and types of functions are those of the real libraries, so that the tests run with these, too. */
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define API __attribute__((visibility("default")))
typedef uint64_t address;

typedef struct area {
  char* device; /* PROT_NONE */
  char* alias;  /* readable and writable; null: there is none */
  size_t bytes;
  void* context;
  size_t mapped; /* bytes from the begin on */
} area;

enum { AREAS = 4096, SUCCESS = 0, INVALID = 1, NOT_READY = 600 };
static area areas[AREAS];
__attribute__((unused)) static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;

static area* area_at(address at) {
  for (int i = 0; i < AREAS; ++i) {
    const address begin = (address)(uintptr_t)areas[i].device;
    if (areas[i].device != NULL && at >= begin && at < begin + areas[i].bytes) return &areas[i];
  }
  return NULL;
}

static area* new_area(size_t bytes, void* context) {
  area* own = areas;
  while (own->device != NULL) ++own;
  const int file = memfd_create("stand-in", 0);
  if (file < 0 || ftruncate(file, (off_t)bytes) != 0) abort();
  own->alias = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  own->device = mmap(NULL, bytes, PROT_NONE, MAP_SHARED, file, 0);
  close(file);
  own->bytes = own->mapped = bytes;
  own->context = context;
  return own;
}

#if defined(STAND_IN_HIP)

API int hipRuntimeGetVersion(int* version) {
  *version = 60032830;
  return SUCCESS;
}

API int hipMalloc(void** memory, size_t bytes) {
  *memory = new_area(bytes, NULL)->device;
  return SUCCESS;
}

API int hipPointerGetAttributes(int* attributes, const void* pointer) {
  attributes[0] = area_at((address)(uintptr_t)pointer) != NULL ? 2 : 0;
  return SUCCESS;
}

#elif defined(STAND_IN_LEVEL_ZERO)

API int zeDriverGet(uint32_t* count, void** drivers) {
  if (drivers != NULL) drivers[0] = &mutex;
  *count = 1;
  return SUCCESS;
}

API int zeContextCreate(void* driver, const uint32_t* description, void** context) {
  *context = malloc(1);
  return driver == &mutex && description[0] == 0xd ? SUCCESS : INVALID;
}

API int zeContextDestroy(void* context) {
  free(context);
  return SUCCESS;
}

API int zeMemAllocDevice(void* context, const void* description, size_t bytes, size_t alignment, void* device,
                         void** memory) {
  (void)context, (void)description, (void)alignment, (void)device;
  *memory = new_area(bytes, NULL)->device;
  return SUCCESS;
}

API int zeMemGetAllocProperties(void* context, const void* pointer, uint32_t* properties, void** device) {
  (void)context, (void)device;
  if (properties[0] != 0x17) return INVALID;
  properties[4] = area_at((address)(uintptr_t)pointer) != NULL ? 2 : 0;
  return SUCCESS;
}

#else

typedef struct context {
  int lives;
} context;

typedef struct copy3d {
  size_t from_x, from_y, from_z, from_level;
  unsigned from_type;
  const void* from_host;
  address from_device;
  void* from_array;
  void* reserved0;
  size_t from_pitch, from_height;
  size_t to_x, to_y, to_z, to_level;
  unsigned to_type;
  void* to_host;
  address to_device;
  void* to_array;
  void* reserved1;
  size_t to_pitch, to_height;
  size_t width, height, depth;
} copy3d;

typedef struct event {
  int is_done;
  int users; /* the caller, and the stream that it is queued on */
} event;

typedef struct work {
  struct work* next;
  void* to;
  const void* from; /* `bytes` bytes; freed afterwards if `is_own` */
  size_t bytes;
  int is_own;
  copy3d rows; /* if its width isn't 0 */
  void (*function)(void*);
  void* data;
  event* mark;
  uint64_t after[64]; /* of each stream, the number of works that must be done before */
} work;

enum { STREAMS = 64 };
typedef struct stream {
  context* of;
  int is_blocking;
  int is_ended;
  work* first;
  uint64_t queued;
  uint64_t done;
  pthread_t thread;
} stream;

static context primary = {1};
static _Thread_local context* stack[16] = {NULL};
static _Thread_local int depth;
static stream* streams[STREAMS];
static pthread_cond_t changed = PTHREAD_COND_INITIALIZER;
static const char* failing;
static int failure;
static uint64_t copies;

/* The next call of that name fails. */
API void cuda_stand_in_fail(const char* call, int result) {
  failing = call;
  failure = result;
}

/* The number of copies to the host. */
API uint64_t cuda_stand_in_copies(void) {
  return copies;
}

static int fails(const char* call) {
  if (failing == NULL || strcmp(failing, call) != 0) return SUCCESS;
  failing = NULL;
  return failure;
}

static context* here(void) {
  return stack[depth];
}

static int is_before(const work* one) {
  for (int i = 0; i < STREAMS; ++i) {
    if (one->after[i] > 0 && streams[i] != NULL && streams[i]->done < one->after[i]) return 1;
  }
  return 0;
}

static void carry_out(work* one) {
  if (one->function != NULL) {
    one->function(one->data);
  } else if (one->rows.width > 0) {
    const copy3d* c = &one->rows;
    for (size_t z = 0; z < c->depth; ++z) {
      for (size_t y = 0; y < c->height; ++y)
        memcpy((char*)c->to_host + y * c->to_pitch + z * c->to_pitch * c->to_height,
               (const char*)one->from + y * c->from_pitch + z * c->from_pitch * c->from_height, c->width);
    }
  } else if (one->to != NULL) {
    if (one->is_own) usleep(3000); /* values come late */
    memcpy(one->to, one->from, one->bytes);
  }
  if (one->is_own) free((void*)one->from);
}

static void release(event* mark) {
  if (--mark->users == 0) free(mark);
}

static void* run(void* given) {
  stream* const own = given;
  pthread_mutex_lock(&mutex);
  for (;;) {
    while ((own->first == NULL && !own->is_ended) || (own->first != NULL && is_before(own->first)))
      pthread_cond_wait(&changed, &mutex);
    if (own->first == NULL) break;
    work* const one = own->first;
    pthread_mutex_unlock(&mutex);
    carry_out(one);
    pthread_mutex_lock(&mutex);
    own->first = one->next;
    ++own->done;
    if (one->mark != NULL) {
      one->mark->is_done = 1;
      release(one->mark);
    }
    free(one);
    pthread_cond_broadcast(&changed);
  }
  pthread_mutex_unlock(&mutex);
  return NULL;
}

static stream* new_stream(context* of, int is_blocking) {
  stream* const own = calloc(1, sizeof *own);
  own->of = of;
  own->is_blocking = is_blocking;
  pthread_mutex_lock(&mutex);
  int i = 0;
  while (streams[i] != NULL) ++i;
  streams[i] = own;
  pthread_mutex_unlock(&mutex);
  pthread_create(&own->thread, NULL, run, own);
  return own;
}

static stream* default_stream(void) {
  static stream* one;
  if (one == NULL) one = new_stream(&primary, 0);
  return one;
}

static void queue(stream* on, work one) {
  const int is_default = (uintptr_t)on <= 2;
  if (is_default) on = default_stream();
  work* const own = malloc(sizeof *own);
  *own = one;
  pthread_mutex_lock(&mutex);
  for (int i = 0; i < STREAMS; ++i) {
    own->after[i] = is_default && streams[i] != NULL && streams[i]->is_blocking ? streams[i]->queued : 0;
  }
  work** last = &on->first;
  while (*last != NULL) last = &(*last)->next;
  *last = own;
  ++on->queued;
  pthread_cond_broadcast(&changed);
  pthread_mutex_unlock(&mutex);
}

API int cuInit(unsigned flags) {
  return flags == 0 ? SUCCESS : INVALID;
}

API int cuDeviceGet(int* device, int ordinal) {
  *device = ordinal;
  return ordinal == 0 ? SUCCESS : 101;
}

API int cuDevicePrimaryCtxGetState(int device, unsigned* flags, int* active) {
  *flags = 0;
  *active = 1;
  return device == 0 ? SUCCESS : 101;
}

API int cuDevicePrimaryCtxRetain(void** context, int device) {
  *context = &primary;
  return device == 0 ? SUCCESS : 101;
}

API int cuDevicePrimaryCtxRelease_v2(int device) {
  return device == 0 ? SUCCESS : 101;
}

API int cuCtxCreate_v2(void** made, unsigned flags, int device) {
  context* const own = malloc(sizeof *own); /* never freed */
  own->lives = 1;
  *made = stack[++depth] = own;
  return flags == 0 && device == 0 ? SUCCESS : INVALID;
}

API int cuCtxDestroy_v2(void* gone) {
  ((context*)gone)->lives = 0;
  for (int i = 0; i < AREAS; ++i) {
    if (areas[i].context == gone) areas[i].device = NULL; /* the pages stay, unreadable */
  }
  if (here() == gone) --depth;
  return SUCCESS;
}

API int cuCtxPushCurrent_v2(void* given) {
  if (!((context*)given)->lives) return 709;
  stack[++depth] = given;
  return SUCCESS;
}

API int cuCtxPopCurrent_v2(void** popped) {
  if (depth == 0) return 201;
  *popped = stack[depth--];
  return SUCCESS;
}

API int cuCtxSetCurrent(void* given) {
  stack[depth] = given;
  return SUCCESS;
}

API int cuCtxGetCurrent(void** found) {
  *found = here();
  return SUCCESS;
}

API int cuMemAlloc_v2(address* memory, size_t bytes) {
  if (here() == NULL) return 201;
  *memory = (address)(uintptr_t)new_area(bytes, here())->device;
  return SUCCESS;
}

API int cuMemFree_v2(address memory) {
  area* const own = area_at(memory);
  if (own == NULL) return INVALID;
  munmap(own->alias, own->bytes);
  own->device = NULL; /* the pages stay, unreadable */
  return SUCCESS;
}

API int cuMemAddressReserve(address* memory, size_t bytes, size_t alignment, address wish, uint64_t flags) {
  (void)alignment, (void)wish, (void)flags;
  area* const own = new_area(bytes, NULL);
  own->mapped = 0;
  *memory = (address)(uintptr_t)own->device;
  return SUCCESS;
}

API int cuMemCreate(uint64_t* handle, size_t bytes, const void* properties, uint64_t flags) {
  (void)properties, (void)flags;
  *handle = bytes;
  return SUCCESS;
}

/* It maps what follows the mapped bytes, and unmaps the last of these. */
API int cuMemMap(address memory, size_t bytes, size_t offset, uint64_t handle, uint64_t flags) {
  (void)offset, (void)handle, (void)flags;
  area* const own = area_at(memory);
  own->mapped = memory - (address)(uintptr_t)own->device + bytes;
  return SUCCESS;
}

API int cuMemUnmap(address memory, size_t bytes) {
  area* const own = area_at(memory);
  own->mapped = memory - (address)(uintptr_t)own->device;
  (void)bytes;
  return SUCCESS;
}

API int cuMemSetAccess(address memory, size_t bytes, const void* descriptions, size_t count) {
  (void)memory, (void)bytes, (void)descriptions, (void)count;
  return SUCCESS;
}

API int cuMemGetAddressRange_v2(address* begin, size_t* bytes, address at) {
  const area* const own = area_at(at);
  if (here() == NULL) return 201;
  if (own == NULL || at - (address)(uintptr_t)own->device >= own->mapped) return 500;
  *begin = (address)(uintptr_t)own->device;
  *bytes = own->mapped;
  return SUCCESS;
}

API int cuPointerGetAttributes(unsigned count, const int* attributes, void** results, address at) {
  const area* const own = area_at(at);
  for (unsigned i = 0; i < count; ++i) {
    switch (attributes[i]) {
      case 1:
        *(void**)results[i] = own != NULL ? own->context : NULL;
        break;
      case 2:
        *(unsigned*)results[i] = own != NULL ? 2 : 0;
        break;
      case 9:
        *(int*)results[i] = own != NULL ? 0 : -2;
        break;
      case 11:
        *(address*)results[i] = own != NULL ? (address)(uintptr_t)own->device : 0;
        break;
      case 12:
        *(size_t*)results[i] = own != NULL ? own->bytes : 0;
        break;
      default:
        return INVALID;
    }
  }
  return SUCCESS;
}

API int cuStreamCreate(void** made, unsigned flags) {
  if (here() == NULL) return 201;
  *made = new_stream(here(), flags == 0);
  return SUCCESS;
}

API int cuStreamDestroy_v2(void* given) {
  stream* const own = given;
  pthread_mutex_lock(&mutex);
  own->is_ended = 1;
  pthread_cond_broadcast(&changed);
  pthread_mutex_unlock(&mutex);
  pthread_join(own->thread, NULL);
  for (int i = 0; i < STREAMS; ++i) {
    if (streams[i] == own) streams[i] = NULL;
  }
  free(own);
  return SUCCESS;
}

API int cuStreamGetCtx(void* given, void** found) {
  *found = ((stream*)given)->of;
  return SUCCESS;
}

API int cuStreamSynchronize(void* given) {
  stream* const own = given;
  pthread_mutex_lock(&mutex);
  while (own->done < own->queued) pthread_cond_wait(&changed, &mutex);
  pthread_mutex_unlock(&mutex);
  return SUCCESS;
}

API int cuLaunchHostFunc(void* on, void (*function)(void*), void* data) {
  queue(on, (work){.function = function, .data = data});
  return SUCCESS;
}

API int cuEventCreate(void** made, unsigned flags) {
  if (here() == NULL || flags != 2) return INVALID;
  event* const own = calloc(1, sizeof *own);
  own->users = 1;
  *made = own;
  return SUCCESS;
}

API int cuEventRecord(void* given, void* on) {
  const int result = fails("cuEventRecord");
  if (result != SUCCESS) return result;
  pthread_mutex_lock(&mutex);
  ++((event*)given)->users;
  pthread_mutex_unlock(&mutex);
  queue(on, (work){.mark = given});
  return SUCCESS;
}

API int cuEventQuery(void* given) {
  const int result = fails("cuEventQuery");
  pthread_mutex_lock(&mutex);
  const int is_done = ((event*)given)->is_done;
  pthread_mutex_unlock(&mutex);
  return result != SUCCESS ? result : is_done ? SUCCESS : NOT_READY;
}

API int cuEventDestroy_v2(void* given) {
  pthread_mutex_lock(&mutex);
  release(given);
  pthread_mutex_unlock(&mutex);
  return SUCCESS;
}

static char* alias_of(address at, size_t bytes) {
  const area* const own = area_at(at);
  if (own == NULL || at - (address)(uintptr_t)own->device + bytes > own->mapped) return NULL;
  return own->alias + (at - (address)(uintptr_t)own->device);
}

API int cuMemcpyHtoDAsync_v2(address to, const void* from, size_t bytes, void* on) {
  char* const alias = alias_of(to, bytes);
  if (alias == NULL) return INVALID;
  void* const copy = malloc(bytes);
  memcpy(copy, from, bytes);
  queue(on, (work){.to = alias, .from = copy, .bytes = bytes, .is_own = 1});
  return SUCCESS;
}

API int cuMemcpyDtoHAsync_v2(void* to, address from, size_t bytes, void* on) {
  const int result = fails("cuMemcpyDtoHAsync");
  const char* const alias = alias_of(from, bytes);
  if (result != SUCCESS || alias == NULL) return result != SUCCESS ? result : INVALID;
  queue(on, (work){.to = to, .from = alias, .bytes = bytes});
  ++copies;
  return SUCCESS;
}

API int cuMemcpy3DAsync_v2(const copy3d* rows, void* on) {
  const int result = fails("cuMemcpy3DAsync");
  const size_t bytes = rows->width + (rows->height - 1) * rows->from_pitch +
                       (rows->depth - 1) * rows->from_pitch * rows->from_height;
  const char* const alias = alias_of(rows->from_device, bytes);
  if (result != SUCCESS || alias == NULL) return result != SUCCESS ? result : INVALID;
  if (rows->from_type != 2 || rows->to_type != 1 || rows->from_pitch < rows->width ||
      rows->to_pitch < rows->width)
    return INVALID;
  queue(on, (work){.from = alias, .rows = *rows});
  ++copies;
  return SUCCESS;
}

API int cuMemHostRegister_v2(void* memory, size_t bytes, unsigned flags) {
  return here() != NULL && memory != NULL && bytes > 0 && flags == 1 ? SUCCESS : INVALID;
}

API int cuMemHostUnregister(void* memory) {
  return here() != NULL && memory != NULL ? SUCCESS : INVALID;
}

API int cuGetErrorName(int result, const char** name) {
  *name = result == INVALID ? "CUDA_ERROR_INVALID_VALUE"
          : result == 700   ? "CUDA_ERROR_ILLEGAL_ADDRESS"
                            : NULL;
  return *name != NULL ? SUCCESS : INVALID;
}

API int cuGetErrorString(int result, const char** text) {
  *text = result == INVALID ? "invalid argument" : NULL;
  return *text != NULL ? SUCCESS : INVALID;
}

#endif
