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

namespace detail {

/// The results of inOrder's threads, of which at most `ahead` wait to be taken.
template <typename Result>
class OrderedResults {
 public:
  OrderedResults(std::size_t count, std::size_t ahead)
      : count_(count), made_(std::clamp<std::size_t>(ahead, 1, count)) {}

  /// Makes results until none is left to begin, or until the end.
  template <typename Make>
  void make(Make&& make) {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return isEnding_ || next_ == count_ || mayMake(); });
      if (isEnding_ || next_ == count_) return;
      makeNext(make, lock);
    }
  }
  /// Takes all results, and makes some when it has none to take. Returns early at the end.
  template <typename Make, typename Take>
  void take(Make&& make, const Take& take) {
    std::unique_lock lock(mutex_);
    while (taken_ < count_ && !isEnding_) {
      std::optional<Result>& oldest = made_[taken_ % made_.size()];
      if (oldest) {
        Result result = std::move(*oldest);
        oldest.reset();
        ++taken_;
        changed_.notify_all();
        lock.unlock();
        take(std::move(result));
        lock.lock();
      } else if (mayMake()) {
        makeNext(make, lock);
      } else {
        changed_.wait(lock);
      }
    }
  }
  void end() {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
    changed_.notify_all();
  }

 private:
  bool mayMake() const { return next_ < count_ && next_ < taken_ + made_.size(); }
  template <typename Make>
  void makeNext(Make& make, std::unique_lock<std::mutex>& lock) {
    const std::size_t index = next_++;
    lock.unlock();
    std::optional<Result> result(make(index));
    lock.lock();
    made_[index % made_.size()] = std::move(result);
    changed_.notify_all();
  }

  std::size_t count_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::optional<Result>> made_;
  std::size_t next_ = 0;   // the index of the next result to be made
  std::size_t taken_ = 0;  // the number of results taken so far
  bool isEnding_ = false;
};

}  // namespace detail

/// Calls take(make(index)) for each of [0, count) in order, on the calling thread, while other threads make
/// later results, `ahead` of them at most. `makeWorker` returns a `make` of its own for each thread, which
/// may keep scratch memory. The calling thread makes results, too, when it has none to take. Returns when all
/// are taken. Rethrows the first exception of `make` that it learns of, or that of `take`, after the threads
/// have ended.
template <typename MakeWorker, typename Take>
void inOrder(std::size_t count, std::size_t ahead, const MakeWorker& makeWorker, const Take& take) {
  using Result = std::invoke_result_t<std::invoke_result_t<const MakeWorker&>&, std::size_t>;
  if (count == 0) return;
  detail::OrderedResults<Result> results(count, ahead);
  const auto help = [&] {
    try {
      results.make(makeWorker());
    } catch (...) {
      results.end();
      throw;
    }
  };
  const std::size_t threads = std::min({usableCores(), mostThreads, count});
  std::vector<std::future<void>> helpers;
  helpers.reserve(threads);  // a future without room would wait for its thread before `end` is called
  try {
    while (helpers.size() + 1 < threads)
      helpers.push_back(std::async(std::launch::async | std::launch::deferred, help));
    results.take(makeWorker(), take);
  } catch (...) {
    results.end();
    throw;  // the futures' destructors wait for the threads
  }
  for (std::future<void>& helper : helpers) helper.get();
}

}  // namespace vdi
