// Host work on many elements by several threads, whose results one thread takes in order.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <future>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "vdi/core/Parallel.h"

namespace vdi {

/// Calls take(make(index)) for each of [0, count) in order, on the calling thread, while other threads make
/// later results, `ahead` of them at most. `makeWorker` returns a `make` of its own for each thread, which
/// may keep scratch memory. The calling thread makes results, too, when it has none to take. Returns when all
/// are taken. Rethrows the first exception of `make` that it learns of, or that of `take`, after the threads
/// have ended.
template <typename MakeWorker, typename Take>
void inOrder(std::size_t count, std::size_t ahead, const MakeWorker& makeWorker, const Take& take) {
  using Result = std::invoke_result_t<std::invoke_result_t<const MakeWorker&>&, std::size_t>;
  if (count == 0) return;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::optional<Result>> made(std::clamp<std::size_t>(ahead, 1, count));
  std::size_t next = 0;   // the index of the next result to be made
  std::size_t taken = 0;  // the number of results taken so far
  bool isEnding = false;
  const auto mayMake = [&] { return next < count && next < taken + made.size(); };
  const auto makeNext = [&](auto& make, std::unique_lock<std::mutex>& lock) {
    const std::size_t index = next++;
    lock.unlock();
    std::optional<Result> result(make(index));
    lock.lock();
    made[index % made.size()] = std::move(result);
    changed.notify_all();
  };
  const auto end = [&] {
    const std::scoped_lock lock(mutex);
    isEnding = true;
    changed.notify_all();
  };
  const auto help = [&] {
    try {
      auto make = makeWorker();
      std::unique_lock lock(mutex);
      for (;;) {
        changed.wait(lock, [&] { return isEnding || next == count || mayMake(); });
        if (isEnding || next == count) return;
        makeNext(make, lock);
      }
    } catch (...) {
      end();
      throw;
    }
  };

  const std::size_t threads = std::min({usableCores(), mostThreads, count});
  std::vector<std::future<void>> helpers;
  helpers.reserve(threads);  // a future without room would wait for its thread before `end` is called
  try {
    while (helpers.size() + 1 < threads)
      helpers.push_back(std::async(std::launch::async | std::launch::deferred, help));
    auto make = makeWorker();
    std::unique_lock lock(mutex);
    while (taken < count && !isEnding) {
      std::optional<Result>& oldest = made[taken % made.size()];
      if (oldest) {
        Result result = std::move(*oldest);
        oldest.reset();
        ++taken;
        changed.notify_all();
        lock.unlock();
        take(std::move(result));
        lock.lock();
      } else if (mayMake()) {
        makeNext(make, lock);
      } else {
        changed.wait(lock);
      }
    }
  } catch (...) {
    end();
    throw;  // the futures' destructors wait for the threads
  }
  for (std::future<void>& helper : helpers) helper.get();
}

}  // namespace vdi
