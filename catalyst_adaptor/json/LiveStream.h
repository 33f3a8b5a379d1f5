// The frames of a run in browsers, as the extractor VDIStream shows them.
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
  /// Listens when it returns, and has said on standard error where. Throws Error as Server and givenToken do,
  /// and Io if the link can't be written.
  explicit LiveStream(const config::RunStream& options);
  /// Hands the last frame over before the server ends, and removes the link's file.
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  /// Never waits. Throws Error{Format} once for each new reason why a frame before couldn't be sent.
  void publish(std::shared_ptr<const Vdi> vdi);
  /// Frames that viewers never got, for the next one came before they were encoded.
  std::uint64_t dropped() const;

  /// What viewers have asked for since this was called last. Waits so long at most; none: nothing, or the run
  /// lets nobody steer.
  std::optional<stream::Request> takeRequest(std::chrono::milliseconds patience);
  /// What viewers may ask for, and what is in force.
  void setControls(stream::Controls controls);

 private:
  struct Service;
  std::unique_ptr<Service> service_;
};

}  // namespace vdi::catalyst
