// Copies of what a device has made, into memory that may have held the last frame's. Not part of the
// library's interface.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <future>
#include <span>
#include <thread>
#include <type_traits>
#include <vector>

namespace vdi::detail {

/// One core copies about 10 GB/s, which takes longer than what's copied took to make. Falls back to the
/// calling thread where no other can be had.
template <typename T>
void copyByThreads(std::span<const T> from, T* to) {
  static_assert(std::is_trivially_copyable_v<T>);
  constexpr std::size_t mostThreads = 8;                    // memory has no more to give
  constexpr std::size_t leastBytes = std::size_t{1} << 20;  // a thread takes as long to start
  const std::size_t cores = std::max(std::thread::hardware_concurrency(), 1U);
  const std::size_t threads =
      std::clamp<std::size_t>(from.size_bytes() / leastBytes, 1, std::min(cores, mostThreads));
  const std::size_t share = (from.size() + threads - 1) / threads;
  std::vector<std::future<void>> others;
  for (std::size_t first = share; first < from.size(); first += share) {
    others.push_back(std::async(std::launch::async | std::launch::deferred, [=] {
      const std::span<const T> part = from.subspan(first, std::min(share, from.size() - first));
      std::memcpy(to + first, part.data(), part.size_bytes());
    }));
  }
  if (!from.empty()) std::memcpy(to, from.data(), std::min(share, from.size()) * sizeof(T));
  for (std::future<void>& other : others) other.get();
}

/// Makes `from` what `to` holds from place `first` on (at most its size), and all behind. What `to` had there
/// is overwritten in place, so memory that's used again isn't cleared before.
template <typename T>
void replaceTail(std::vector<T>& to, std::size_t first, std::span<const T> from) {
  if (to.size() > first + from.size()) to.resize(first + from.size());
  const std::size_t inPlace = to.size() - first;
  copyByThreads(from.first(inPlace), to.data() + first);
  to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(inPlace), from.end());
}

}  // namespace vdi::detail
