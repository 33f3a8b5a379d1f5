#include "VDIRetire.h"

#include <cstdlib>
#include <future>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

#include "vdi/core/Ready.h"

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

void waitForRetired() {
  std::vector<std::future<void>> jobs;
  {
    const std::scoped_lock lock(retired().mutex);
    jobs.swap(retired().jobs);
  }
  for (const std::future<void>& job : jobs) job.wait();
}

}  // namespace

void retire(std::shared_ptr<void> thing) {
  const std::scoped_lock lock(retired().mutex);
  // Exit handlers run in reverse order: this one before those of libraries that the thing has used, for
  // example OpenSSL's.
  std::atexit(waitForRetired);
  std::erase_if(retired().jobs, [](const std::future<void>& job) { return vdi::isReady(job); });
  try {
    retired().jobs.push_back(
        std::async(std::launch::async, [last = std::move(thing)]() mutable { last.reset(); }));
  } catch (const std::system_error&) {  // without a thread, the caller's has destroyed it
  }
}

}  // namespace pv
