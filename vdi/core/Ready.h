// Whether a job of another thread has ended.
#pragma once

#include <chrono>
#include <future>

namespace vdi {

/// Whether the job's result can be taken without waiting. False without a job, and for a deferred one.
template <typename Result>
bool isReady(const std::future<Result>& job) {
  return job.valid() && job.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace vdi
