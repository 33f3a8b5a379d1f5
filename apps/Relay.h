// Offers here what another server offers.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "vdi/stream/Client.h"
#include "vdi/stream/Server.h"

namespace vdi::apps {

/// A client of the other server and a server of its own. Frames pass as they are. A frame of the series that
/// a viewer asks for is fetched; meanwhile, newer ones wait. The other server's restart is one for viewers
/// too.
class Relay {
 public:
  /// Throws Error as Client and Server do.
  Relay(stream::ClientOptions from, stream::ServerOptions to);
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  const stream::Server& server() const { return *server_; }
  /// Passes on what comes within that time. Throws Error as Client::next.
  void step(std::chrono::milliseconds time);

 private:
  void follow(const stream::Client::Standing& standing);
  void restart();
  void ask();
  void pass(stream::Received received);
  void add(stream::Received received);
  void finish(std::uint32_t index);

  stream::ServerOptions options_;
  std::string session_;  // of the other server
  std::size_t seriesPassed_ = 0;
  std::optional<stream::Phase> phase_;
  std::shared_ptr<const stream::Frame> current_;  // that comes in
  std::list<stream::FramePtr> whole_;             // the last few that came in whole
  std::optional<std::uint32_t> newest_;
  std::optional<std::uint32_t> asked_;  // of the series
  std::mutex mutex_;                    // for the next one
  std::deque<std::uint32_t> wanted_;
  std::unique_ptr<stream::Server> server_;
  stream::Client client_;
};

}  // namespace vdi::apps
