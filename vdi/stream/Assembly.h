// Assembles whole levels from a server's messages. Uses no network.
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

/// A whole level: a .vdi file that hasn't been checked yet, or its VDI.
struct Received {
  Level level;
  std::vector<std::byte> file;  // empty if `vdi` has a value instead
  std::optional<ArrivingVdi> vdi;
  std::string missing;  // why a requested frame has no file; only level.frame is set then
  std::string session;  // the frame's session, set by Client

  /// The level's VDI; call it once. Throws Error{Format} for a damaged one.
  Vdi decode();
};

/// Assembles the messages of one connection, in order. Allocates memory for bytes that have
/// arrived, not for announced ones.
class Assembly {
 public:
  enum class Gives { Files, Vdis };
  explicit Assembly(Gives gives = Gives::Files) : gives_(gives) {}
  /// Begins the next level, and drops the previous one if it is incomplete. Throws Error{Format} if `level`
  /// has more than `mostBytes`.
  void begin(const Level& level, std::uint64_t mostBytes);
  /// Adds a binary message, and returns the level that it completes. Throws Error{Format} unless it is the
  /// next part of the level that was begun.
  std::optional<Received> add(std::span<const std::byte> message);
  /// The acknowledgement of the bytes so far of the level under way.
  std::optional<Ack> progress() const;

 private:
  Gives gives_;
  std::optional<Level> level_;
  std::uint64_t bytes_ = 0;  // of the level that have come
  std::vector<std::byte> file_;
  std::optional<ArrivingVdi> vdi_;
};

}  // namespace vdi::stream
