// Host work on many elements, by several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <future>
#include <span>
#include <type_traits>
#include <vector>

namespace vdi {

/// The number of cores on which the calling thread may run. mpirun may have bound it to one, where more
/// threads would only slow each other down.
std::size_t usableCores();

/// The most threads to use: more would only wait for the host's memory.
inline constexpr std::size_t mostThreads = 16;

/// Calls work(first, last) for ranges that make up [0, count), on several threads at once if each gets at
/// least `minimum` elements. Choose `minimum` so that it takes some 100 us: starting a thread takes half of
/// that. Returns when all work is done, and rethrows an exception of `work`. If a thread can't be started,
/// the calling thread does its work.
template <typename Work>
void inParallel(std::size_t count, std::size_t minimum, Work work) {
  const std::size_t threads =
      std::clamp<std::size_t>(count / minimum, 1, std::min(usableCores(), mostThreads));
  const std::size_t share = (count + threads - 1) / threads;
  std::vector<std::future<void>> others;
  for (std::size_t first = share; first < count; first += share) {
    others.push_back(std::async(std::launch::async | std::launch::deferred,
                                [&, first] { work(first, std::min(first + share, count)); }));
  }
  if (count > 0) work(std::size_t{0}, std::min(share, count));
  for (std::future<void>& other : others) other.get();
}

/// Calls work(index) for each of [0, count) on several threads. Each thread takes the next index when it has
/// finished one, which suits elements that take very different times. Otherwise like inParallel.
template <typename Work>
void eachInParallel(std::size_t count, Work work) {
  std::atomic<std::size_t> next{0};
  inParallel(std::min(count, usableCores()), 1, [&](std::size_t, std::size_t) {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  });
}

/// Copies on several threads, since one core copies only about 10 GB/s.
inline void copyInParallel(std::span<const std::byte> from, void* to) {
  inParallel(from.size(), std::size_t{1} << 20, [&](std::size_t first, std::size_t last) {
    std::memcpy(static_cast<std::byte*>(to) + first, from.data() + first, last - first);
  });
}

/// Replaces the elements of `to` from place `first` (at most its size) to its end by `from`. Overwrites
/// existing elements without clearing them first.
template <typename T, typename Allocator>
void replaceTail(std::vector<T, Allocator>& to, std::size_t first, std::span<const T> from) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (to.size() > first + from.size()) to.resize(first + from.size());
  const std::size_t inPlace = to.size() - first;
  copyInParallel(std::as_bytes(from.first(inPlace)), to.data() + first);
  to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(inPlace), from.end());
}

}  // namespace vdi
