// The server's side of the conversation with each viewer, without a network. All of it belongs to one thread.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "vdi/stream/Frame.h"
#include "vdi/stream/Outbox.h"
#include "vdi/stream/Protocol.h"
#include "vdi/stream/Token.h"

namespace vdi::stream {

class Viewer;

/// The state that all viewers of a server share.
class Hub {
 public:
  struct Options {
    std::string token;
    double mostBytesPerSecond = 0.0;  // to each viewer; 0: no limit
    std::uint32_t mostViewers = 0;
    /// Upper bound on the bytes of superseded frames held for slow viewers.
    std::uint64_t mostHeldBytes = std::uint64_t{1} << 30;
    /// Called when a viewer wants that frame of the series. Answer with provide or miss.
    std::function<void(std::uint32_t index)> show;
    /// Called with a wish of the viewer that drives; empty: no viewer can steer.
    std::function<void(std::uint32_t viewer, const Wish& wish)> steer;
    /// Gets lines for the operator; may be empty.
    std::function<void(const std::string& line)> log;
  };
  /// A random session. Throws Error{Io} as randomToken.
  explicit Hub(Options options);

  /// Offers the newest frame, or more levels of it, to all viewers that aren't looking at an older
  /// one. Changes the phase from Waiting to Live, unless setPhase gave a cause.
  void publish(FramePtr frame, Clock::time_point now);
  /// Offers a frame of the series to the viewers that asked for it.
  void provide(const FramePtr& frame, Clock::time_point now);
  /// Tells the viewers that asked for a frame why there is none.
  void miss(const Missing& missing);
  /// Whether a viewer still waits for that frame of the series or is showing it.
  bool isWanted(std::uint32_t index) const;
  void append(const Series& entries);
  /// `cause`: why no frames come although they should.
  void setPhase(Phase phase, std::string cause = {});
  /// Sets what can be steered, and what is in force.
  void setControls(Controls controls);

  const std::string& session() const { return session_; }
  Phase phase() const { return phase_; }
  const FramePtr& newest() const { return newest_; }
  const std::optional<Series>& series() const { return series_; }
  std::uint32_t viewerCount() const { return static_cast<std::uint32_t>(viewers_.size()); }
  std::uint64_t published() const { return published_; }
  /// Whether some viewer gets a frame as large as the newest one in full before the next frame comes. Judges
  /// a full level that isn't encoded yet by the finest coarse one.
  bool carriesWholeFrames() const;
  State state() const { return {phase_, viewerCount(), cause_}; }
  /// The bytes of superseded frames held for slow viewers.
  std::uint64_t heldBytes() const;

 private:
  friend class Viewer;
  void wakeAll();
  bool canSteer() const { return static_cast<bool>(options_.steer); }
  /// Ends the driver's control. If the driver has paused the simulation, lets it continue.
  void endDrive();
  std::set<std::shared_ptr<const EncodedLevel>> heldFor(const Viewer& viewer) const;
  void limitHeld(Clock::time_point now);

  Options options_;
  TokenCheck token_;
  std::string session_;
  Phase phase_ = Phase::Waiting;
  std::string cause_;
  FramePtr newest_;
  std::optional<Series> series_;
  std::uint64_t published_ = 0;
  std::set<Viewer*> viewers_;  // viewers that have been admitted
  std::uint32_t lastNumber_ = 0;
  std::optional<std::uint32_t> driver_;
  bool driverPaused_ = false;  // the driver has paused the simulation
  Controls controls_;
  std::uint64_t steeringVersion_ = 0;  // counts changes of the driver and of the controls
};

class Viewer {
 public:
  /// `wake` is called whenever next() may have something new. It must not throw, nor let a viewer leave. The
  /// hub outlives the viewer.
  Viewer(Hub& hub, std::function<void()> wake);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// Handles a text message from the viewer.
  void receive(std::string_view text, Clock::time_point now);
  /// Disconnects the viewer once it has been told the cause.
  void refuse(Close code, std::string cause);
  bool isWelcome() const { return isWelcome_; }
  /// Call when the viewer is gone; the hub forgets it.
  void leave() noexcept;
  /// Whether the viewer must be disconnected at once, even in the middle of a message.
  bool isStalled() const { return farewell_ && farewell_->code == Close::Stalled; }

  struct Binary {
    std::array<std::byte, chunkHeadBytes> head;
    std::shared_ptr<const EncodedLevel> level;  // keeps the bytes
    std::span<const std::byte> bytes;
  };
  struct Wait {
    std::optional<Clock::time_point> until;
  };
  struct Farewell {
    Close code;
    std::string cause;
  };
  /// A text message, a binary one, nothing for now, or the end.
  using Outgoing = std::variant<std::string, Binary, Wait, Farewell>;
  Outgoing next(Clock::time_point now);

 private:
  Outgoing ahead(Clock::time_point now);
  void take(const Hello& hello, Clock::time_point now);
  void take(const Ack& ack, Clock::time_point now);
  void take(const Show& wish, Clock::time_point now);
  void take(const Pause& pause, Clock::time_point now);
  void take(const Resume& resume, Clock::time_point now);
  void take(const Drive& drive, Clock::time_point now);
  void take(const Release& release, Clock::time_point now);
  void take(const Steer& steer, Clock::time_point now);
  void deny(std::string cause);
  std::optional<std::string> news();
  std::string announcement(const Outbox::LevelPart& part, Clock::time_point now) const;
  friend class Hub;
  void offer(const FramePtr& frame, Clock::time_point now);
  std::vector<std::shared_ptr<const EncodedLevel>> held() const;

  Hub& hub_;
  std::function<void()> wake_;
  Outbox outbox_;
  bool isWelcome_ = false;
  bool wasWelcomed_ = false;
  std::size_t seriesSent_ = 0;
  std::optional<State> stateSent_;
  Clock::time_point sentAt_;            // of the last message
  std::optional<std::uint32_t> shown_;  // of the series
  std::optional<Missing> missing_;
  std::uint32_t number_ = 0;  // from 1 in each session
  std::optional<std::uint64_t> steeringSent_;
  std::optional<Denied> denied_;
  std::optional<Outbox::LevelPart> announced_;
  std::weak_ptr<const EncodedLevel> inFlight_;  // of the binary message given out last
  std::optional<Farewell> farewell_;
  bool isCauseTold_ = false;
};

}  // namespace vdi::stream
