#include "VDIRetire.h"

#include <chrono>
#include <future>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

namespace pv {

namespace {

struct Retired {
  std::mutex mutex;
  std::vector<std::future<void>> jobs;
};

Retired& retired() {
  static Retired shared;
  return shared;
}

}  // namespace

void retire(std::shared_ptr<void> thing) {
  const std::scoped_lock lock(retired().mutex);
  std::erase_if(retired().jobs, [](const std::future<void>& job) {
    return job.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  try {
    retired().jobs.push_back(
        std::async(std::launch::async, [last = std::move(thing)]() mutable { last.reset(); }));
  } catch (const std::system_error&) {  // without a thread, the caller's has destroyed it
  }
}

}  // namespace pv
