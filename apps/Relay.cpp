#include "apps/Relay.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::apps {

namespace {

constexpr const char* gone = "the run has ended, and its server is gone";

}  // namespace

Relay::Relay(stream::ClientOptions from, stream::ServerOptions to)
    : options_(std::move(to)), client_(std::move(from)) {
  options_.show = [this](std::uint32_t index) {
    const std::scoped_lock lock(mutex_);
    if (std::find(wanted_.begin(), wanted_.end(), index) == wanted_.end()) wanted_.push_back(index);
  };
  server_ = std::make_unique<stream::Server>(options_);
  options_.port = server_->port();
}

void Relay::step(std::chrono::milliseconds time) {
  std::optional<stream::Received> received = client_.next(time);
  follow(client_.standing());
  if (!received) {
    if (isOver_) giveUp();
  } else if (received->session == session_) {
    pass(*std::move(received));
  }
  ask();
}

void Relay::follow(const stream::Client::Standing& standing) {
  if (standing.session.empty()) return tell(standing);
  if (session_ != standing.session) {
    if (!session_.empty()) restart();
    session_ = standing.session;
  }
  stream::Series more = client_.seriesFrom(seriesPassed_);
  if (more.size() > 0) {
    seriesPassed_ += more.size();
    server_->append(std::move(more));
  }
  // Until the other server sends its state, `standing` has the previous connection's.
  if (standing.hasState) phase_ = standing.state.phase;
  tell(standing);
}

/// Tells viewers the other server's state, or that it doesn't answer. A run that has ended needs no
/// answer.
void Relay::tell(const stream::Client::Standing& standing) {
  stream::State state{phase_.value_or(stream::Phase::Waiting), 0, {}};
  isOver_ = !standing.isConnected && state.phase == stream::Phase::Ended && standing.hasBeenLive;
  if (standing.isConnected) {
    if (standing.hasState) state.cause = standing.state.cause;
  } else if (!standing.trouble.empty() && !isOver_) {
    state.cause = "the source doesn't answer";
    if (state.phase == stream::Phase::Live) state.phase = stream::Phase::Waiting;
  }
  if (state == told_) return;
  server_->setPhase(state.phase, state.cause);
  told_ = std::move(state);
}

/// Starts a new server, and so a new session, because the other server's new session numbers its frames anew.
void Relay::restart() {
  server_.reset();
  {
    const std::scoped_lock lock(mutex_);
    wanted_.clear();
  }
  seriesPassed_ = 0;
  phase_.reset();
  isOver_ = false;
  told_ = {};
  current_.reset();
  whole_.clear();
  asked_.reset();
  newest_.reset();
  client_.resume();
  server_ = std::make_unique<stream::Server>(options_);
}

/// Asks the other server for the next wanted frame of its series. It sends one such frame at a time.
void Relay::ask() {
  while (!asked_) {
    std::optional<std::uint32_t> index;
    {
      const std::scoped_lock lock(mutex_);
      if (wanted_.empty()) return;
      index = wanted_.front();
      wanted_.pop_front();
    }
    if (!server_->isWanted(*index)) continue;
    const auto known = std::find_if(whole_.begin(), whole_.end(),
                                    [index](const stream::FramePtr& frame) { return frame->id == *index; });
    if (known != whole_.end()) {
      server_->provide(*known);
      continue;
    }
    if (isOver_) {
      server_->miss({*index, gone});
      continue;
    }
    asked_ = index;
    client_.show(*index);
  }
}

/// Tells viewers that the frame requested from the other server is gone. Otherwise they would wait
/// for ever.
void Relay::giveUp() {
  if (asked_) server_->miss({*asked_, gone});
  asked_.reset();
}

void Relay::finish(std::uint32_t index) {
  if (asked_ != index) return;
  asked_.reset();
  ask();
  // A finished series has no newer frames.
  if (!asked_ && phase_ != stream::Phase::Ended) client_.resume();
}

void Relay::pass(stream::Received received) {
  const std::uint32_t id = received.level.frame;
  if (!received.missing.empty()) {
    server_->miss({id, received.missing});
    finish(id);
    return;
  }
  const bool isFull = received.level.level + 1 == received.level.levels;
  add(std::move(received));
  if (!current_) return;
  if (!newest_ || id >= *newest_) {
    newest_ = id;
    server_->publish(current_);
  }
  if (asked_ == id) server_->provide(current_);
  if (!isFull) return;
  constexpr std::size_t mostKept = 4;
  whole_.remove_if([id](const stream::FramePtr& frame) { return frame->id == id; });
  whole_.push_front(std::exchange(current_, nullptr));
  if (whole_.size() > mostKept) whole_.pop_back();
  finish(id);
}

/// Adds a level to its frame, or begins the frame with it. The other server skips levels that are too coarse
/// for the connection, so the first one that arrives becomes level 0.
void Relay::add(stream::Received received) {
  const stream::Level& level = received.level;
  auto frame = std::make_shared<stream::Frame>();
  if (!current_ || current_->id != level.frame || level.level <= firstLevel_) {
    firstLevel_ = level.level;
    frame->id = level.frame;
    frame->step = level.step;
    frame->time = level.time.value_or(std::numeric_limits<double>::quiet_NaN());
    constexpr double longestAge = 1e9;  // s
    const std::chrono::duration<double> age(std::clamp(level.age, 0.0, longestAge));
    frame->made = stream::Clock::now() - std::chrono::duration_cast<stream::Clock::duration>(age);
    frame->levelCount = level.levels - level.level;
  } else if (current_->levels.size() == level.level - firstLevel_) {
    *frame = *current_;
  } else {
    current_.reset();
    return;
  }
  frame->levels.push_back(std::make_shared<stream::EncodedLevel>(
      stream::EncodedLevel{std::move(received.file), level.width, level.height}));
  current_ = std::move(frame);
}

}  // namespace vdi::apps
