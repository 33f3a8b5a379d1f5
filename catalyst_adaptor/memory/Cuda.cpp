#include "catalyst_adaptor/memory/Cuda.h"

#include <dlfcn.h>

#include <array>
#include <chrono>
#include <exception>
#include <limits>
#include <stdexcept>
#include <thread>
#include <type_traits>
#include <utility>

namespace vdi::catalyst {

namespace {

// CUDA's types and numbers, as its header <cuda.h> has them.
using Address = unsigned long long;  // CUdeviceptr
constexpr int success = 0;
constexpr int notReady = 600;
constexpr unsigned typeHost = 1;
constexpr unsigned typeDevice = 2;

enum Attribute : int { Context = 1, MemoryType = 2, DeviceOrdinal = 9, RangeStart = 11, RangeSize = 12 };

/// CUDA_MEMCPY3D_v2
struct Copy3D {
  std::size_t fromX, fromY, fromZ, fromLevel;
  unsigned fromType;
  const void* fromHost;
  Address fromDevice;
  void* fromArray;
  void* reserved0;
  std::size_t fromPitch, fromHeight;
  std::size_t toX, toY, toZ, toLevel;
  unsigned toType;
  void* toHost;
  Address toDevice;
  void* toArray;
  void* reserved1;
  std::size_t toPitch, toHeight;
  std::size_t width, height, depth;
};

Address addressOf(const std::byte* pointer) {
  return static_cast<Address>(reinterpret_cast<std::uintptr_t>(pointer));
}

/// Whether a stream's handle stands for a default stream of the current context.
bool isDefault(const void* stream) {
  constexpr std::uintptr_t last = 2;  // CU_STREAM_LEGACY and CU_STREAM_PER_THREAD
  return reinterpret_cast<std::uintptr_t>(stream) <= last;
}

/// The longest distance between rows that all devices copy at once.
constexpr std::int64_t maxPitch = std::numeric_limits<std::int32_t>::max();

}  // namespace

struct Cuda::Functions {
  int (*pointerAttributes)(unsigned, const int*, void**, Address);
  int (*addressRange)(Address*, std::size_t*, Address);
  int (*deviceGet)(int*, int);
  int (*primaryState)(int, unsigned*, int*);
  int (*primaryRetain)(void**, int);
  int (*primaryRelease)(int);
  int (*push)(void*);
  int (*pop)(void**);
  int (*current)(void**);
  int (*streamContext)(void*, void**);
  int (*streamCreate)(void**, unsigned);
  int (*streamDestroy)(void*);
  int (*eventCreate)(void**, unsigned);
  int (*eventRecord)(void*, void*);
  int (*eventQuery)(void*);
  int (*eventDestroy)(void*);
  int (*copy)(void*, Address, std::size_t, void*);
  int (*copy3D)(const Copy3D*, void*);
  int (*hostRegister)(void*, std::size_t, unsigned);
  int (*hostUnregister)(void*);
  int (*errorName)(int, const char**);
  int (*errorText)(int, const char**);

  /// Returns whether the library has all of them.
  bool find(void* library) {
    bool all = true;
    const auto get = [&](auto& function, const char* name) {
      using Function = std::remove_reference_t<decltype(function)>;
      function = reinterpret_cast<Function>(dlsym(library, name));
      all = all && function != nullptr;
    };
    get(pointerAttributes, "cuPointerGetAttributes");
    get(addressRange, "cuMemGetAddressRange_v2");
    get(deviceGet, "cuDeviceGet");
    get(primaryState, "cuDevicePrimaryCtxGetState");
    get(primaryRetain, "cuDevicePrimaryCtxRetain");
    get(primaryRelease, "cuDevicePrimaryCtxRelease_v2");
    get(push, "cuCtxPushCurrent_v2");
    get(pop, "cuCtxPopCurrent_v2");
    get(current, "cuCtxGetCurrent");
    get(streamContext, "cuStreamGetCtx");
    get(streamCreate, "cuStreamCreate");
    get(streamDestroy, "cuStreamDestroy_v2");
    get(eventCreate, "cuEventCreate");
    get(eventRecord, "cuEventRecord");
    get(eventQuery, "cuEventQuery");
    get(eventDestroy, "cuEventDestroy_v2");
    get(copy, "cuMemcpyDtoHAsync_v2");
    get(copy3D, "cuMemcpy3DAsync_v2");
    get(hostRegister, "cuMemHostRegister_v2");
    get(hostUnregister, "cuMemHostUnregister");
    get(errorName, "cuGetErrorName");
    get(errorText, "cuGetErrorString");
    return all;
  }
};

class Cuda::Current {
 public:
  Current(const Cuda& cuda, void* context) : cuda_(cuda) {
    cuda.require("cuCtxPushCurrent", cuda.functions_->push(context));
  }
  ~Current() {
    void* context = nullptr;
    cuda_.functions_->pop(&context);
  }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  const Cuda& cuda_;
};

/// An event or a stream, destroyed with this object.
class Cuda::Handle {
 public:
  Handle(const Cuda& cuda, const char* create, int (*make)(void**, unsigned), unsigned flags,
         int (*destroy)(void*))
      : destroy_(destroy) {
    cuda.require(create, make(&handle_, flags));
  }
  ~Handle() { destroy_(handle_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  void* get() const { return handle_; }

 private:
  int (*destroy_)(void*);
  void* handle_ = nullptr;
};

std::shared_ptr<Cuda> Cuda::find() {
  void* const library = dlopen("libcuda.so.1", RTLD_NOLOAD | RTLD_LAZY);
  if (library == nullptr) return nullptr;
  auto functions = std::make_unique<Functions>();
  if (!functions->find(library)) {
    dlclose(library);
    return nullptr;
  }
  return std::shared_ptr<Cuda>(new Cuda(library, std::move(functions)));
}

Cuda::Cuda(void* library, std::unique_ptr<Functions> functions)
    : library_(library), functions_(std::move(functions)) {}

Cuda::~Cuda() {
  for (const auto& [device, context] : primaries_) functions_->primaryRelease(device);
  dlclose(library_);
}

void Cuda::fail(const char* call, int result) const {
  const char* name = nullptr;
  const char* text = nullptr;
  functions_->errorName(result, &name);
  functions_->errorText(result, &text);
  throw std::runtime_error(std::string(call) +
                           " failed: " + (name != nullptr ? name : "CUDA's error " + std::to_string(result)) +
                           (text != nullptr ? std::string(", ") + text : ""));
}

void Cuda::require(const char* call, int result) const {
  if (result != success) fail(call, result);
}

std::optional<Cuda::Memory> Cuda::memoryAt(const void* address) const {
  const std::array<int, 5> attributes{Context, MemoryType, DeviceOrdinal, RangeStart, RangeSize};
  Memory memory;
  unsigned type = 0;
  Address begin = 0;
  std::size_t bytes = 0;
  std::array<void*, attributes.size()> results{&memory.context, &type, &memory.device, &begin, &bytes};
  const int result = functions_->pointerAttributes(attributes.size(), attributes.data(), results.data(),
                                                   addressOf(static_cast<const std::byte*>(address)));
  // It fails where CUDA isn't initialised, and then it has no memory. A pointer that it can't judge is read
  // on the host only if the kernel says that it is readable.
  if (result != success || type != typeDevice) return std::nullopt;
  memory.begin = static_cast<std::uintptr_t>(begin);
  memory.end = memory.begin + bytes;
  return memory;
}

void* Cuda::primaryContext(int device) {
  const auto found = primaries_.find(device);
  if (found != primaries_.end()) return found->second;
  void*& context = primaries_[device];
  int handle = 0;
  int result = functions_->deviceGet(&handle, device);
  if (result == success) result = functions_->primaryRetain(&context, handle);
  if (result != success) {
    primaries_.erase(device);
    fail("cuDevicePrimaryCtxRetain", result);
  }
  return context;
}

void* Cuda::contextOf(const Memory& memory) {
  return memory.context != nullptr ? memory.context : primaryContext(memory.device);
}

std::optional<std::uintptr_t> Cuda::firstUnmapped(const Memory& memory, const MemoryRange& range) {
  const Current current(*this, contextOf(memory));
  const auto end = addressOf(range.begin) + range.bytes;
  for (Address at = addressOf(range.begin); at < end;) {
    Address begin = 0;
    std::size_t bytes = 0;
    if (functions_->addressRange(&begin, &bytes, at) != success || begin + bytes <= at)
      return static_cast<std::uintptr_t>(at);
    at = begin + bytes;
  }
  return std::nullopt;
}

/// Waits for a stream of the current context. Returns false after `seconds`.
bool Cuda::awaitCurrent(void* stream, double seconds) const {
  using Clock = std::chrono::steady_clock;
  constexpr unsigned withoutTime = 2;
  const Handle event(*this, "cuEventCreate", functions_->eventCreate, withoutTime, functions_->eventDestroy);
  require("cuEventRecord", functions_->eventRecord(event.get(), stream));
  const auto begin = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  for (;;) {
    const int result = functions_->eventQuery(event.get());
    if (result == success) return true;
    if (result != notReady) fail("cuEventQuery", result);
    const double waited = elapsed();
    if (waited > seconds) return false;
    constexpr double busy = 1e-3;  // short waits keep the core, because a sleep may last longer
    if (waited > busy) std::this_thread::sleep_for(std::chrono::microseconds(waited > 1.0 ? 1000 : 50));
  }
}

void Cuda::await(void* stream, const std::set<void*>& contexts, double seconds) {
  std::set<void*> places = contexts;
  if (!isDefault(stream)) {
    void* own = nullptr;
    require("cuStreamGetCtx", functions_->streamContext(stream, &own));
    places = {own};
  } else if (places.empty()) {
    void* own = nullptr;
    if (functions_->current(&own) == success && own != nullptr) places = {own};
  }
  for (void* context : places) {
    const Current current(*this, context);
    if (awaitCurrent(stream, seconds)) continue;
    throw std::runtime_error("the work queued on the CUDA stream hasn't ended in " +
                             std::to_string(static_cast<int>(seconds)) + " s (VDI_CUDA_PATIENCE)");
  }
}

void Cuda::enqueue(const RowCopy& rows, void* stream) const {
  const auto& [from, to, rowBytes, counts, fromStrides, toStrides] = rows;
  Copy3D copy{};
  copy.fromType = typeDevice;
  copy.toType = typeHost;
  copy.width = rowBytes;
  copy.height = copy.depth = 1;
  copy.fromPitch = copy.toPitch = rowBytes;
  // The device copies the rows along the first axis at once, and along the second one if its stride allows
  // it.
  std::size_t axes = 0;
  if (counts[0] > 1 && fromStrides[0] <= maxPitch && toStrides[0] <= maxPitch) {
    copy.height = static_cast<std::size_t>(counts[0]);
    copy.fromPitch = static_cast<std::size_t>(fromStrides[0]);
    copy.toPitch = static_cast<std::size_t>(toStrides[0]);
    axes = 1;
    if (fromStrides[1] % fromStrides[0] == 0 && toStrides[1] % toStrides[0] == 0 && counts[1] > 1) {
      copy.fromHeight = static_cast<std::size_t>(fromStrides[1] / fromStrides[0]);
      copy.toHeight = static_cast<std::size_t>(toStrides[1] / toStrides[0]);
      if (copy.fromHeight >= copy.height && copy.toHeight >= copy.height) {
        copy.depth = static_cast<std::size_t>(counts[1]);
        axes = 2;
      }
    }
  }
  std::array<std::int64_t, 4> left = counts;
  for (std::size_t axis = 0; axis < axes; ++axis) left[axis] = 1;
  std::array<std::int64_t, 4> at{};
  for (at[3] = 0; at[3] < left[3]; ++at[3]) {
    for (at[2] = 0; at[2] < left[2]; ++at[2]) {
      for (at[1] = 0; at[1] < left[1]; ++at[1]) {
        for (at[0] = 0; at[0] < left[0]; ++at[0]) {
          const std::byte* source = from;
          std::byte* target = to;
          for (std::size_t axis = 0; axis < at.size(); ++axis) {
            source += at[axis] * fromStrides[axis];
            target += at[axis] * toStrides[axis];
          }
          if (axes == 0) {
            require("cuMemcpyDtoHAsync", functions_->copy(target, addressOf(source), rowBytes, stream));
          } else {
            copy.fromDevice = addressOf(source);
            copy.toHost = target;
            require("cuMemcpy3DAsync", functions_->copy3D(&copy, stream));
          }
        }
      }
    }
  }
}

void Cuda::copy(void* context, std::span<const RowCopy> copies, double seconds) {
  const Current current(*this, context);
  constexpr unsigned nonBlocking = 1;  // it doesn't wait for the default stream, nor that one for it
  const Handle stream(*this, "cuStreamCreate", functions_->streamCreate, nonBlocking,
                      functions_->streamDestroy);
  std::exception_ptr failure;
  try {
    for (const RowCopy& rows : copies) enqueue(rows, stream.get());
  } catch (const std::runtime_error&) {  // earlier copies may be under way
    failure = std::current_exception();
  }
  bool isDone = false;
  try {
    isDone = awaitCurrent(stream.get(), seconds);
  } catch (const std::runtime_error&) {
    if (!failure) throw;
  }
  if (failure) std::rethrow_exception(failure);
  if (!isDone) throw StillCopying("copying values from the GPU hasn't ended in time (VDI_CUDA_PATIENCE)");
}

bool Cuda::lock(int device, std::byte* memory, std::size_t bytes) noexcept {
  int handle = 0;
  unsigned flags = 0;
  int isActive = 0;
  constexpr unsigned portable = 1;
  if (functions_->deviceGet(&handle, device) != success ||
      functions_->primaryState(handle, &flags, &isActive) != success || isActive == 0)
    return false;
  try {
    const Current current(*this, primaryContext(device));
    return functions_->hostRegister(memory, bytes, portable) == success;
  } catch (const std::exception&) {
    return false;
  }
}

void Cuda::unlock(int device, std::byte* memory) noexcept {
  try {
    const Current current(*this, primaryContext(device));
    functions_->hostUnregister(memory);
  } catch (const std::exception&) {  // the context is gone, and so is the lock
  }
}

}  // namespace vdi::catalyst
