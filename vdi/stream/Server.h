// Offers frames to many viewers, by HTTP and WebSocket on one port. docs/live.md has the protocol.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vdi/stream/Frame.h"
#include "vdi/stream/Protocol.h"

namespace vdi::stream {

struct ServerOptions {
  std::string host = "127.0.0.1";    // the address at which the server listens
  std::uint16_t port = 0;            // 0: any free port
  bool listens = true;               // false: serves only the sockets given to adopt()
  std::string token;                 // must satisfy requireToken
  std::string page;                  // HTML, at /
  std::vector<std::string> origins;  // of other sites' pages that may connect: "https://example.org"
  /// How a user allows an origin, with {} in its place, for the line on a refused one. Empty: by no option.
  std::string originOption;
  std::vector<std::string> embedders;  // origins of sites that may show the page in a frame
  double mostBytesPerSecond = 0.0;     // to each viewer; 0: no limit
  std::uint32_t mostViewers = 64;
  /// Upper bound on the bytes of superseded frames held for slow viewers. Beyond it, the server disconnects
  /// the viewer that has taken nothing for longest.
  std::uint64_t mostHeldBytes = std::uint64_t{1} << 30;
  std::uint32_t mostConnections = 256;  // of any kind, viewers included
  std::filesystem::path certificate;    // PEM, a chain; empty: no TLS
  std::filesystem::path key;            // PEM
  /// Called when a viewer wants that frame of the series. Answer with Server::provide or
  /// Server::miss. Runs on the network's thread, so it must return at once.
  std::function<void(std::uint32_t index)> show;
  /// Called with a wish of the viewer that drives; empty: no viewer can steer. Wishes have been
  /// checked against the controls that were set last. Runs on the network's thread, so it must
  /// return at once.
  std::function<void(std::uint32_t viewer, const Wish& wish)> steer;
  /// Gets lines for the operator, without secrets, on the network's thread.
  std::function<void(const std::string& line)> log;
};

struct ServerStatus {
  std::string session;
  Phase phase = Phase::Waiting;
  std::uint32_t viewers = 0;
  std::uint64_t frames = 0;  // published
};

/// One thread does all work on the network. Any thread may call the functions, and none of them waits for a
/// viewer. The server keeps only the newest frame and those that some viewer still needs.
class Server {
 public:
  /// The server listens when the constructor returns. Throws Error: Io for an unavailable address, or a
  /// certificate or key that can't be read; InvalidArgument for a token that requireToken refuses, an
  /// origin that isOrigin refuses, or a certificate without a key.
  explicit Server(ServerOptions options);
  /// Tells viewers that the server ends, and waits two seconds at most for them.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const;
  /// The page's address, "http://127.0.0.1:8080/", and the same with the token, which is a secret.
  std::string address() const;
  std::string link() const;

  /// Publishes the newest frame, or more levels of it.
  void publish(FramePtr frame);
  /// Whether, judging by past frames, some viewer receives full levels before the next frame arrives. Never
  /// waits.
  bool carriesWholeFrames() const;
  /// Answers with a frame of the series that a viewer asked for.
  void provide(FramePtr frame);
  /// Answers that there is no such frame, and why.
  void miss(Missing missing);
  /// Whether a viewer still wants that frame of the series.
  bool isWanted(std::uint32_t index) const;
  /// Appends entries to the series.
  void append(Series entries);
  /// `cause`: why no frames come although they should; viewers see it.
  void setPhase(Phase phase, std::string cause = {});
  /// Sets what can be steered, and what is in force. Viewers are told of changes.
  void setControls(Controls controls);
  /// Serves a connected stream socket, which it owns from now on.
  void adopt(int descriptor);
  ServerStatus status() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdi::stream
