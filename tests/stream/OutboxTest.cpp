// Tests which levels a viewer gets, and when, without a network. The test turns the clock.
#include <algorithm>
#include <map>

#include "tests/Catch.h"
#include "vdi/stream/Outbox.h"

using namespace vdi::stream;

namespace {

using namespace std::chrono_literals;

constexpr std::size_t mebibyte = std::size_t{1} << 20;

FramePtr frameOf(std::uint32_t id, const std::vector<std::size_t>& bytes, std::uint32_t levels) {
  auto frame = std::make_shared<Frame>();
  frame->id = id;
  frame->levelCount = levels;
  for (const std::size_t size : bytes)
    frame->levels.push_back(std::make_shared<EncodedLevel>(EncodedLevel{std::vector<std::byte>(size), 1, 1}));
  return frame;
}

/// A viewer on a line of `bytesPerSecond`. It acknowledges all that it gets.
class Line {
 public:
  Line(Outbox& outbox, double bytesPerSecond) : outbox_(outbox), rate_(bytesPerSecond) {}

  /// Simulates the line from one time to another.
  void run(Clock::time_point from, Clock::time_point until) {
    for (Clock::time_point now = from; now < until; now += 1ms) {
      while (!arriving_.empty() && arriving_.front().at <= now) {
        outbox_.acknowledge(arriving_.front().ack, now);
        arriving_.erase(arriving_.begin());
      }
      while (const auto part = outbox_.next(now).part) {
        busyUntil_ = std::max(busyUntil_, now) +
                     std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(static_cast<double>(part->bytes.size()) / rate_));
        arriving_.push_back({busyUntil_, {part->frame->id, part->level, part->offset + part->bytes.size()}});
        bytes_[{part->frame->id, part->level}] += part->bytes.size();
        largest_ = std::max(largest_, outbox_.underWay());
      }
    }
  }
  /// The number of a level's bytes that were sent.
  std::size_t sent(std::uint32_t frame, std::uint32_t level) { return bytes_[{frame, level}]; }
  std::uint64_t mostUnderWay() const { return largest_; }

 private:
  struct Arriving {
    Clock::time_point at;
    Ack ack;
  };
  Outbox& outbox_;
  double rate_;
  Clock::time_point busyUntil_;
  std::vector<Arriving> arriving_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> bytes_;
  std::uint64_t largest_ = 0;
};

const Clock::time_point start = Clock::time_point(1000s);

}  // namespace

TEST_CASE("parts make up the levels, the coarse one first") {
  Outbox outbox(0.0);
  const std::size_t coarse = 300000;
  const std::size_t fine = 900000;
  outbox.offer(frameOf(4, {coarse, fine}, 2), start);
  std::uint32_t level = 0;
  std::uint64_t offset = 0;
  while (const auto part = outbox.next(start).part) {
    if (part->level != level) {
      CHECK(offset == coarse);
      level = part->level;
      offset = 0;
    }
    CHECK(part->frame->id == 4);
    CHECK(part->offset == offset);
    CHECK(part->bytes.data() == part->frame->levels[level]->bytes.data() + offset);
    CHECK(part->bytes.size() <= chunkBytes);
    offset += part->bytes.size();
    outbox.acknowledge({4, level, offset}, start + 1ms);
  }
  CHECK(level == 1);
  CHECK(offset == fine);
  CHECK(outbox.underWay() == 0);
}

TEST_CASE("a viewer that acknowledges nothing gets a window, then the newest") {
  Outbox outbox(0.0);
  std::uint64_t sent = 0;
  for (std::uint32_t id = 0; id < 10; ++id) {
    outbox.offer(frameOf(id, {mebibyte, 9 * mebibyte}, 2), start + id * 100ms);
    while (const auto part = outbox.next(start + id * 100ms).part) sent += part->bytes.size();
  }
  CHECK(sent == outbox.window());
  CHECK(outbox.underWay() == sent);
  CHECK(outbox.dropped() == 8);  // all but the first, which arrived, and the newest
  // Acknowledgements of bytes that weren't sent free nothing.
  outbox.acknowledge({3, 0, mebibyte}, start + 2s);
  outbox.acknowledge({0, 1, mebibyte}, start + 2s);
  outbox.acknowledge({0, 0, 5}, start + 2s);
  CHECK(outbox.underWay() == sent);
  outbox.acknowledge({0, 0, mebibyte}, start + 2s);
  outbox.acknowledge({0, 0, mebibyte}, start + 2s);  // again
  CHECK(outbox.underWay() == 0);
  const auto part = outbox.next(start + 2s).part;
  REQUIRE(part);
  CHECK(part->frame->id == 9);
  CHECK(part->offset == 0);
}

TEST_CASE("a newer frame ends a fine level, and waits for a coarse one") {
  Outbox outbox(0.0);
  outbox.offer(frameOf(0, {4 * chunkBytes, 4 * chunkBytes}, 2), start);
  CHECK(outbox.next(start).part);
  outbox.offer(frameOf(1, {chunkBytes, 3 * chunkBytes}, 2), start + 1s);
  for (int i = 0; i < 3; ++i) CHECK(outbox.next(start + 1s).part->frame->id == 0);
  outbox.acknowledge({0, 0, 4 * chunkBytes}, start + 1s);
  CHECK(outbox.next(start + 1s).part->frame->id == 1);
  CHECK(outbox.next(start + 1s).part->level == 1);
  outbox.offer(frameOf(2, {chunkBytes}, 2), start + 2s);  // the fine level isn't encoded yet
  const auto part = outbox.next(start + 2s).part;
  CHECK(part->frame->id == 2);
  outbox.acknowledge({2, 0, chunkBytes}, start + 2s);
  CHECK_FALSE(outbox.next(start + 2s).part);
  outbox.offer(frameOf(2, {chunkBytes, chunkBytes}, 2), start + 2s + 1ms);
  CHECK(outbox.next(start + 2s + 1ms).part->level == 1);
  CHECK(outbox.dropped() == 0);
}

TEST_CASE("a slow line carries coarse levels while frames come, and the fine one afterwards") {
  Outbox outbox(0.0);
  const double rate = 2.0 * mebibyte;
  Line line(outbox, rate);
  Clock::time_point now = start;
  const std::uint32_t frames = 20;
  for (std::uint32_t id = 0; id < frames; ++id, now += 500ms) {
    outbox.offer(frameOf(id, {mebibyte / 2, 4 * mebibyte}, 2), now);
    line.run(now, now + 500ms);
  }
  std::size_t coarse = 0;
  for (std::uint32_t id = 2; id < frames; ++id) coarse += line.sent(id, 0) == mebibyte / 2 ? 1 : 0;
  CHECK(coarse == frames - 2);
  std::size_t wasted = 0;
  for (std::uint32_t id = 4; id + 1 < frames; ++id) wasted += line.sent(id, 1);
  CHECK(wasted == 0);
  CHECK(outbox.rate() == Approx(rate).epsilon(0.3));
  CHECK(line.mostUnderWay() < mebibyte + chunkBytes);
  line.run(now, now + 10s);
  CHECK(line.sent(frames - 1, 1) == 4 * mebibyte);
}

TEST_CASE("a viewer slower than the frames sees whole ones") {
  Outbox outbox(0.0);
  Line line(outbox, 1.0 * mebibyte);  // three frames' time for a coarse level
  Clock::time_point now = start;
  std::uint32_t id = 0;
  for (; id < 60; ++id, now += 100ms) {
    outbox.offer(frameOf(id, {3 * mebibyte / 10, 2 * mebibyte}, 2), now);
    line.run(now, now + 100ms);
  }
  std::uint32_t whole = 0;
  for (std::uint32_t i = 0; i < id; ++i) whole += line.sent(i, 0) == 3 * mebibyte / 10 ? 1 : 0;
  CHECK(whole >= 15);
  CHECK(outbox.dropped() >= 30);
}

namespace {

/// Offers frames of four levels for 20 s over a line, and returns how many were sent whole from each level
/// on.
std::map<std::uint32_t, int> firstLevels(double bytesPerSecond, double limit, Clock::duration period) {
  const std::vector<std::size_t> sizes{mebibyte, 3 * mebibyte, 9 * mebibyte, 80 * mebibyte};
  const FramePtr first = frameOf(0, sizes, 4);
  Outbox outbox(limit);
  Line line(outbox, bytesPerSecond);
  Clock::time_point now = start;
  std::uint32_t id = 0;
  for (; now < start + 20s; ++id, now += period) {
    auto frame = std::make_shared<Frame>(*first);
    frame->id = id;
    outbox.offer(std::move(frame), now);
    line.run(now, now + period);
  }
  std::map<std::uint32_t, int> counts;
  for (std::uint32_t frame = id / 4; frame < id; ++frame) {
    std::uint32_t level = 0;
    while (level < 4 && line.sent(frame, level) == 0) ++level;
    if (level < 4 && line.sent(frame, level) == sizes[level]) ++counts[level];
  }
  return counts;
}

}  // namespace

TEST_CASE("a line's rate decides with which level frames begin") {
  const double megabit = 1e6 / 8.0;
  const auto [rate, level, frames] = GENERATE_COPY(table<double, std::uint32_t, int>({
      {5.0 * megabit, 0, 5},      // 1.7 s for the coarsest level, the only one that viewers get
      {20.0 * megabit, 0, 25},    // .4 s; 1.3 s for the next one
      {100.0 * megabit, 1, 40},   // .25 s
      {1000.0 * megabit, 2, 90},  // .075 s
      {9000.0 * megabit, 2, 90},  // never the whole VDI
  }));
  INFO(rate / megabit << " Mbit/s");
  for (const bool isLimit : {false, true}) {
    const auto counts = isLimit ? firstLevels(1e10, rate, 100ms) : firstLevels(rate, 0.0, 100ms);
    REQUIRE(counts.size() == 1);
    CHECK(counts.begin()->first == level);
    CHECK(counts.begin()->second >= frames);
  }
}

TEST_CASE("a rate that sways by a tenth doesn't change the level") {
  Outbox outbox(0.0);
  std::map<std::uint32_t, int> counts;
  Clock::time_point now = start;
  for (std::uint32_t id = 0; id < 200; ++id, now += 1s) {
    const double rate = (id % 2 == 0 ? 0.95 : 1.05) * 5.0 * mebibyte;  // a second level takes about .2 s
    outbox.offer(frameOf(id, {mebibyte / 5, mebibyte, 5 * mebibyte}, 3), now);
    Line line(outbox, rate);
    line.run(now, now + 900ms);
    if (id >= 20) ++counts[line.sent(id, 0) > 0 ? 0 : 1];
  }
  CHECK(counts.size() == 1);
}

TEST_CASE("a finer level begins only where it ends before the next frame comes") {
  Outbox outbox(0.0);
  Line line(outbox, 10.0 * mebibyte);
  Clock::time_point now = start;
  std::size_t wasted = 0;
  std::size_t finer = 0;
  for (std::uint32_t id = 0; id < 20; ++id, now += 500ms) {
    outbox.offer(frameOf(id, {2 * mebibyte, 5 * mebibyte / 2, 4 * mebibyte}, 3), now);
    line.run(now, now + 500ms);
    if (id < 3) continue;
    finer += line.sent(id, 1) == 5 * mebibyte / 2 ? 1 : 0;
    wasted += line.sent(id, 2);
  }
  CHECK(finer == 17);
  CHECK(wasted == 0);
  line.run(now, now + 10s);
  CHECK(line.sent(19, 2) == 4 * mebibyte);
}

TEST_CASE("a limit is kept") {
  const double limit = 1e6;
  Outbox outbox(limit);
  Line line(outbox, 1e9);
  outbox.offer(frameOf(0, {10 * mebibyte}, 1), start);
  line.run(start, start + 4s);
  CHECK(static_cast<double>(line.sent(0, 0)) < 4.0 * limit + 2.0 * chunkBytes);
  CHECK(static_cast<double>(line.sent(0, 0)) > 3.5 * limit);
  CHECK(outbox.rate() <= limit);
  // The outbox says when to ask again.
  Outbox::Next next = outbox.next(start + 4s);
  while (next.part) next = outbox.next(start + 4s);
  REQUIRE(next.retry);
  CHECK(*next.retry > start + 4s);
  CHECK(*next.retry < start + 5s);
}

TEST_CASE("pause and skip") {
  Outbox outbox(0.0);
  outbox.pause(true);
  outbox.offer(frameOf(0, {10}, 1), start);
  CHECK_FALSE(outbox.next(start).part);
  outbox.offer(frameOf(1, {10}, 1), start + 1s);
  outbox.pause(false);
  CHECK(outbox.next(start + 1s).part->frame->id == 1);
  Outbox knows(0.0);
  knows.skip(frameOf(5, {10}, 1));
  CHECK_FALSE(knows.next(start).part);
  knows.offer(frameOf(6, {10}, 1), start);
  CHECK(knows.next(start).part->frame->id == 6);
}
