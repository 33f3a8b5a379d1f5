// Replaces a program's allocation functions, so that a test can let allocations fail. Exactly one source of a
// program includes this header.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

namespace vdi::test {

/// The program defines it: returns memory, or null where the allocation fails. `caller` is the address of the
/// code that allocates.
void* allocate(std::size_t bytes, const void* caller) noexcept;

inline void* allocateOrThrow(std::size_t bytes, const void* caller) {
  void* memory = allocate(bytes, caller);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace vdi::test

void* operator new(std::size_t bytes) {
  return vdi::test::allocateOrThrow(bytes, __builtin_return_address(0));
}
void* operator new[](std::size_t bytes) {
  return vdi::test::allocateOrThrow(bytes, __builtin_return_address(0));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return vdi::test::allocate(bytes, __builtin_return_address(0));
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return vdi::test::allocate(bytes, __builtin_return_address(0));
}
// Where GCC inlines these, but not the above, it warns that `free` doesn't match `new`.
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
