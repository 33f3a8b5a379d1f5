// Offers another server's frames to its own viewers.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "vdi/stream/Client.h"
#include "vdi/stream/Server.h"

namespace vdi::apps {

/// A client of the other server, and a server for its own viewers. It passes on frames unchanged. If a viewer
/// asks for a frame of the series, the relay fetches it, and newer frames wait meanwhile. If the
/// other server restarts, viewers see a restart, too. While it doesn't answer, they are told so.
/// Once it has ended a run, viewers get the frames that the relay still has, and are told that
/// others are gone.
class Relay {
 public:
  /// Throws Error as Client and Server do.
  Relay(stream::ClientOptions from, stream::ServerOptions to);
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  const stream::Server& server() const { return *server_; }
  /// Passes on the frames that arrive within that time. Throws Error as Client::next does.
  void step(std::chrono::milliseconds time);

 private:
  void follow(const stream::Client::Standing& standing);
  void tell(const stream::Client::Standing& standing);
  void restart();
  void ask();
  void giveUp();
  void pass(stream::Received received);
  void add(stream::Received received);
  void finish(std::uint32_t index);

  stream::ServerOptions options_;
  std::string session_;  // the other server's
  std::size_t seriesPassed_ = 0;
  std::optional<stream::Phase> phase_;            // the other server's
  bool isOver_ = false;                           // the other server has ended its run, and is gone
  stream::State told_;                            // the state that viewers know, without their number
  std::shared_ptr<const stream::Frame> current_;  // the frame that is arriving
  std::uint32_t firstLevel_ = 0;                  // current_'s first level, as the other server counts
  std::list<stream::FramePtr> whole_;             // the latest whole frames
  std::optional<std::uint32_t> newest_;
  std::optional<std::uint32_t> asked_;  // the wanted frame of the series
  std::mutex mutex_;                    // guards wanted_
  std::deque<std::uint32_t> wanted_;
  std::unique_ptr<stream::Server> server_;
  stream::Client client_;
};

}  // namespace vdi::apps
