// VDIs of a running simulation as the frames of a server, encoded in the background.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "vdi/core/Vdi.h"
#include "vdi/stream/Frame.h"
#include "vdi/stream/Server.h"

namespace vdi::stream {

/// Encodes on its own thread and on threads that it starts, at a lower priority than the simulation's.
class Publisher {
 public:
  /// The server must outlive the publisher.
  explicit Publisher(Server& server);
  /// Encodes the VDI published last in full, and hands it to the server, before it returns.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// Never waits. If the encoding of the last VDI hasn't begun, that VDI is dropped. If its coarse levels are
  /// encoded, the full one is abandoned, unless some viewer could have it before the next frame.
  void publish(std::shared_ptr<const Vdi> vdi);
  std::uint64_t dropped() const;
  /// The error of the first VDI that couldn't be encoded; empty: none. Later VDIs are still encoded.
  std::string trouble() const;

 private:
  struct Pending {
    std::shared_ptr<const Vdi> vdi;
    Clock::time_point made;
  };
  void work();
  void encode(const Pending& pending);
  /// Keeps the error's text for trouble(), unless it holds an earlier one.
  void note(const std::exception& error) noexcept;

  Server& server_;
  std::uint32_t nextId_ = 0;  // only the thread uses it

  std::condition_variable changed_;  // signals that pending_ or isEnding_ has changed
  mutable std::mutex mutex_;         // guards the next four members
  std::optional<Pending> pending_;
  std::uint64_t dropped_ = 0;
  std::string trouble_;
  bool isEnding_ = false;
  std::thread thread_;
};

}  // namespace vdi::stream
