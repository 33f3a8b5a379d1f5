#include "vdi/pipeline/HostAccess.h"

#include <algorithm>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/core/Parallel.h"

namespace vdi::detail {

using gpu::MemoryKind;

HostAccess::HostAccess(std::shared_ptr<gpu::Device> device, std::shared_ptr<HostMemory> memory)
    : device_(std::move(device)),
      memory_(std::move(memory)),
      imported_(gpu::importHostMemory(device_, memory_->bytes().data(), memory_->bytes().size())) {}

void HostAccess::recordWrite(gpu::Commands& commands, const gpu::Buffer& from, std::uint64_t fromOffset,
                             std::uint64_t at, std::uint64_t bytes) {
  if (bytes == 0) return;
  if (imported_) return commands.copy(from, fromOffset, imported_->buffer, imported_->offset + at, bytes);
  staged_.push_back({gpu::Buffer(device_, bytes, MemoryKind::Readback), at, bytes});
  commands.copy(from, fromOffset, staged_.back().buffer, 0, bytes);
}

void HostAccess::recordRead(gpu::Commands& commands, std::uint64_t at, const gpu::Buffer& to,
                            std::uint64_t toOffset, std::uint64_t bytes) {
  if (bytes == 0) return;
  if (imported_) return commands.copy(imported_->buffer, imported_->offset + at, to, toOffset, bytes);
  staged_.push_back({gpu::Buffer(device_, bytes, MemoryKind::Upload), at, 0});
  copyInParallel(memory_->bytes().subspan(at, bytes), staged_.back().buffer.mapped().data());
  commands.copy(staged_.back().buffer, 0, to, toOffset, bytes);
}

void HostAccess::finish() {
  for (const Staged& staged : staged_) {
    copyInParallel(staged.buffer.mapped().first(staged.bytes), memory_->bytes().data() + staged.at);
  }
  staged_.clear();
}

HostPool::HostPool(std::shared_ptr<gpu::Device> device, Visible visible)
    : device_(std::move(device)), visible_(visible) {}

HostPool::~HostPool() = default;

std::shared_ptr<HostMemory> HostPool::newMemory(std::uint64_t bytes) const {
  if (visible_ == Visible::ToHost) {
    try {
      return HostMemory::shareable(bytes);
    } catch (const Error&) {  // then other ranks send their data by MPI
    }
  }
  return HostMemory::anonymous(bytes);
}

HostPool::Place HostPool::placeOf(const void* data) {
  const std::lock_guard lock(mutex_);
  const auto* address = static_cast<const std::byte*>(data);
  for (const Block& block : blocks_) {
    const std::byte* begin = block.memory->bytes().data();
    if (address >= begin && address < begin + block.memory->bytes().size()) {
      return {block.access.get(), static_cast<std::uint64_t>(address - begin)};
    }
  }
  return {};
}

std::vector<std::string> HostPool::names() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const Block& block : blocks_) {
    if (!block.memory->name().empty()) names.push_back(block.memory->name());
  }
  return names;
}

void HostPool::detach() noexcept {
  const std::lock_guard lock(mutex_);
  for (Block& block : blocks_) block.access.reset();
  device_.reset();
}

void* HostPool::do_allocate(std::size_t bytes, std::size_t) {
  constexpr std::uint64_t smallest = 65536;
  const std::lock_guard lock(mutex_);
  Block* best = nullptr;
  for (Block& block : blocks_) {
    const std::uint64_t size = block.memory->bytes().size();
    if (block.used || size < bytes || size > 4 * std::max<std::uint64_t>(bytes, smallest)) continue;
    if (best == nullptr || size < best->memory->bytes().size()) best = &block;
  }
  if (best == nullptr) {
    Block block;
    block.memory = newMemory(bytes + bytes / 4);  // so that a slightly larger frame fits too
    if (device_) block.access = std::make_unique<HostAccess>(device_, block.memory);
    blocks_.push_back(std::move(block));
    best = &blocks_.back();
  }
  best->used = true;
  return best->memory->bytes().data();
}

void HostPool::do_deallocate(void* data, std::size_t, std::size_t) {
  constexpr std::size_t maxUnused = 4;  // two frames' offsets and supersegments
  const std::lock_guard lock(mutex_);
  std::size_t unused = 0;
  for (Block& block : blocks_) {
    if (block.memory->bytes().data() == data) {
      block.used = false;
      block.freed = ++frees_;
    }
    unused += block.used ? 0 : 1;
  }
  if (unused <= maxUnused && device_) return;
  const auto oldest = std::min_element(blocks_.begin(), blocks_.end(), [](const Block& a, const Block& b) {
    return std::pair(a.used, a.freed) < std::pair(b.used, b.freed);
  });
  blocks_.erase(oldest);
}

}  // namespace vdi::detail
