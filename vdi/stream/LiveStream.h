// The stream of a running simulation's VDIs to viewers.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vdi/core/Vdi.h"
#include "vdi/stream/Steering.h"

namespace vdi::stream {

struct LiveOptions {
  std::string host;
  std::uint16_t port = 0;  // 0: any free port
  std::string tokenFile;   // empty: VDI_TOKEN, or a new token
  std::string linkFile;    // empty: the link isn't stored
  std::string certificate;
  std::string key;
  std::vector<std::string> origins;    // ServerOptions
  std::string originOption;            // likewise
  std::vector<std::string> embedders;  // likewise
  double megabits = 0.0;               // rate to each viewer in Mbit/s; 0: no limit
  bool isSteered = false;              // viewers may change the run
  std::string page;                    // HTML, at /
  std::string programName;             // begins each line on standard error
};

class LiveStream {
 public:
  /// Starts the server, which listens when this returns, and prints its address to standard error. Throws
  /// Error as Server and givenToken do, and Error{Io} if the link can't be written.
  explicit LiveStream(const LiveOptions& options);
  /// Hands the last frame over before it ends the server, and removes the link's file.
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  /// Never waits.
  void publish(std::shared_ptr<const Vdi> vdi);
  /// Throws Error{Format} once for each new reason why an earlier frame couldn't be sent.
  void requireSent();
  /// The number of frames that viewers never got, because the next one came before they were encoded.
  std::uint64_t dropped() const;

  /// The viewers' request since the last call. Waits at most `patience`. Nullopt if there is none, or nobody
  /// may steer.
  std::optional<SteeringRequest> takeRequest(std::chrono::milliseconds patience);
  /// Tells viewers what they may ask for, and the values in force.
  void setControls(Controls controls);

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

}  // namespace vdi::stream
