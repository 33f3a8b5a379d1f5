// Decides what one viewer gets next. Newer frames take the place of older ones. A viewer's acknowledgements
// decide how much may be under way to it, and with which level a frame begins. Uses no network.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "vdi/stream/Frame.h"
#include "vdi/stream/Protocol.h"

namespace vdi::stream {

class Outbox {
 public:
  /// `mostBytesPerSecond`: 0 for no limit.
  explicit Outbox(double mostBytesPerSecond) : cap_(mostBytesPerSecond) {}

  /// Offers a frame to show next, or more levels of the frame that was offered last. Drops an earlier frame
  /// that hasn't been begun.
  void offer(FramePtr frame, Clock::time_point now);
  /// Notes that the viewer already has all of `frame`.
  void skip(FramePtr frame);
  /// While paused, next() begins no level. A level under way continues.
  void pause(bool paused) { isPaused_ = paused; }

  /// A part of a level; at offset 0 the level begins.
  struct LevelPart {
    FramePtr frame;
    std::uint32_t level = 0;
    std::uint64_t offset = 0;
    std::span<const std::byte> bytes;  // of the frame; at most chunkBytes
  };
  struct Next {
    std::optional<LevelPart> part;           // to be sent now
    std::optional<Clock::time_point> retry;  // without a part: when to ask again, if nothing happens before
  };
  /// Decides what to send now. The returned part counts as sent.
  Next next(Clock::time_point now);
  /// Notes an acknowledgement. Ignores one of bytes that weren't sent, or were acknowledged before.
  void acknowledge(const Ack& ack, Clock::time_point now);

  /// Frames of which the viewer got nothing.
  std::uint64_t dropped() const { return dropped_; }
  /// The bytes per second that the viewer takes, estimated from acknowledgements and the limit; 0: unknown.
  double rate() const;
  /// Whether that many bytes fit between two frames, as far as the outbox knows.
  bool isFastEnoughFor(std::uint64_t bytes) const { return fits(bytes, period_); }
  /// Bytes sent and not acknowledged.
  std::uint64_t underWay() const { return underWay_; }
  /// Bytes that may be under way.
  std::uint64_t window() const;

  /// The levels that are kept because they are, or may be, still to be sent.
  std::vector<std::shared_ptr<const EncodedLevel>> held() const;
  /// The time when the viewer last acknowledged something, or got an offer while nothing was held for it.
  Clock::time_point movedAt() const { return movedAt_; }
  /// Releases all frames. Afterwards, next() gives nothing.
  void close();

 private:
  struct Sent {
    std::uint32_t frame;
    std::uint32_t level;
    std::uint64_t end;  // of the part in its level
    std::uint64_t bytes;
    Clock::time_point at;
    std::uint64_t deliveredBefore;
  };
  bool isUnderWay() const;
  bool isFirstUnderWay() const { return isUnderWay() && nextLevel_ == firstLevel_ + 1; }
  /// Turns to the level to begin now. Returns false if there is none, or none before the time in `retry`.
  bool begin(Clock::time_point now, std::optional<Clock::time_point>& retry);
  /// The level with which the frame begins for this viewer.
  std::uint32_t firstLevelFor(const Frame& frame) const;
  /// Whether that many bytes take at most that long, as far as is known.
  bool fits(std::uint64_t bytes, double seconds) const;
  bool isWorthBeginning(std::uint64_t bytes, Clock::time_point now,
                        std::optional<Clock::time_point>& retry) const;
  LevelPart take(Clock::time_point now);
  void release();

  double cap_;
  double allowance_ = 0.0;  // bytes that the limit allows now; may be negative
  std::optional<Clock::time_point> allowedAt_;
  bool isPaused_ = false;
  bool isClosed_ = false;
  Clock::time_point movedAt_;

  FramePtr newest_;  // offered last
  FramePtr current_;
  std::uint32_t firstLevel_ = 0;  // with which current_, or the previous frame, began
  std::uint32_t nextLevel_ = 0;   // of current_: the one to begin; the previous one may be under way
  std::uint64_t offset_ = 0;      // in the level before nextLevel_
  std::uint64_t dropped_ = 0;
  std::optional<Clock::time_point> offeredAt_;
  double period_ = 0.0;  // seconds between frames; 0: unknown

  std::deque<Sent> sent_;
  std::uint64_t underWay_ = 0;
  std::uint64_t delivered_ = 0;
  std::deque<double> rates_;  // of the last acknowledgements
};

}  // namespace vdi::stream
