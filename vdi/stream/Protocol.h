// The messages between a server of VDIs and its viewers. docs/live.md has the byte map.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "vdi/stream/Steering.h"

namespace vdi::stream {

inline constexpr int protocolVersion = 1;
inline constexpr char subprotocol[] = "pv-vdi.1";
/// The most bytes of a viewer's message.
inline constexpr std::size_t maxViewerText = 4096;
/// The most bytes of a text message of the server.
inline constexpr std::size_t maxServerText = std::size_t{1} << 20;
/// The most bytes of a level in one binary message, where they follow the head.
inline constexpr std::size_t chunkBytes = std::size_t{256} << 10;
inline constexpr std::size_t chunkHeadBytes = 16;
/// A viewer acknowledges at least every ackBytes bytes of a level.
inline constexpr std::uint64_t ackBytes = std::uint64_t{512} << 10;
/// The most entries of a series in one message.
inline constexpr std::size_t seriesEntries = 4096;
/// A server repeats its state when a viewer has had no message for this time. Scripts in a page don't see the
/// pings that keep other viewers' connections alive.
inline constexpr std::chrono::seconds pulse{15};

/// The reason why a connection is closed: one of WebSocket's status codes, of which 4000 to 4999 are for
/// applications.
enum class Close : std::uint16_t {
  GoingAway = 1001,
  BadMessage = 4400,
  WrongToken = 4401,
  Late = 4408,
  OtherVersion = 4409,
  Stalled = 4410,
  TooMany = 4503,
};
/// As much of a cause in UTF-8 as a close frame has room for. Ends between characters, because browsers give
/// up a frame whose text isn't UTF-8.
std::string_view closeReason(std::string_view cause);

// Messages from a viewer.

struct Hello {
  int version = protocolVersion;
  std::string token;
  std::optional<std::string> session;  // of the server whose frames `have` counts
  std::optional<std::uint32_t> have;   // the newest frame that the viewer has
  bool operator==(const Hello&) const = default;
};
/// Acknowledges the first `bytes` bytes of a level.
struct Ack {
  std::uint32_t frame = 0;
  std::uint32_t level = 0;
  std::uint64_t bytes = 0;
  bool operator==(const Ack&) const = default;
};
/// Asks for one frame of a series, and stops other frames.
struct Show {
  std::uint32_t index = 0;
  bool operator==(const Show&) const = default;
};
struct Pause {
  bool operator==(const Pause&) const = default;
};
/// Asks for the newest frames again.
struct Resume {
  bool operator==(const Resume&) const = default;
};
/// Asks for control of the simulation, which one viewer has at a time.
struct Drive {
  bool operator==(const Drive&) const = default;
};
/// Gives control back.
struct Release {
  bool operator==(const Release&) const = default;
};
/// A wish of the viewer that drives.
struct Steer {
  Wish wish;
  bool operator==(const Steer&) const = default;
};
using FromViewer = std::variant<Hello, Ack, Show, Pause, Resume, Drive, Release, Steer>;

// Messages from the server.

/// The frames of a folder or of a list of files. Both vectors have an entry for each frame.
struct Series {
  std::vector<std::optional<double>> times;  // none: not finite
  std::vector<std::uint64_t> steps;
  std::size_t size() const { return steps.size(); }
  bool operator==(const Series&) const = default;
};
struct Welcome {
  int version = protocolVersion;
  std::string session;
  bool steer = false;
  std::optional<Series> series;
  std::uint32_t viewers = 0;
  std::uint32_t pulse = 0;  // seconds after which the state is repeated; 0: never (an older server)
  bool operator==(const Welcome&) const = default;
};
/// More of a series: its entries from `from` on.
struct SeriesPart {
  std::uint32_t from = 0;
  Series entries;
  bool operator==(const SeriesPart&) const = default;
};
enum class Phase { Waiting, Live, Ended };
const char* toString(Phase phase);  // "waiting", "live", "ended"
struct State {
  Phase phase = Phase::Waiting;
  std::uint32_t viewers = 0;
  std::string cause;  // why no frames come although they should; empty: nothing is wrong
  bool operator==(const State&) const = default;
};
/// Announces the level of the binary messages that follow.
struct Level {
  std::uint32_t frame = 0;
  std::uint32_t level = 0;
  std::uint32_t levels = 1;
  std::uint64_t bytes = 0;
  int width = 0;  // lists, margin included
  int height = 0;
  std::uint64_t step = 0;
  std::optional<double> time;  // none: not finite
  double age = 0.0;            // seconds since the VDI was made
  std::uint64_t dropped = 0;   // frames of which this viewer got nothing
  bool operator==(const Level&) const = default;
};
/// Tells a viewer that a frame that it asked for isn't available.
struct Missing {
  std::uint32_t frame = 0;
  std::string cause;
  bool operator==(const Missing&) const = default;
};
/// The state of steering. It is sent where steering is allowed, at the beginning and after each change.
struct Steering {
  std::uint32_t you = 0;                // the viewer's number
  std::optional<std::uint32_t> driver;  // the driving viewer's number
  Controls controls;
  bool operator==(const Steering&) const = default;
};
/// Tells a viewer that its request is denied.
struct Denied {
  std::string cause;
  bool operator==(const Denied&) const = default;
};
/// Gives the reason before the server closes the connection.
struct Refusal {
  std::string cause;
  bool operator==(const Refusal&) const = default;
};
/// A message of a newer server, of a type that this program doesn't know.
struct Unknown {
  bool operator==(const Unknown&) const = default;
};
using FromServer =
    std::variant<Welcome, SeriesPart, State, Level, Missing, Steering, Denied, Refusal, Unknown>;

std::string textOf(const FromViewer& message);
std::string textOf(const FromServer& message);
/// Parse a message, and skip unknown fields. Throw Error{Format} unless the text is one JSON object with the
/// fields that its type needs, of the right kinds and within their bounds, and nested no more deeply than
/// messages are. A viewer's message must also be of a known type.
FromViewer viewerMessage(std::string_view text);
FromServer serverMessage(std::string_view text);

/// A part of a level, which `bytes` refers to.
struct Chunk {
  std::uint32_t frame = 0;
  std::uint32_t level = 0;
  std::uint64_t offset = 0;
  std::span<const std::byte> bytes;
};
/// The head, which precedes the chunk's bytes.
std::array<std::byte, chunkHeadBytes> chunkHead(const Chunk& chunk);
/// The chunk in a message. Throws Error{Format} unless 1 to chunkBytes bytes follow a whole head.
Chunk chunkIn(std::span<const std::byte> message);

}  // namespace vdi::stream
