// The stream of a run's frames to browsers, as the extractor VDIStream makes it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "vdi/config/Run.h"
#include "vdi/core/Vdi.h"
#include "vdi/stream/Steering.h"

namespace vdi::catalyst {

class LiveStream {
 public:
  /// Starts the server, which listens when this returns, and prints its address to standard error. Throws
  /// Error as Server and givenToken do, and Error{Io} if the link can't be written.
  explicit LiveStream(const config::RunStream& options);
  /// Hands the last frame over before it ends the server, and removes the link's file.
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  /// Never waits. Throws Error{Format} once for each new reason why an earlier frame couldn't be sent.
  void publish(std::shared_ptr<const Vdi> vdi);
  /// The number of frames that viewers never got, because the next one came before they were encoded.
  std::uint64_t dropped() const;

  /// The viewers' request since the last call. Waits at most `patience`. Nullopt if there is none,
  /// or if the run doesn't let viewers steer.
  std::optional<stream::SteeringRequest> takeRequest(std::chrono::milliseconds patience);
  /// Tells viewers what they may ask for, and the values in force.
  void setControls(stream::Controls controls);

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

}  // namespace vdi::catalyst
