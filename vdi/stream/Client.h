// A viewer that isn't a browser: gets levels from a server.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "vdi/stream/Assembly.h"
#include "vdi/stream/Protocol.h"
#include "vdi/stream/Url.h"

namespace vdi::stream {

struct ClientOptions {
  Url url;  // with a token
  /// In place of the link: `sh -c` runs this and finds a server at its standard input and output, as
  /// "ssh host vdi serve --stdio folder" does. Each connection runs it anew.
  std::string command;
  /// PEM: certificates to trust beside the system's.
  std::filesystem::path authority;
  /// A level of more bytes ends the connection.
  std::uint64_t mostLevelBytes = std::uint64_t{4} << 30;
  /// Received has VDIs, which are decoded while they arrive, instead of files.
  bool decodes = false;
  /// Gets lines for the user, such as why a connection was lost; from the client's thread.
  std::function<void(const std::string& line)> log;
};

/// Connects on a thread of its own, and again whenever a connection is lost, after pauses of up to 5 s. A
/// level counts as received once next() returns it, so a slow caller gets fewer frames rather than old ones.
class Client {
 public:
  /// Throws Error{Io} for an authority that can't be read. Whether the server can be reached shows later.
  explicit Client(ClientOptions options);
  /// Ends the connection, within two seconds, or four where a command runs.
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Returns the next whole level, or nullopt after `timeout`. Throws Error, now and in each later call, once
  /// trying again is of no use: InvalidArgument for a wrong token, Format for a server of another version or
  /// a peer that is no such server, Io for a certificate that isn't trusted.
  std::optional<Received> next(std::chrono::milliseconds timeout);

  struct Standing {
    bool isConnected = false;                     // and welcome
    std::string session;                          // of the last connection
    State state;                                  // what the server said last
    bool hasState = false;                        // on the last connection, and after its series
    bool hasBeenLive = false;                     // in the session; a finished series never is
    std::optional<std::size_t> series;            // frames in it
    std::chrono::steady_clock::time_point since;  // of isConnected
    std::string trouble;                          // why there is no connection; empty: none so far
  };
  Standing standing() const;
  /// The series of the last connection, from its entry `from` on; empty: there's none, or none so far.
  Series seriesFrom(std::size_t from) const;

  /// Asks for a frame of the series, here and after a reconnect, as soon as the series has it.
  void show(std::uint32_t index);
  void pause();
  /// Asks for the newest frames again.
  void resume();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdi::stream
