#include "catalyst_adaptor/memory/GpuMemory.h"

#include <link.h>

#include <cstddef>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "catalyst_adaptor/memory/ReadableMemory.h"
#include "vdi/core/Environment.h"

namespace vdi::catalyst {

namespace {

double patience() {
  constexpr double usual = 300.0;
  return environmentCount("VDI_CUDA_PATIENCE", 1).value_or(usual);
}

/// A number that grows whenever the process loads a library.
std::uint64_t countLoads() {
  std::uint64_t loads = 0;
  dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* to) {
        *static_cast<std::uint64_t*>(to) = info->dlpi_adds;
        return 1;  // each library has the number
      },
      &loads);
  return loads;
}

/// Throws std::invalid_argument unless the whole range is memory of the device.
void requireInside(Cuda& cuda, const Cuda::Memory& memory, const MemoryRange& range) {
  const std::uintptr_t end = range.first() + range.bytes;
  if (memory.begin != memory.end && (range.first() < memory.begin || end > memory.end)) {
    const std::uintptr_t beyond = end > memory.end ? end - memory.end : memory.begin - range.first();
    throw std::invalid_argument("reaches " + std::to_string(beyond) + " bytes beyond its allocation of " +
                                std::to_string(memory.end - memory.begin) + " bytes on CUDA's device " +
                                std::to_string(memory.device));
  }
  if (memory.context != nullptr) return;  // such an allocation is one piece
  if (const std::optional<std::uintptr_t> hole = cuda.firstUnmapped(memory, range)) {
    throw std::invalid_argument("isn't mapped from byte " + std::to_string(*hole - range.first()) +
                                " on, on CUDA's device " + std::to_string(memory.device));
  }
}

}  // namespace

/// Finds the libraries that the process has loaded since the last look, because searching takes time.
void GpuMemory::look() {
  const std::uint64_t loads = countLoads();
  if (loads == loads_) return;
  if (!cuda_) cuda_ = Cuda::find();
  others_.look();
  loads_ = countLoads();
}

bool GpuMemory::isOfCuda(const MemoryRange& range) {
  look();
  if (cuda_) {
    if (const std::optional<Cuda::Memory> memory = cuda_->memoryAt(range.begin)) {
      requireInside(*cuda_, *memory, range);
      return true;
    }
  }
  const std::string other = others_.at(range.begin);
  if (!other.empty()) throw std::invalid_argument(other);
  return false;
}

void GpuMemory::setStream(void* stream) {
  look();
  if (stream != nullptr && !cuda_)
    throw std::invalid_argument("a stream was given, but the process hasn't loaded CUDA (libcuda.so.1)");
  stream_ = stream;
  hasStream_ = stream != nullptr;
}

void GpuMemory::copy(std::span<const BufferCopy> copies) {
  look();
  if (!cuda_) return;
  // Memory may have been freed, or its context destroyed, since the simulation named it.
  std::map<void*, std::vector<const BufferCopy*>> perContext;
  std::set<void*> contexts;
  for (const BufferCopy& copy : copies) {
    const MemoryRange source = copy.rows.source();
    const std::optional<Cuda::Memory> memory = cuda_->memoryAt(source.begin);
    if (!memory)
      throw std::runtime_error(copy.name() +
                               " lies in a GPU's memory that was freed, or whose context is gone");
    try {
      requireInside(*cuda_, *memory, source);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(copy.name() + " " + error.what());
    }
    void* const context = cuda_->contextOf(*memory);
    contexts.insert(context);
    perContext[context].push_back(&copy);
    copy.to->lock(cuda_, memory->device);
  }
  const double seconds = patience();
  cuda_->await(stream_, contexts, seconds);
  for (const auto& [context, own] : perContext) {
    std::vector<RowCopy> rows;
    for (const BufferCopy* copy : own) rows.push_back(copy->rows);
    try {
      cuda_->copy(context, rows, seconds);
    } catch (const StillCopying&) {
      for (const BufferCopy* copy : own) copy->to->abandon();
      throw;
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(own.front()->name() + ": " + error.what());
    }
  }
}

void GpuMemory::read(const MemoryRange& range, std::byte* to) {
  if (range.bytes == 0) return;
  const std::byte* from = range.begin;
  std::shared_ptr<HostBuffer> buffer;
  if (isOfCuda(range)) {
    buffer = std::make_shared<HostBuffer>(range.bytes);
    const BufferCopy one{{range.begin, buffer->data(), range.bytes}, buffer, "a field"};
    copy(std::span(&one, 1));
    from = buffer->data();
  } else if (firstUnreadable({range})) {
    throw std::invalid_argument("can't be read");
  }
  std::memcpy(to, from, range.bytes);
}

}  // namespace vdi::catalyst
