// Tests the cost of viewers that take their frames slowly or not at all, without a network. The test turns
// the clock.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/Catch.h"
#include "vdi/stream/Viewer.h"

using namespace vdi::stream;

namespace {

using namespace std::chrono_literals;

constexpr std::size_t mebibyte = std::size_t{1} << 20;
constexpr std::size_t coarseBytes = 3 * mebibyte;
constexpr std::size_t fullBytes = 20 * mebibyte;
const std::string token(32, 't');
const Clock::time_point start = Clock::time_point(1000s);

/// Counts the bytes of the levels that are still referenced.
class Levels {
 public:
  FramePtr frame(std::uint32_t id) {
    auto made = std::make_shared<Frame>();
    made->id = id;
    made->levelCount = 2;
    for (const std::size_t bytes : {coarseBytes, fullBytes}) {
      made->levels.push_back(
          std::make_shared<EncodedLevel>(EncodedLevel{std::vector<std::byte>(bytes), 1, 1}));
      all_.push_back(made->levels.back());
    }
    return made;
  }
  std::size_t bytesAlive() const {
    std::size_t bytes = 0;
    for (const auto& weak : all_) {
      if (const auto level = weak.lock()) bytes += level->bytes.size();
    }
    return bytes;
  }

 private:
  std::vector<std::weak_ptr<const EncodedLevel>> all_;
};

Hub::Options limited(std::uint64_t bytes) {
  Hub::Options options;
  options.token = token;
  options.mostViewers = 1000;
  options.mostHeldBytes = bytes;
  return options;
}

/// A viewer and the network to it, which holds the message that is being written.
struct Connected {
  explicit Connected(Hub& hub, Clock::time_point now = start) : viewer(hub, [] {}) {
    Hello hello;
    hello.token = token;
    viewer.receive(textOf(FromViewer(hello)), now);
  }
  /// The next part of a level, which stays on its way until the next call; none: there is nothing to send.
  std::optional<Chunk> part(Clock::time_point now) {
    for (;;) {
      writing = viewer.next(now);
      if (const auto* const text = std::get_if<std::string>(&writing)) {
        const FromServer news = serverMessage(*text);
        if (const auto* const level = std::get_if<Level>(&news)) announced = *level;
      } else if (const auto* const binary = std::get_if<Viewer::Binary>(&writing)) {
        message.assign(binary->head.begin(), binary->head.end());
        message.insert(message.end(), binary->bytes.begin(), binary->bytes.end());
        return chunkIn(message);
      } else {
        return std::nullopt;
      }
    }
  }
  /// Takes the coarse level, and stalls in the full one.
  void stall(Clock::time_point now) {
    for (auto chunk = part(now); chunk && chunk->level == 0; chunk = part(now)) acknowledge(*chunk, now);
    REQUIRE(std::holds_alternative<Viewer::Binary>(writing));
  }
  void acknowledge(const Chunk& chunk, Clock::time_point now) {
    taken += chunk.bytes.size();
    viewer.receive(textOf(FromViewer(Ack{chunk.frame, chunk.level, chunk.offset + chunk.bytes.size()})), now);
  }
  /// Takes all that it gets, and acknowledges it.
  void takeAll(Clock::time_point now) {
    while (const auto chunk = part(now)) acknowledge(*chunk, now);
  }

  Viewer viewer;
  Viewer::Outgoing writing;
  std::vector<std::byte> message;
  Level announced;
  std::size_t taken = 0;
};

}  // namespace

TEST_CASE("a viewer that has taken a frame keeps nothing of it") {
  Levels levels;
  Hub hub(limited(1000 * mebibyte));
  Connected viewer(hub);
  for (std::uint32_t id = 0; id < 5; ++id) {
    hub.publish(levels.frame(id), start + id * 1s);
    viewer.takeAll(start + id * 1s);
    CHECK(levels.bytesAlive() == coarseBytes + fullBytes);
    CHECK(hub.heldBytes() == 0);
  }
  CHECK(viewer.taken == 5 * (coarseBytes + fullBytes));
  CHECK(viewer.announced.dropped == 0);
}

TEST_CASE("a viewer that stalls in a full level keeps it no longer than it's the newest") {
  Levels levels;
  Hub hub(limited(1000 * mebibyte));
  Connected viewer(hub);
  hub.publish(levels.frame(0), start);
  viewer.stall(start);
  hub.publish(levels.frame(1), start + 1s);
  CHECK(hub.heldBytes() == fullBytes);  // a part of it is being written
  viewer.writing = Viewer::Wait{};
  CHECK(hub.heldBytes() == 0);
  CHECK(levels.bytesAlive() == coarseBytes + fullBytes);
}

TEST_CASE("a refused viewer that stalls in a level goes when its frames are too many") {
  Levels levels;
  Hub hub(limited(10 * mebibyte));
  Connected viewer(hub);
  hub.publish(levels.frame(0), start);
  viewer.stall(start);
  viewer.viewer.receive("no message", start);
  CHECK(!viewer.viewer.isStalled());
  hub.publish(levels.frame(1), start + 1s);
  CHECK(viewer.viewer.isStalled());
  CHECK(hub.heldBytes() == 0);
}

TEST_CASE("what stalled viewers keep is bounded, and the oldest goes first") {
  constexpr std::size_t limit = 10 * mebibyte;
  Levels levels;
  std::vector<std::string> lines;
  Hub::Options options = limited(limit);
  options.log = [&lines](const std::string& line) { lines.push_back(line); };
  Hub hub(options);
  Connected good(hub);
  std::vector<std::unique_ptr<Connected>> stalled;
  for (std::uint32_t id = 0; id < 40; ++id) {
    const Clock::time_point now = start + id * 1s;
    hub.publish(levels.frame(id), now);
    // A server ends the writes of viewers that it disconnects.
    for (const auto& viewer : stalled) {
      if (viewer->viewer.isStalled()) viewer->writing = Viewer::Wait{};
    }
    CHECK(hub.heldBytes() <= limit);
    CHECK(levels.bytesAlive() <= limit + coarseBytes + fullBytes);
    stalled.push_back(std::make_unique<Connected>(hub, now));
    REQUIRE(stalled.back()->part(now));  // this part never arrives
    good.takeAll(now);
  }
  CHECK_FALSE(good.viewer.isStalled());
  CHECK(good.taken == 40 * (coarseBytes + fullBytes));
  // Three coarse levels are within the limit, in addition to the newest frame's.
  const auto left = std::count_if(stalled.begin(), stalled.end(),
                                  [](const auto& viewer) { return !viewer->viewer.isStalled(); });
  CHECK(left == 4);
  for (std::size_t i = 0; i < stalled.size(); ++i) CHECK(stalled[i]->viewer.isStalled() == (i < 36));
  CHECK(lines.size() == 36);
  CHECK(lines.front().find("took nothing for") != std::string::npos);

  // The viewer gets the reason, and is then disconnected.
  Viewer& first = stalled.front()->viewer;
  const Viewer::Outgoing reason = first.next(start + 100s);
  REQUIRE(std::holds_alternative<std::string>(reason));
  CHECK(serverMessage(std::get<std::string>(reason)) == FromServer(Refusal{lines.front()}));
  const Viewer::Outgoing end = first.next(start + 100s);
  REQUIRE(std::holds_alternative<Viewer::Farewell>(end));
  CHECK(std::get<Viewer::Farewell>(end).code == Close::Stalled);
}

TEST_CASE("a viewer for whom nothing is new hears the state at each pulse") {
  Levels levels;
  Hub hub(limited(1000 * mebibyte));
  Connected viewer(hub);
  hub.publish(levels.frame(0), start);
  const Viewer::Outgoing first = viewer.viewer.next(start);
  REQUIRE(std::holds_alternative<std::string>(first));
  const FromServer welcome = serverMessage(std::get<std::string>(first));
  REQUIRE(std::holds_alternative<Welcome>(welcome));
  CHECK(std::get<Welcome>(welcome).pulse == 15);
  viewer.takeAll(start + 5s);
  for (const auto seconds : {20s, 35s}) {
    const Viewer::Outgoing nothing = viewer.viewer.next(start + seconds - 1ms);
    REQUIRE(std::holds_alternative<Viewer::Wait>(nothing));
    CHECK(std::get<Viewer::Wait>(nothing).until == start + seconds);
    const Viewer::Outgoing again = viewer.viewer.next(start + seconds);
    REQUIRE(std::holds_alternative<std::string>(again));
    CHECK(serverMessage(std::get<std::string>(again)) == FromServer(State{Phase::Live, 1, {}}));
  }
}

TEST_CASE("a series of any length comes in parts") {
  Hub hub(limited(mebibyte));
  Series series;
  series.times.resize(2 * seriesEntries + 5);
  series.steps.resize(series.times.size());
  hub.append(series);
  Connected viewer(hub);
  std::vector<std::size_t> parts;
  for (;;) {
    const Viewer::Outgoing next = viewer.viewer.next(start);
    const auto* const text = std::get_if<std::string>(&next);
    if (text == nullptr) break;
    const FromServer news = serverMessage(*text);
    if (const auto* const welcome = std::get_if<Welcome>(&news)) parts.push_back(welcome->series->size());
    const auto* const part = std::get_if<SeriesPart>(&news);
    if (part == nullptr) continue;
    CHECK(part->from == parts.size() * seriesEntries);
    parts.push_back(part->entries.size());
  }
  CHECK(parts == std::vector<std::size_t>{seriesEntries, seriesEntries, 5});
}

TEST_CASE("those who look at different frames of a series are within the bound too") {
  Levels levels;
  Hub::Options options = limited(30 * mebibyte);
  options.show = [](std::uint32_t) {};
  Hub hub(options);
  Series series;
  series.times.resize(10);
  series.steps.resize(10);
  hub.append(series);
  std::vector<std::unique_ptr<Connected>> viewers;
  for (std::uint32_t id = 0; id < 10; ++id) {
    const Clock::time_point now = start + id * 1s;
    viewers.push_back(std::make_unique<Connected>(hub, now));
    viewers.back()->viewer.receive(textOf(FromViewer(Show{id})), now);
    hub.provide(levels.frame(id), now);
    viewers.back()->takeAll(now);
    CHECK(levels.bytesAlive() == 0);  // all is sent
    CHECK_FALSE(viewers.back()->viewer.isStalled());
  }
}

TEST_CASE("a line carries whole frames while they take less time than the simulation") {
  const double mebibytesPerSecond = GENERATE(10.0, 30.0);
  Hub::Options options = limited(1000 * mebibyte);
  options.mostBytesPerSecond = mebibytesPerSecond * mebibyte;
  Levels levels;
  Hub hub(std::move(options));
  CHECK(hub.carriesWholeFrames());  // as far as known
  hub.publish(levels.frame(0), start);
  CHECK_FALSE(hub.carriesWholeFrames());  // nobody looks
  Connected viewer(hub);
  CHECK(hub.carriesWholeFrames());
  for (std::uint32_t id = 1; id < 5; ++id) {
    const Clock::time_point now = start + id * 1s;
    const FramePtr frame = levels.frame(id);
    Frame coarse = *frame;
    coarse.levels.pop_back();
    hub.publish(std::make_shared<Frame>(coarse), now);
    // 27 MiB, by the coarse level of 3 MiB.
    if (id > 1) CHECK(hub.carriesWholeFrames() == (mebibytesPerSecond > 27.0));
    hub.publish(frame, now);
    viewer.takeAll(now);
  }
  CHECK(hub.carriesWholeFrames() == (mebibytesPerSecond > 20.0));
}
