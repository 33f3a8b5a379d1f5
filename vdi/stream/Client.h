// A viewer outside a browser, which gets levels from a server.
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
  /// A command for `sh -c`, used instead of the link. It must connect its standard input and output to a
  /// server, as "ssh host vdi serve --stdio folder" does. Each connection runs it again.
  std::string command;
  /// PEM file of certificates to trust besides the system's.
  std::filesystem::path authority;
  /// A level with more bytes than this ends the connection.
  std::uint64_t mostLevelBytes = std::uint64_t{4} << 30;
  /// Received has VDIs, which are decoded while they arrive, instead of files.
  bool decodes = false;
  /// Gets lines for the user, such as why a connection was lost, on the client's thread.
  std::function<void(const std::string& line)> log;
};

/// Connects on a thread of its own, and reconnects whenever a connection is lost, after pauses of
/// up to 5 s. A level counts as received once next() returns it, so a slow caller gets fewer frames
/// rather than old ones.
class Client {
 public:
  /// Throws Error{Io} for an authority that can't be read. standing() tells later whether the server can be
  /// reached.
  explicit Client(ClientOptions options);
  /// Ends the connection, within two seconds, or four if a command runs.
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Returns the next whole level, or nullopt after `timeout`. Throws Error, now and in each later
  /// call, once another attempt is of no use: InvalidArgument for a wrong token, Format for a
  /// server of another version or a peer that isn't a server of VDIs, Io for a certificate that
  /// isn't trusted.
  std::optional<Received> next(std::chrono::milliseconds timeout);

  struct Standing {
    bool isConnected = false;                     // connected, and the server has said welcome
    std::string session;                          // of the last connection
    State state;                                  // the last that the server sent
    bool hasState = false;                        // the last connection has sent `state`, after its series
    bool hasBeenLive = false;                     // in the session; false for a finished series
    std::optional<std::size_t> series;            // frames in it
    std::chrono::steady_clock::time_point since;  // of isConnected
    std::string trouble;                          // why there is no connection; empty: none so far
  };
  Standing standing() const;
  /// The series of the last connection, from its entry `from` on; empty: there's none, or none so far.
  Series seriesFrom(std::size_t from) const;

  /// Asks for a frame as soon as the series has it, now and after each reconnect.
  void show(std::uint32_t index);
  void pause();
  /// Asks for the newest frames again.
  void resume();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdi::stream
