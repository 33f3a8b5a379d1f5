#include "vdi/stream/Outbox.h"

#include <algorithm>
#include <utility>

namespace vdi::stream {

namespace {

using Seconds = std::chrono::duration<double>;

constexpr std::uint64_t smallestWindow = std::uint64_t{1} << 20;
constexpr std::uint64_t largestWindow = std::uint64_t{16} << 20;
constexpr double windowSeconds = 0.2;
constexpr std::size_t ratesKept = 16;
constexpr double burstSeconds = 0.05;
constexpr double newPeriodShare = 0.3;
/// After this many periods without a frame, no newer one is expected.
constexpr double silentPeriods = 2.0;
/// The seconds that a frame's first picture may take in the finest of its coarse levels. A coarser level may
/// take patienceGrowth times as long, because an even coarser one would lose still more of the picture.
constexpr double coarsestPatience = 0.2;
constexpr double patienceGrowth = 2.5;
/// A level finer than the last frame's first one must take at most this share of those seconds.
/// Otherwise frames would alternate between sharp and coarse.
constexpr double finerShare = 0.8;

double secondsBetween(Clock::time_point from, Clock::time_point to) {
  return Seconds(to - from).count();
}

Clock::time_point after(Clock::time_point start, double seconds) {
  constexpr double longest = 3600.0;
  return start + std::chrono::ceil<Clock::duration>(Seconds(std::min(seconds, longest)));
}

}  // namespace

void Outbox::offer(FramePtr frame, Clock::time_point now) {
  if (isClosed_) return;
  if (newest_ && newest_->id == frame->id) {
    if (current_ == newest_) current_ = frame;
    newest_ = std::move(frame);
    release();
    return;
  }
  if (held().empty()) movedAt_ = now;
  if (newest_ != current_) ++dropped_;
  if (offeredAt_) {
    const double interval = secondsBetween(*offeredAt_, now);
    period_ = period_ == 0.0 ? interval : period_ + newPeriodShare * (interval - period_);
  }
  offeredAt_ = now;
  if (current_ && current_->id == frame->id) current_ = frame;
  newest_ = std::move(frame);
  release();
}

void Outbox::skip(FramePtr frame) {
  nextLevel_ = frame->levelCount;
  offset_ = frame->levels.back()->bytes.size();
  current_ = newest_ = std::move(frame);
  release();
}

void Outbox::release() {
  if (!current_) return;
  if (current_ != newest_) {
    if (!isFirstUnderWay()) {
      current_.reset();
    } else {
      Frame first = *current_;
      first.levels.resize(nextLevel_);
      std::fill_n(first.levels.begin(), firstLevel_, nullptr);
      current_ = std::make_shared<Frame>(std::move(first));
    }
  } else if (nextLevel_ == current_->levelCount && !isUnderWay() && !current_->levels.empty()) {
    Frame sent = *current_;  // later decisions need its identity, not its levels' bytes
    sent.levels.clear();
    current_ = newest_ = std::make_shared<Frame>(std::move(sent));
  }
}

std::vector<std::shared_ptr<const EncodedLevel>> Outbox::held() const {
  std::vector<std::shared_ptr<const EncodedLevel>> levels;
  if (newest_) levels = newest_->levels;
  if (current_ && current_ != newest_)
    levels.insert(levels.end(), current_->levels.begin(), current_->levels.end());
  levels.erase(std::remove(levels.begin(), levels.end(), nullptr), levels.end());
  return levels;
}

void Outbox::close() {
  isClosed_ = true;
  newest_.reset();
  current_.reset();
}

double Outbox::rate() const {
  const double measured = rates_.empty() ? 0.0 : *std::max_element(rates_.begin(), rates_.end());
  if (cap_ == 0.0 || measured == 0.0) return std::max(cap_, measured);
  return std::min(cap_, measured);
}

bool Outbox::fits(std::uint64_t bytes, double seconds) const {
  return period_ == 0.0 || rate() == 0.0 || static_cast<double>(bytes) <= rate() * seconds;
}

std::uint64_t Outbox::window() const {
  const double wished = std::min(rate() * windowSeconds, static_cast<double>(largestWindow));
  return std::max(smallestWindow, static_cast<std::uint64_t>(wished));
}

bool Outbox::isUnderWay() const {
  return current_ && nextLevel_ > 0 && nextLevel_ <= current_->levels.size() &&
         offset_ < current_->levels[nextLevel_ - 1]->bytes.size();
}

bool Outbox::isWorthBeginning(std::uint64_t bytes, Clock::time_point now,
                              std::optional<Clock::time_point>& retry) const {
  if (!offeredAt_ || fits(bytes, period_ - secondsBetween(*offeredAt_, now))) return true;
  const Clock::time_point silent = after(*offeredAt_, silentPeriods * period_);
  if (now >= silent) return true;
  retry = silent;
  return false;
}

std::uint32_t Outbox::firstLevelFor(const Frame& frame) const {
  const std::size_t coarse = std::min<std::size_t>(frame.levels.size(), std::max(frame.levelCount, 2U) - 1);
  if (rate() == 0.0) return 0;
  double seconds = coarsestPatience;
  auto level = static_cast<std::uint32_t>(coarse - 1);
  for (; level > 0; --level, seconds *= patienceGrowth) {
    const double most = level > firstLevel_ ? finerShare * seconds : seconds;
    if (static_cast<double>(frame.levels[level]->bytes.size()) <= most * rate()) break;
  }
  return level;
}

bool Outbox::begin(Clock::time_point now, std::optional<Clock::time_point>& retry) {
  if (isPaused_ || !newest_ || newest_->levels.empty()) return false;
  if (newest_ != current_) {
    current_ = newest_;
    firstLevel_ = nextLevel_ = firstLevelFor(*current_);
  } else if (nextLevel_ >= current_->levels.size() ||
             !isWorthBeginning(current_->levels[nextLevel_]->bytes.size(), now, retry)) {
    return false;
  }
  ++nextLevel_;
  offset_ = 0;
  return true;
}

Outbox::LevelPart Outbox::take(Clock::time_point now) {
  const std::uint32_t level = nextLevel_ - 1;
  const std::span<const std::byte> all(current_->levels[level]->bytes);
  const std::size_t count = std::min<std::size_t>(chunkBytes, all.size() - offset_);
  LevelPart part{current_, level, offset_, all.subspan(offset_, count)};
  offset_ += count;
  underWay_ += count;
  sent_.push_back({current_->id, level, offset_, count, now, delivered_});
  allowance_ -= static_cast<double>(count);
  release();
  return part;
}

Outbox::Next Outbox::next(Clock::time_point now) {
  Next result;
  if (underWay_ >= window()) return result;
  if (cap_ > 0.0) {
    const double burst = std::max(cap_ * burstSeconds, 1.0);
    const double earned = allowedAt_ ? cap_ * secondsBetween(*allowedAt_, now) : burst;
    allowance_ = std::min(allowance_ + earned, burst);
    allowedAt_ = now;
  }
  // A frame's first level goes on in any case. Otherwise a slow viewer would never see a whole frame.
  const bool goesOn = isUnderWay() && (newest_ == current_ || isFirstUnderWay());
  if (cap_ > 0.0 && allowance_ <= 0.0) {
    result.retry = after(now, -allowance_ / cap_ + 1e-4);
    return result;
  }
  if (goesOn || begin(now, result.retry)) result.part = take(now);
  return result;
}

void Outbox::acknowledge(const Ack& ack, Clock::time_point now) {
  const auto isCovered = [&ack](const Sent& sent) {
    return sent.frame == ack.frame && sent.level == ack.level && sent.end <= ack.bytes;
  };
  const auto last = std::find_if(sent_.rbegin(), sent_.rend(), isCovered);
  if (last == sent_.rend()) return;
  const Sent newest = *last;
  movedAt_ = now;
  for (auto sent = sent_.begin(); sent != last.base(); ++sent) {
    underWay_ -= sent->bytes;
    delivered_ += sent->bytes;
  }
  sent_.erase(sent_.begin(), last.base());
  const double seconds = std::max(secondsBetween(newest.at, now), 1e-6);
  rates_.push_back(static_cast<double>(delivered_ - newest.deliveredBefore) / seconds);
  if (rates_.size() > ratesKept) rates_.pop_front();
}

}  // namespace vdi::stream
