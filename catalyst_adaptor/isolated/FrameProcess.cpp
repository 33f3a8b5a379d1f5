#include "catalyst_adaptor/isolated/FrameProcess.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <utility>

namespace vdi::catalyst {

FrameProcess::FrameProcess(const std::string& name, const Setup& setup) {
  Packer packer;
  setup.pack(packer);
  setup_ = SharedPages(packer.bytes().size());
  std::memcpy(setup_.bytes().data(), packer.bytes().data(), packer.bytes().size());
  listener_ = Socket::listener(name);
}

FrameProcess::~FrameProcess() {
  kill();
}

/// Kills the supervisor, with which the worker dies. Unless the supervisor has closed the socket, it is alive
/// and its process number is valid.
void FrameProcess::kill() {
  const pid_t supervisor = socket_.peer();
  if (supervisor > 0 && !isGone_) ::kill(supervisor, SIGKILL);
  socket_.close();
}

/// Runs `work`. If memory runs out, counts the process as gone.
template <typename Work>
void FrameProcess::orGiveUp(Work work) noexcept {
  try {
    work();
  } catch (const std::bad_alloc&) {
    isGone_ = isGivenUp_ = true;
  }
}

/// Sends a message that `fill` fills in. If that fails, takes the messages with the cause, and
/// counts the process as gone.
template <typename Fill>
void FrameProcess::tell(Fill fill, std::span<const int> descriptors) noexcept {
  bool isSent = false;
  orGiveUp([&] {
    Packer message;
    fill(message);
    isSent = socket_.send(message.bytes(), descriptors);
  });
  if (isSent) return;
  listen(Milliseconds(0));
  isGone_ = true;
}

void FrameProcess::listen(Milliseconds patience) noexcept {
  orGiveUp([&] { hear(patience); });
}

void FrameProcess::hear(Milliseconds patience) {
  if (listener_.isOpen()) {
    socket_ = listener_.accept(patience);
    if (!socket_.isOpen()) return;
    listener_.close();
    Packer hello;
    hello.put(Say::Hello);
    const std::array<int, 3> descriptors{STDOUT_FILENO, STDERR_FILENO, setup_.descriptor()};
    if (!socket_.send(hello.bytes(), descriptors)) isGone_ = true;
    setup_ = SharedPages();
  }
  for (bool isFirst = true; socket_.isOpen() && !isGone_; isFirst = false) {
    Socket::Received received;
    try {
      received = socket_.receive(isFirst ? patience : Milliseconds(0));
    } catch (const std::bad_alloc&) {
      return;  // the message waits for the next call
    }
    if (received.result == Socket::Result::Nothing) return;
    if (received.result == Socket::Result::Gone) {
      isGone_ = isHungUp_ = true;
      return;
    }
    take(received);
  }
}

void FrameProcess::take(Socket::Received& received) {
  Unpacker message(received.message);
  switch (message.take<Say>()) {
    case Say::Worker:
      worker_ = message.take<std::int32_t>();
      return;
    case Say::Started:
      startCode_ = message.take<std::int32_t>();
      return;
    case Say::Begun:
      begun_ = message.take<std::int64_t>();
      return;
    case Say::Done: {
      DoneNotice notice;
      notice.step = message.take<std::int64_t>();
      notice.code = message.take<std::int32_t>();
      notice.text = message.takeText();
      for (auto count = message.take<std::uint64_t>(); count > 0; --count)
        notice.parameters.push_back(message.take<double>());
      // The process may have been unable to map the pages, so it gets them again with their next step.
      if (notice.code != 0) areKnown_[static_cast<std::size_t>(doneCount_ % 2)] = false;
      done_.push_back(std::move(notice));
      ++doneCount_;
      if (!underWay_.empty()) underWay_.pop_front();
      begun_.reset();
      return;
    }
    case Say::Wanted:
      firstWanted_ = message.take<std::int64_t>();
      wanted_.resize(message.take<std::uint64_t>());
      for (std::uint8_t& one : wanted_) one = message.take<std::uint8_t>();
      return;
    case Say::Finished:
      finished_ = {message.take<std::int32_t>(), ""};
      finished_->text = message.takeText();
      return;
    case Say::Ended:
      status_ = message.take<std::int32_t>();
      isGone_ = true;
      return;
    default:
      return;
  }
}

DoneNotice FrameProcess::takeDone() {
  DoneNotice notice = std::move(done_.front());
  done_.pop_front();
  return notice;
}

std::string FrameProcess::end() const {
  std::string cause = isGivenUp_ ? "is given up, because this host is out of memory," : "is gone";
  if (status_ && WIFSIGNALED(*status_)) {
    const int number = WTERMSIG(*status_);
    cause = "was killed by signal " + std::to_string(number) + " (" + strsignal(number) + ")";
  } else if (status_) {
    cause = "ended with exit status " + std::to_string(WEXITSTATUS(*status_));
  } else if (isHungUp_ && worker_ > 0) {
    // If the supervisor still can, it tells how its worker ended.
    cause = "was killed together with the one that supervises it, as by SIGKILL to both,";
  }
  return cause + " " + stage();
}

std::string FrameProcess::stage() const {
  if (!startCode_) return "while it started";
  if (begun_) return "while it made the frame of step " + std::to_string(*begun_);
  if (!underWay_.empty()) return "while it took over step " + std::to_string(underWay_.front());
  if (isFinishing_) return "while it ended the run";
  return "while it waited for a step";
}

bool FrameProcess::isStopped() const {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), "/proc/%d/stat", static_cast<int>(worker_));
  std::FILE* file = worker_ > 0 ? std::fopen(text.data(), "re") : nullptr;
  if (file == nullptr) return false;
  const std::size_t count = std::fread(text.data(), 1, text.size() - 1, file);
  std::fclose(file);
  text[count] = '\0';
  // The state follows the name, which may contain anything.
  const char* after = std::strrchr(text.data(), ')');
  const char state = after != nullptr && after[1] == ' ' ? after[2] : '?';
  return state == 'T' || state == 't';
}

void FrameProcess::reserve(const StepWriter& data) {
  const auto next = static_cast<std::size_t>(handedOver_ % 2);
  SharedPages& buffer = buffers_[next];
  if (buffer.bytes().size() >= data.bytes()) return;
  buffer = SharedPages();  // first, because there may be no room for both
  areKnown_[next] = false;
  buffer = SharedPages(data.bytes());
}

bool FrameProcess::tellLeftOut(const LeftOutSteps& steps) noexcept {
  SharedPages pages;
  try {
    Packer packer;
    steps.pack(packer);
    pages = SharedPages(packer.bytes().size());
    std::memcpy(pages.bytes().data(), packer.bytes().data(), packer.bytes().size());
  } catch (const std::exception&) {
    return false;
  }
  const std::array<int, 1> descriptors{pages.descriptor()};
  tell([](Packer& message) { message.put(Say::LeftOut); }, descriptors);
  return true;
}

void FrameProcess::handOver(const StepWriter& data, StepNotice notice) noexcept {
  notice.buffer = static_cast<std::uint32_t>(handedOver_ % 2);
  notice.isNewBuffer = !std::exchange(areKnown_[notice.buffer], true);
  const SharedPages& buffer = buffers_[notice.buffer];
  data.write(buffer.bytes());
  const std::array<int, 1> pages{buffer.descriptor()};
  ++handedOver_;
  tell(
      [&](Packer& message) {
        message.put(Say::Step);
        message.put(notice);
        underWay_.push_back(notice.step);
      },
      std::span(pages).first(notice.isNewBuffer ? 1 : 0));
}

std::optional<bool> FrameProcess::wants(std::int64_t step) const {
  const std::int64_t at = step - firstWanted_;
  if (at < 0 || at >= static_cast<std::int64_t>(wanted_.size())) return std::nullopt;
  return wanted_[static_cast<std::size_t>(at)] != 0;
}

void FrameProcess::ask(std::int64_t first) noexcept {
  orGiveUp([&] {
    Packer message;
    message.put(Say::Ask);
    message.put(first);
    if (!socket_.send(message.bytes())) isGone_ = true;
  });
}

void FrameProcess::finish() noexcept {
  isFinishing_ = true;
  tell([](Packer& message) { message.put(Say::Finish); });
}

void FrameProcess::awaitEnd(Milliseconds patience) noexcept {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!isGone_ && std::chrono::steady_clock::now() < end) listen(Milliseconds(20));
}

}  // namespace vdi::catalyst
