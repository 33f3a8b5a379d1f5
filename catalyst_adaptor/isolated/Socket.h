// Messages and descriptors between a rank of the simulation and the process that makes its frames.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/Descriptor.h"

namespace vdi::catalyst {

/// A name for sockets of one run that no other run has.
std::string newSocketName();

/// Whole messages, in order, within this host. No function throws or raises a signal when the other side is
/// gone: sending fails, and receiving returns Result::Gone.
class Socket {
 public:
  Socket() = default;
  explicit Socket(Descriptor descriptor) : descriptor_(std::move(descriptor)) {}

  /// Listens under a name outside the file system. Throws std::runtime_error.
  static Socket listener(const std::string& name);
  /// Connects to a listener of the same user; a closed socket if there is none.
  static Socket connectTo(const std::string& name);
  /// The next connection from a process of the same user; a closed socket if none comes within the time.
  Socket accept(std::chrono::milliseconds patience) const;

  /// Sends a message of at most `longest` bytes without waiting; returns whether that was possible.
  bool send(std::span<const std::byte> message, std::span<const int> descriptors = {}) const;

  enum class Result { Message, Nothing, Gone };
  struct Received {
    Result result = Result::Nothing;
    std::vector<std::byte> message;
    std::vector<Descriptor> descriptors;
  };
  /// The next message. Waits at most `patience`; a negative one waits for ever.
  Received receive(std::chrono::milliseconds patience) const;

  static constexpr std::size_t longest = 65536;
  bool isOpen() const { return descriptor_.isOpen(); }
  int number() const { return descriptor_.number(); }
  void close() { descriptor_ = Descriptor(); }
  /// The process that has connected; 0 if unknown.
  pid_t peer() const;

 private:
  Descriptor descriptor_;
};

}  // namespace vdi::catalyst
