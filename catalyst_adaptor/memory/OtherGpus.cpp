#include "catalyst_adaptor/memory/OtherGpus.h"

#include <dlfcn.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace vdi::catalyst {

namespace {

/// The first of some libraries that the process has loaded, if any.
class Library {
 public:
  explicit Library(std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (handle_ == nullptr) handle_ = dlopen(name, RTLD_NOLOAD | RTLD_LAZY);
    }
  }
  ~Library() {
    if (handle_ != nullptr) dlclose(handle_);
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  template <typename Function>
  Function* find(const char* name) const {
    return handle_ != nullptr ? reinterpret_cast<Function*>(dlsym(handle_, name)) : nullptr;
  }

 private:
  void* handle_ = nullptr;
};

}  // namespace

struct OtherGpus::Hip {
  Library library{"libamdhip64.so.7", "libamdhip64.so.6", "libamdhip64.so.5", "libamdhip64.so"};
  int (*version)(int*) = library.find<int(int*)>("hipRuntimeGetVersion");
  int (*attributes)(void*, const void*) = library.find<int(void*, const void*)>("hipPointerGetAttributes");

  bool has(const void* address) const {
    // hipPointerAttribute_t has fewer bytes. It begins with the type.
    std::array<std::int32_t, 32> found{};
    int number = 0;
    if (version == nullptr || attributes == nullptr || version(&number) != 0 ||
        attributes(found.data(), address) != 0)
      return false;
    constexpr int six = 60000000;
    return found[0] == (number >= six ? 2 : 1);  // hipMemoryTypeDevice, which ROCm 6 has renumbered
  }
};

struct OtherGpus::LevelZero {
  struct Description {
    std::uint32_t structure = 0xd;
    const void* next = nullptr;
    std::uint32_t flags = 0;
  };
  struct Properties {
    std::uint32_t structure = 0x17;
    void* next = nullptr;
    std::uint32_t type = 0;
    std::uint64_t id = 0;
    std::uint64_t pageSize = 0;
  };

  Library library{"libze_loader.so.1"};
  int (*drivers)(std::uint32_t*, void**) = library.find<int(std::uint32_t*, void**)>("zeDriverGet");
  int (*create)(void*, const Description*,
                void**) = library.find<int(void*, const Description*, void**)>("zeContextCreate");
  int (*destroy)(void*) = library.find<int(void*)>("zeContextDestroy");
  int (*ask)(void*, const void*, Properties*,
             void**) = library.find<int(void*, const void*, Properties*, void**)>("zeMemGetAllocProperties");
  std::vector<void*> contexts;  // one for each driver, which knows the memory of all of its contexts

  LevelZero() {
    // Without zeInit, which is the simulation's to call, there are no drivers and no memory.
    std::uint32_t count = 0;
    if (drivers == nullptr || create == nullptr || destroy == nullptr || ask == nullptr ||
        drivers(&count, nullptr) != 0 || count == 0)
      return;
    std::vector<void*> all(count);
    contexts.reserve(count);
    if (drivers(&count, all.data()) != 0) return;
    for (void* driver : all) {
      const Description description;
      void* context = nullptr;
      if (create(driver, &description, &context) == 0) contexts.push_back(context);
    }
  }
  ~LevelZero() {
    for (void* context : contexts) destroy(context);
  }
  LevelZero(const LevelZero&) = delete;
  LevelZero& operator=(const LevelZero&) = delete;

  bool has(const void* address) const {
    constexpr std::uint32_t deviceMemory = 2;
    for (void* context : contexts) {
      Properties properties;
      if (ask(context, address, &properties, nullptr) == 0 && properties.type == deviceMemory) return true;
    }
    return false;
  }
};

OtherGpus::OtherGpus() = default;
OtherGpus::~OtherGpus() = default;
OtherGpus::OtherGpus(OtherGpus&&) noexcept = default;
OtherGpus& OtherGpus::operator=(OtherGpus&&) noexcept = default;

void OtherGpus::look() {
  hip_ = std::make_unique<Hip>();
  levelZero_.reset();
  levelZero_ = std::make_unique<LevelZero>();
}

std::string OtherGpus::at(const void* address) const {
  if (hip_ && hip_->has(address))
    return "lies in a HIP device's memory, from which values can't be taken: copy them to the host "
           "(hipMemcpy), or allocate them by hipHostMalloc or hipMallocManaged";
  if (levelZero_ && levelZero_->has(address))
    return "lies in a Level Zero device's memory, from which values can't be taken: copy them to the host, "
           "or "
           "allocate them by zeMemAllocHost or zeMemAllocShared (SYCL: malloc_host, malloc_shared)";
  return "";
}

}  // namespace vdi::catalyst
