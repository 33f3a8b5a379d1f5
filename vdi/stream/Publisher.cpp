#include "vdi/stream/Publisher.h"

#include <sys/resource.h>
#include <unistd.h>

#include <exception>
#include <utility>

namespace vdi::stream {

namespace {

/// Lets this thread, and those that it starts, yield to others. Linux has a niceness for each thread. A
/// thread that yields more already stays unchanged.
void giveWay() {
  constexpr int niceness = 10;
  const auto thread = static_cast<id_t>(::gettid());
  if (::getpriority(PRIO_PROCESS, thread) < niceness) (void)::setpriority(PRIO_PROCESS, thread, niceness);
}

}  // namespace

Publisher::Publisher(Server& server) : server_(server) {
  thread_ = std::thread([this] { work(); });
}

Publisher::~Publisher() {
  {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Publisher::publish(std::shared_ptr<const Vdi> vdi) {
  {
    const std::scoped_lock lock(mutex_);
    if (pending_) ++dropped_;
    pending_ = {std::move(vdi), Clock::now()};
  }
  changed_.notify_all();
}

std::uint64_t Publisher::dropped() const {
  const std::scoped_lock lock(mutex_);
  return dropped_;
}

std::string Publisher::trouble() const {
  const std::scoped_lock lock(mutex_);
  return trouble_;
}

void Publisher::work() {
  giveWay();
  while (true) {
    Pending pending;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return pending_ || isEnding_; });
      if (!pending_) return;
      pending = *std::exchange(pending_, std::nullopt);
    }
    encode(pending);
  }
}

void Publisher::encode(const Pending& pending) {
  try {
    const auto goesOn = [this] {
      const std::scoped_lock lock(mutex_);
      return !pending_ || server_.carriesWholeFrames();
    };
    const auto take = [this](FramePtr frame) { server_.publish(std::move(frame)); };
    encodeFrame(*pending.vdi, nextId_++, pending.made, take, goesOn);
  } catch (const std::exception& error) {
    note(error);
  }
}

void Publisher::note(const std::exception& error) noexcept {
  const std::scoped_lock lock(mutex_);
  if (!trouble_.empty()) return;
  try {
    trouble_ = error.what();
  } catch (const std::exception&) {
    trouble_ = "no memory";  // short enough to be stored without an allocation
  }
}

}  // namespace vdi::stream
