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
  if (phase_ == Phase::Waiting) phase_ = Phase::Live;
  for (Viewer* const viewer : viewers_) {
    if (!viewer->shown_) viewer->offer(newest_, now);
  }
  wakeAll();
}

void Hub::provide(const FramePtr& frame, Clock::time_point now) {
  for (Viewer* const viewer : viewers_) {
    if (viewer->shown_ == frame->id) viewer->offer(frame, now);
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
  series_->times.insert(series_->times.end(), entries.times.begin(), entries.times.end());
  series_->steps.insert(series_->steps.end(), entries.steps.begin(), entries.steps.end());
  wakeAll();
}

void Hub::setPhase(Phase phase) {
  phase_ = phase;
  wakeAll();
}

Viewer::Viewer(Hub& hub, std::function<void()> wake)
    : hub_(hub), wake_(std::move(wake)), outbox_(hub.options_.mostBytesPerSecond) {}

Viewer::~Viewer() {
  if (hub_.viewers_.erase(this) > 0) hub_.wakeAll();
}

void Viewer::offer(const FramePtr& frame, Clock::time_point now) {
  outbox_.offer(frame, now);
  wake_();
}

void Viewer::refuse(Close code, std::string cause) {
  if (!farewell_) farewell_ = {code, std::move(cause)};
  wake_();
}

void Viewer::enter(const Hello& hello, Clock::time_point now) {
  if (hello.version != protocolVersion) {
    refuse(Close::OtherVersion, fmt::format("this server speaks version {}, the viewer version {}",
                                            protocolVersion, hello.version));
    return;
  }
  if (!hub_.token_.accepts(hello.token)) {
    refuse(Close::WrongToken, "the token is wrong");
    return;
  }
  if (hub_.viewers_.size() >= hub_.options_.mostViewers) {
    refuse(Close::TooMany, fmt::format("there are {} viewers already", hub_.options_.mostViewers));
    return;
  }
  isWelcome_ = true;
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

void Viewer::show(std::uint32_t index) {
  if (!hub_.series_ || index >= hub_.series_->size() || !hub_.options_.show) {
    refuse(Close::BadMessage, fmt::format("there is no frame {} in a series", index));
    return;
  }
  shown_ = index;
  hub_.options_.show(index);
}

void Viewer::receive(std::string_view text, Clock::time_point now) {
  if (farewell_) return;
  try {
    const FromViewer message = viewerMessage(text);
    const auto* const hello = std::get_if<Hello>(&message);
    if ((hello != nullptr) == isWelcome_) {
      refuse(Close::BadMessage, isWelcome_ ? "a second \"hello\"" : "the first message isn't \"hello\"");
    } else if (hello != nullptr) {
      enter(*hello, now);
    } else if (const auto* const ack = std::get_if<Ack>(&message)) {
      outbox_.acknowledge(*ack, now);
    } else if (const auto* const wish = std::get_if<Show>(&message)) {
      show(wish->index);
    } else {
      const bool pauses = std::holds_alternative<Pause>(message);
      outbox_.pause(pauses);
      if (!pauses) {
        shown_.reset();
        if (hub_.newest_) outbox_.offer(hub_.newest_, now);
      }
    }
  } catch (const Error& error) {
    refuse(Close::BadMessage, error.what());
  }
}

std::optional<std::string> Viewer::news() {
  const std::optional<Series>& series = hub_.series_;
  if (!wasWelcomed_) {
    wasWelcomed_ = true;
    Welcome welcome{protocolVersion, hub_.session_, false, std::nullopt, hub_.viewerCount()};
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
  if (missing_) return textOf(*std::exchange(missing_, std::nullopt));
  return std::nullopt;
}

std::string Viewer::announcement(const Outbox::Part& part, Clock::time_point now) const {
  const Frame& frame = *part.frame;
  const EncodedLevel& level = *frame.levels[part.level];
  return textOf(Level{frame.id, part.level, frame.levelCount, level.bytes.size(), level.width, level.height,
                      frame.step, frame.time, std::chrono::duration<double>(now - frame.made).count(),
                      outbox_.dropped()});
}

Viewer::Outgoing Viewer::next(Clock::time_point now) {
  if (farewell_) {
    if (std::exchange(isCauseTold_, true)) return *farewell_;
    if (farewell_->code == Close::GoingAway) return textOf(State{Phase::Ended, hub_.viewerCount()});
    return textOf(Refusal{farewell_->cause});
  }
  if (!isWelcome_) return Wait{};
  if (std::optional<std::string> text = news()) return *std::move(text);
  std::optional<Outbox::Part> part = std::exchange(announced_, std::nullopt);
  if (!part) {
    Outbox::Next ahead = outbox_.next(now);
    if (!ahead.part) return Wait{ahead.retry};
    part = std::move(ahead.part);
    if (part->offset == 0) {
      announced_ = part;
      return announcement(*part, now);
    }
  }
  return Binary{chunkHead({part->frame->id, part->level, part->offset, part->bytes}), part->frame,
                part->bytes};
}

}  // namespace vdi::stream
