// The process that makes a rank's frames, as the rank sees it.
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "catalyst_adaptor/isolated/Messages.h"
#include "catalyst_adaptor/isolated/SharedPages.h"
#include "catalyst_adaptor/isolated/Socket.h"
#include "catalyst_adaptor/isolated/StepData.h"

namespace vdi::catalyst {

/// No function is collective, and each waits for the given time at most. Ranks learn of finished
/// frames at different moments; IsolatedRun makes them agree. Functions that communicate with the
/// process therefore don't throw: if there is no memory for its messages, they count the process as
/// gone.
class FrameProcess {
 public:
  using Milliseconds = std::chrono::milliseconds;

  /// Listens for the process under a socket's name. The process gets `setup` when it connects. Throws
  /// std::runtime_error.
  FrameProcess(const std::string& name, const Setup& setup);
  /// Kills the process if it still runs.
  ~FrameProcess();
  FrameProcess(const FrameProcess&) = delete;
  FrameProcess& operator=(const FrameProcess&) = delete;

  /// Takes the process's messages. Waits at most `patience` for the first message.
  void listen(Milliseconds patience) noexcept;

  bool hasCome() const { return socket_.isOpen(); }
  /// The code of the process's initialising; nullopt until that has ended.
  std::optional<int> startCode() const { return startCode_; }
  /// Whether the process has ended, or will do so.
  bool isGone() const { return isGone_; }
  /// Describes how the process ended and what it was doing: "was killed by signal 9 (Killed) while it
  /// started".
  std::string end() const;
  /// Whether the process is stopped, as by SIGSTOP.
  bool isStopped() const;

  /// Number of finished steps among those handed over.
  std::int64_t doneCount() const { return doneCount_; }
  /// The result of the next step that is done. There must be one.
  DoneNotice takeDone();
  /// Makes room for a step's data in the next of the two buffers, which no step uses. Throws
  /// std::runtime_error.
  void reserve(const StepWriter& data);
  /// Tells the process which steps aren't handed over. Returns false if there is no memory to share them.
  bool tellLeftOut(const LeftOutSteps& steps) noexcept;
  /// Hands a step over in the reserved buffer.
  void handOver(const StepWriter& data, StepNotice notice) noexcept;

  /// Whether scripts want the step; nullopt if that isn't known.
  std::optional<bool> wants(std::int64_t step) const;
  void ask(std::int64_t first) noexcept;

  void finish() noexcept;
  /// The code and text of finalizing; nullopt until that has ended.
  struct Finish {
    int code = 0;
    std::string text;
  };
  const std::optional<Finish>& finished() const { return finished_; }
  /// Waits for the process's end, which follows its finish.
  void awaitEnd(Milliseconds patience) noexcept;

 private:
  template <typename Work>
  void orGiveUp(Work work) noexcept;
  template <typename Fill>
  void tell(Fill fill, std::span<const int> descriptors = {}) noexcept;
  void hear(Milliseconds patience);
  void take(Socket::Received& received);
  std::string stage() const;
  void kill();

  Socket listener_;
  Socket socket_;
  SharedPages setup_;
  std::optional<int> startCode_;
  bool isGone_ = false;
  bool isHungUp_ = false;      // the socket has no other end
  bool isGivenUp_ = false;     // because memory ran out
  std::optional<int> status_;  // the worker's, as waitpid has it
  pid_t worker_ = 0;
  std::int64_t handedOver_ = 0;
  std::deque<std::int64_t> underWay_;  // steps
  std::optional<std::int64_t> begun_;
  std::int64_t doneCount_ = 0;
  std::deque<DoneNotice> done_;  // not yet taken
  std::array<SharedPages, 2> buffers_;
  std::array<bool, 2> areKnown_{};  // whether the process has a buffer's pages
  std::int64_t firstWanted_ = 0;
  std::vector<std::uint8_t> wanted_;
  bool isFinishing_ = false;
  std::optional<Finish> finished_;
};

}  // namespace vdi::catalyst
