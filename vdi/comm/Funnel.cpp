#include "vdi/comm/Funnel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "vdi/comm/Operation.h"
#include "vdi/core/Error.h"

namespace vdi::comm {

namespace {

thread_local Funnel* current = nullptr;

/// The time that `serve` waits for a request. The other thread takes less between operations of a sequence.
constexpr std::chrono::milliseconds patience{3};

}  // namespace

struct Funnel::State {
  std::mutex mutex;
  std::condition_variable asked;
  std::condition_variable ended;
  const Operation* wanted = nullptr;  // belongs to the server until it is null again
  bool begun = false;
  std::vector<MPI_Request> requests;
  int result = MPI_SUCCESS;
  std::exception_ptr error;  // thrown by begin, for the thread that wants the operation

  /// Advances the wanted operation; returns whether it has ended.
  bool advance() {
    if (!begun) begin();
    if (error || result != MPI_SUCCESS || requests.empty()) return true;
    int done = 0;
    result = MPI_Testall(static_cast<int>(requests.size()), requests.data(), &done, MPI_STATUSES_IGNORE);
    return result != MPI_SUCCESS || done != 0;
  }

  void begin() {
    begun = true;
    requests.clear();
    result = MPI_SUCCESS;
    error = nullptr;
    try {
      result = wanted->begin(requests);
    } catch (...) {
      error = std::current_exception();
    }
  }
};

Funnel::Funnel() : state_(std::make_unique<State>()) {
  constexpr std::size_t usual = 8;  // an operation has one request, and a chunk's messages at most four
  state_->requests.reserve(usual);
}
Funnel::~Funnel() = default;

Funnel::Entry::Entry(Funnel& funnel) : before_(current) {
  current = &funnel;
}

Funnel::Entry::~Entry() {
  current = before_;
}

void Funnel::serve(std::chrono::milliseconds most) {
  State& state = *state_;
  const auto end = std::chrono::steady_clock::now() + most;
  std::unique_lock lock(state.mutex);
  for (;;) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= end) return;
    if (!state.asked.wait_until(lock, std::min(end, now + patience), [&] { return state.wanted != nullptr; }))
      return;
    lock.unlock();
    const bool hasEnded = state.advance();
    if (!hasEnded) std::this_thread::yield();
    lock.lock();
    if (!hasEnded) continue;
    state.wanted = nullptr;
    state.ended.notify_one();
  }
}

void check(int result, const char* call) {
  if (result == MPI_SUCCESS) return;
  std::array<char, MPI_MAX_ERROR_STRING> text{};
  int length = 0;
  MPI_Error_string(result, text.data(), &length);
  throw Error(ErrorCode::Communication, fmt::format("{} failed: {}", call, text.data()));
}

bool Operation::isCarried() {
  return current != nullptr;
}

void Operation::carry(const char* name) const {
  Funnel::State& state = *current->state_;
  std::unique_lock lock(state.mutex);
  assert(state.wanted == nullptr);  // one thread at a time
  state.begun = false;
  state.wanted = this;
  state.asked.notify_one();
  state.ended.wait(lock, [&] { return state.wanted == nullptr; });
  if (state.error) std::rethrow_exception(std::exchange(state.error, nullptr));
  check(state.result, name);
}

void waitForAll(std::vector<MPI_Request>& requests) {
  if (requests.empty()) return;  // MPI may not be initialised
  if (Operation::isCarried()) {
    const auto begin = [&](std::vector<MPI_Request>& taken) {
      if (requests.size() <= taken.capacity()) {
        taken.assign(requests.begin(), requests.end());
        requests.clear();
      } else {
        taken.swap(requests);
      }
      return MPI_SUCCESS;
    };
    return Operation{begin}.carry("MPI_Testall");
  }
  const int result = MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
  requests.clear();
  check(result, "MPI_Waitall");
}

}  // namespace vdi::comm
