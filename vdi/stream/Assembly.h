// Puts the messages of a server together to whole levels. No network.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vdi/stream/ArrivingVdi.h"
#include "vdi/stream/Protocol.h"

namespace vdi::stream {

/// A whole level: a .vdi file that hasn't been looked at yet, or its VDI.
struct Received {
  Level level;
  std::vector<std::byte> file;  // empty if `vdi` is there instead
  std::optional<ArrivingVdi> vdi;
  std::string
      missing;  // why there is no file of a frame that was asked for; of `level`, only `frame` is set then
  std::string session;  // the session that the frame is from; Client sets it

  /// The level's VDI; call it once. Throws Error{Format} for a damaged one.
  Vdi decode();
};

/// Assembles the messages of one connection, in order. It takes memory for bytes that have come, not for
/// those that are announced.
class Assembly {
 public:
  enum class Gives { Files, Vdis };
  explicit Assembly(Gives gives = Gives::Files) : gives_(gives) {}
  /// Begins the next level, and drops the one before if it is incomplete. Throws Error{Format} if `level` has
  /// more than `mostBytes`.
  void begin(const Level& level, std::uint64_t mostBytes);
  /// Adds a binary message, and returns the level that it completes. Throws Error{Format} unless it is the
  /// next part of the level that was begun.
  std::optional<Received> add(std::span<const std::byte> message);
  /// Acknowledges what has come of the level under way.
  std::optional<Ack> progress() const;

 private:
  Gives gives_;
  std::optional<Level> level_;
  std::uint64_t bytes_ = 0;  // of it that have come
  std::vector<std::byte> file_;
  std::optional<ArrivingVdi> vdi_;
};

}  // namespace vdi::stream
