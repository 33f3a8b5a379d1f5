// A std::vector whose memory need not come from the heap. It may consist of pages that a device writes to, or
// that several ranks share.
#pragma once

#include <cstddef>
#include <memory>
#include <memory_resource>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace vdi {

/// Allocates from a resource, which it keeps alive, or from the heap. When a vector grows, trivially copyable
/// elements are not cleared, because the caller is about to overwrite them, ideally by a device: `resize`
/// leaves the memory as it was. Copies of a vector are on the heap, moved vectors stay in place.
template <typename T>
class HostAllocator {
 public:
  using value_type = T;
  using propagate_on_container_copy_assignment = std::false_type;
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;
  using is_always_equal = std::false_type;

  HostAllocator() noexcept = default;
  explicit HostAllocator(std::shared_ptr<std::pmr::memory_resource> memory) noexcept
      : memory_(std::move(memory)) {}
  template <typename U>
  HostAllocator(const HostAllocator<U>& other) noexcept
      : memory_(other.memory()) {}  // NOLINT: as allocators do

  T* allocate(std::size_t count) {
    if (count > std::size_t(-1) / sizeof(T)) throw std::bad_array_new_length();
    void* data =
        memory_ ? memory_->allocate(count * sizeof(T), alignof(T)) : ::operator new(count * sizeof(T));
    return static_cast<T*>(data);
  }
  void deallocate(T* data, std::size_t count) noexcept {
    if (memory_) {
      memory_->deallocate(data, count * sizeof(T), alignof(T));
    } else {
      ::operator delete(data);
    }
  }
  template <typename U, typename... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    if constexpr (sizeof...(Arguments) > 0 || !std::is_trivially_copyable_v<U>) {
      ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
  }
  HostAllocator select_on_container_copy_construction() const { return {}; }

  const std::shared_ptr<std::pmr::memory_resource>& memory() const { return memory_; }
  bool operator==(const HostAllocator& other) const { return memory_ == other.memory_; }

 private:
  std::shared_ptr<std::pmr::memory_resource> memory_;
};

template <typename T>
using HostVector = std::vector<T, HostAllocator<T>>;

}  // namespace vdi
