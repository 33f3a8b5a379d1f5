#include "vdi/stream/Viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::stream {

namespace {

Series partOf(const Series& series, std::size_t from) {
  const auto first = static_cast<std::ptrdiff_t>(from);
  const auto last = static_cast<std::ptrdiff_t>(std::min(series.size(), from + seriesEntries));
  return {{series.times.begin() + first, series.times.begin() + last},
          {series.steps.begin() + first, series.steps.begin() + last}};
}

}  // namespace

Hub::Hub(Options options) : options_(std::move(options)), token_(options_.token), session_(randomToken()) {
  options_.token.clear();
}

void Hub::wakeAll() {
  for (Viewer* const viewer : viewers_) viewer->wake_();
}

void Hub::publish(FramePtr frame, Clock::time_point now) {
  if (!newest_ || newest_->id != frame->id) ++published_;
  newest_ = std::move(frame);
  if (phase_ == Phase::Waiting && cause_.empty()) phase_ = Phase::Live;
  for (Viewer* const viewer : viewers_) {
    if (!viewer->shown_) viewer->offer(newest_, now);
  }
  limitHeld(now);
  wakeAll();
}

bool Hub::carriesWholeFrames() const {
  if (!newest_ || newest_->levels.empty()) return true;
  constexpr std::uint64_t listsForOne = std::uint64_t{coarseFactors.back()} * coarseFactors.back();
  std::uint64_t bytes = newest_->levels.back()->bytes.size();
  if (newest_->levels.size() < newest_->levelCount) bytes *= listsForOne;
  return std::any_of(viewers_.begin(), viewers_.end(),
                     [bytes](const Viewer* viewer) { return viewer->outbox_.isFastEnoughFor(bytes); });
}

void Hub::provide(const FramePtr& frame, Clock::time_point now) {
  for (Viewer* const viewer : viewers_) {
    if (viewer->shown_ == frame->id) viewer->offer(frame, now);
  }
  limitHeld(now);
}

std::set<std::shared_ptr<const EncodedLevel>> Hub::heldFor(const Viewer& viewer) const {
  std::set<std::shared_ptr<const EncodedLevel>> levels;
  if (viewer.isStalled()) return levels;  // it is about to be disconnected
  for (const auto& level : viewer.held()) levels.insert(level);
  if (newest_) {
    for (const auto& level : newest_->levels) levels.erase(level);
  }
  return levels;
}

std::uint64_t Hub::heldBytes() const {
  std::set<std::shared_ptr<const EncodedLevel>> levels;
  for (const Viewer* const viewer : viewers_) levels.merge(heldFor(*viewer));
  std::uint64_t bytes = 0;
  for (const auto& level : levels) bytes += level->bytes.size();
  return bytes;
}

/// Disconnects viewers until the frames held for them fit, first the one that has taken nothing for longest.
void Hub::limitHeld(Clock::time_point now) {
  while (heldBytes() > options_.mostHeldBytes) {
    Viewer* oldest = nullptr;
    for (Viewer* const viewer : viewers_) {
      if (heldFor(*viewer).empty()) continue;
      if (oldest == nullptr || viewer->outbox_.movedAt() < oldest->outbox_.movedAt()) oldest = viewer;
    }
    const double seconds = std::chrono::duration<double>(now - oldest->outbox_.movedAt()).count();
    const std::string cause = fmt::format(
        "a viewer took nothing for {:.1f} s while viewers hold more than {} MiB of frames: "
        "it's disconnected",
        seconds, options_.mostHeldBytes >> 20U);
    if (options_.log) options_.log(cause);
    oldest->refuse(Close::Stalled, cause);
  }
}

void Hub::miss(const Missing& missing) {
  for (Viewer* const viewer : viewers_) {
    if (viewer->shown_ != missing.frame) continue;
    viewer->missing_ = missing;
    viewer->wake_();
  }
}

bool Hub::isWanted(std::uint32_t index) const {
  return std::any_of(viewers_.begin(), viewers_.end(),
                     [index](const Viewer* viewer) { return viewer->shown_ == index; });
}

void Hub::append(const Series& entries) {
  if (!series_) series_.emplace();
  std::vector<std::optional<double>>& times = series_->times;
  const std::size_t before = times.size();
  times.insert(times.end(), entries.times.begin(), entries.times.end());
  try {
    series_->steps.insert(series_->steps.end(), entries.steps.begin(), entries.steps.end());
  } catch (const std::exception&) {  // without memory; each step keeps its own time
    times.resize(before);
    throw;
  }
  wakeAll();
}

void Hub::setPhase(Phase phase, std::string cause) {
  phase_ = phase;
  cause_ = std::move(cause);
  wakeAll();
}

void Hub::setControls(Controls controls) {
  if (controls_ == controls) return;
  controls_ = std::move(controls);
  ++steeringVersion_;
  wakeAll();
}

void Hub::endDrive() {
  Wish goOn;
  goOn.paused = false;
  const std::uint32_t driver = *driver_;
  driver_.reset();
  ++steeringVersion_;
  if (std::exchange(driverPaused_, false)) options_.steer(driver, goOn);
}

Viewer::Viewer(Hub& hub, std::function<void()> wake)
    : hub_(hub), wake_(std::move(wake)), outbox_(hub.options_.mostBytesPerSecond) {}

Viewer::~Viewer() {
  leave();
}

void Viewer::leave() noexcept {
  outbox_.close();
  announced_.reset();
  if (hub_.viewers_.erase(this) == 0) return;
  try {
    if (hub_.driver_ == number_) hub_.endDrive();
  } catch (const std::exception&) {  // without memory, a paused simulation waits for the next driver
  }
  hub_.wakeAll();
}

void Viewer::offer(const FramePtr& frame, Clock::time_point now) {
  try {
    outbox_.offer(frame, now);
    wake_();
  } catch (const std::exception&) {  // other viewers get the frame
    refuse(Close::Stalled, "no memory");
  }
}

std::vector<std::shared_ptr<const EncodedLevel>> Viewer::held() const {
  std::vector<std::shared_ptr<const EncodedLevel>> levels = outbox_.held();
  if (announced_) levels.push_back(announced_->frame->levels[announced_->level]);
  if (const auto level = inFlight_.lock()) levels.push_back(level);
  return levels;
}

void Viewer::refuse(Close code, std::string cause) {
  // A viewer that was refused for another reason may stall before the message under way ends.
  if (!farewell_ || code == Close::Stalled) farewell_ = {code, std::move(cause)};
  outbox_.close();
  announced_.reset();
  wake_();
}

void Viewer::take(const Hello& hello, Clock::time_point now) {
  if (hello.version != protocolVersion) {
    refuse(Close::OtherVersion, fmt::format("this server uses protocol version {}, the viewer version {}",
                                            protocolVersion, hello.version));
    return;
  }
  if (!hub_.token_.accepts(hello.token)) {
    refuse(Close::WrongToken, "the token is wrong");
    return;
  }
  if (hub_.viewers_.size() >= hub_.options_.mostViewers) {
    refuse(Close::TooMany, fmt::format("the server already has {} viewers", hub_.options_.mostViewers));
    return;
  }
  isWelcome_ = true;
  number_ = ++hub_.lastNumber_;
  hub_.viewers_.insert(this);
  if (hub_.newest_) {
    const bool hasIt = hello.session == hub_.session_ && hello.have == hub_.newest_->id;
    if (hasIt) {
      outbox_.skip(hub_.newest_);
    } else {
      outbox_.offer(hub_.newest_, now);
    }
  }
  hub_.wakeAll();
}

void Viewer::take(const Ack& ack, Clock::time_point now) {
  outbox_.acknowledge(ack, now);
}

void Viewer::take(const Pause& /*unused*/, Clock::time_point /*unused*/) {
  outbox_.pause(true);
}

void Viewer::take(const Resume& /*unused*/, Clock::time_point now) {
  outbox_.pause(false);
  shown_.reset();
  if (hub_.newest_) outbox_.offer(hub_.newest_, now);
}

void Viewer::take(const Show& wish, Clock::time_point /*unused*/) {
  const std::uint32_t index = wish.index;
  if (!hub_.series_ || index >= hub_.series_->size() || !hub_.options_.show) {
    refuse(Close::BadMessage, fmt::format("the series has no frame {}", index));
    return;
  }
  shown_ = index;
  hub_.options_.show(index);
}

void Viewer::deny(std::string cause) {
  denied_ = {std::move(cause)};
}

void Viewer::take(const Drive& /*unused*/, Clock::time_point /*unused*/) {
  if (!hub_.canSteer()) {
    deny("steering isn't allowed here");
  } else if (hub_.driver_ && hub_.driver_ != number_) {
    deny(fmt::format("viewer {} drives", *hub_.driver_));
  } else if (!hub_.driver_) {
    hub_.driver_ = number_;
    ++hub_.steeringVersion_;
    hub_.wakeAll();
  }
}

void Viewer::take(const Release& /*unused*/, Clock::time_point /*unused*/) {
  if (hub_.driver_ != number_) return;
  hub_.endDrive();
  hub_.wakeAll();
}

void Viewer::take(const Steer& steer, Clock::time_point /*unused*/) {
  const Wish& wish = steer.wish;
  if (!hub_.canSteer() || hub_.driver_ != number_) {
    deny(hub_.canSteer() ? "this viewer doesn't drive" : "steering isn't allowed here");
    return;
  }
  std::string objection = objectionTo(wish, hub_.controls_);
  if (!objection.empty()) {
    deny(std::move(objection));
    return;
  }
  if (wish.isEmpty()) return;
  if (wish.paused) hub_.driverPaused_ = *wish.paused;
  hub_.options_.steer(number_, wish);
}

void Viewer::receive(std::string_view text, Clock::time_point now) {
  if (farewell_) return;
  try {
    const FromViewer message = viewerMessage(text);
    if (std::holds_alternative<Hello>(message) == isWelcome_) {
      refuse(Close::BadMessage, isWelcome_ ? "a second \"hello\"" : "the first message isn't \"hello\"");
      return;
    }
    std::visit([&](const auto& m) { take(m, now); }, message);
  } catch (const Error& error) {
    refuse(Close::BadMessage, error.what());
  }
}

std::optional<std::string> Viewer::news() {
  const std::optional<Series>& series = hub_.series_;
  if (!wasWelcomed_) {
    wasWelcomed_ = true;
    Welcome welcome{protocolVersion, hub_.session_,      hub_.canSteer(),
                    std::nullopt,    hub_.viewerCount(), static_cast<std::uint32_t>(pulse.count())};
    if (series) {
      welcome.series = partOf(*series, 0);
      seriesSent_ = welcome.series->size();
    }
    return textOf(welcome);
  }
  if (series && seriesSent_ < series->size()) {
    const SeriesPart part{static_cast<std::uint32_t>(seriesSent_), partOf(*series, seriesSent_)};
    seriesSent_ += part.entries.size();
    return textOf(part);
  }
  if (stateSent_ != hub_.state()) {
    stateSent_ = hub_.state();
    return textOf(*stateSent_);
  }
  if (hub_.canSteer() && steeringSent_ != hub_.steeringVersion_) {
    steeringSent_ = hub_.steeringVersion_;
    return textOf(Steering{number_, hub_.driver_, hub_.controls_});
  }
  if (denied_) return textOf(*std::exchange(denied_, std::nullopt));
  if (missing_) return textOf(*std::exchange(missing_, std::nullopt));
  return std::nullopt;
}

std::string Viewer::announcement(const Outbox::LevelPart& part, Clock::time_point now) const {
  const Frame& frame = *part.frame;
  const EncodedLevel& level = *frame.levels[part.level];
  return textOf(Level{frame.id, part.level, frame.levelCount, level.bytes.size(), level.width, level.height,
                      frame.step, frame.time, std::chrono::duration<double>(now - frame.made).count(),
                      outbox_.dropped()});
}

Viewer::Outgoing Viewer::next(Clock::time_point now) {
  Outgoing outgoing = ahead(now);
  auto* const wait = std::get_if<Wait>(&outgoing);
  if (wait == nullptr) {
    sentAt_ = now;
  } else if (wasWelcomed_) {
    const Clock::time_point due = sentAt_ + pulse;
    if (now >= due) {
      sentAt_ = now;
      return textOf(hub_.state());
    }
    wait->until = std::min(wait->until.value_or(due), due);
  }
  return outgoing;
}

Viewer::Outgoing Viewer::ahead(Clock::time_point now) {
  if (farewell_) {
    if (std::exchange(isCauseTold_, true)) return *farewell_;
    if (farewell_->code == Close::GoingAway) return textOf(State{Phase::Ended, hub_.viewerCount(), {}});
    return textOf(Refusal{farewell_->cause});
  }
  if (!isWelcome_) return Wait{};
  if (std::optional<std::string> text = news()) return *std::move(text);
  std::optional<Outbox::LevelPart> part = std::exchange(announced_, std::nullopt);
  if (!part) {
    Outbox::Next ahead = outbox_.next(now);
    if (!ahead.part) return Wait{ahead.retry};
    part = std::move(ahead.part);
    if (part->offset == 0) {
      announced_ = part;
      return announcement(*part, now);
    }
  }
  const std::shared_ptr<const EncodedLevel>& level = part->frame->levels[part->level];
  inFlight_ = level;
  return Binary{chunkHead({part->frame->id, part->level, part->offset, part->bytes}), level, part->bytes};
}

}  // namespace vdi::stream
