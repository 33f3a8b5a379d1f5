#include "apps/FrameFiles.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <system_error>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/io/VdiFile.h"

namespace vdi::apps {

namespace {

/// The file's time, on the clock of frames.
stream::Clock::time_point writtenAt(const std::filesystem::path& file) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(file, error);
  const stream::Clock::time_point now = stream::Clock::now();
  if (error) return now;
  const auto age = std::filesystem::file_time_type::clock::now() - time;
  return age.count() > 0 ? now - std::chrono::duration_cast<stream::Clock::duration>(age) : now;
}

}  // namespace

FrameFiles::FrameFiles(Options options) : options_(std::move(options)) {
  assert(options_.files.empty() != options_.folder.empty());
}

FrameFiles::~FrameFiles() {
  {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void FrameFiles::start(stream::Server& server) {
  server_ = &server;
  if (options_.folder.empty()) {
    for (const std::filesystem::path& file : options_.files) (void)io::readVdiInfo(file);
    server.setPhase(stream::Phase::Ended);
    add(options_.files);
  } else {
    watch_.emplace(options_.folder);
    if (!options_.follows) {
      server.setPhase(stream::Phase::Ended);
      look();
    }
  }
  thread_ = std::thread([this] { work(); });
}

void FrameFiles::show(std::uint32_t index) {
  {
    const std::scoped_lock lock(mutex_);
    if (std::find(wanted_.begin(), wanted_.end(), index) == wanted_.end()) wanted_.push_back(index);
  }
  changed_.notify_all();
}

void FrameFiles::work() {
  const bool follows = watch_ && options_.follows;
  while (true) {
    if (follows) look();
    std::optional<std::uint32_t> index;
    {
      std::unique_lock lock(mutex_);
      const auto hasWork = [this] { return isEnding_ || !wanted_.empty(); };
      if (follows) {
        changed_.wait_for(lock, options_.interval, hasWork);
      } else {
        changed_.wait(lock, hasWork);
      }
      if (isEnding_) return;
      if (!wanted_.empty()) {
        index = wanted_.front();
        wanted_.pop_front();
      }
    }
    if (index && server_->isWanted(*index)) provide(*index);
  }
}

void FrameFiles::look() {
  try {
    add(watch_->changed());
    folderTrouble_.clear();
  } catch (const Error& error) {
    if (folderTrouble_ != error.what()) options_.log(error.what());
    folderTrouble_ = error.what();
  }
}

/// An incomplete file is found again when it changes.
void FrameFiles::tell(const std::filesystem::path& file, const std::string& what) {
  std::string& said = told_[file];
  if (said.empty()) options_.log(what + "; it's left out");
  said = what;
}

/// Adds all files to the series, and shows the last one that is complete.
void FrameFiles::add(const std::vector<std::filesystem::path>& files) {
  stream::Series entries;
  for (const std::filesystem::path& file : files) {
    try {
      const Vdi header = io::readVdiInfo(file).header;
      entries.times.push_back(std::isfinite(header.time) ? std::optional(header.time) : std::nullopt);
      entries.steps.push_back(header.timeStep);
      series_.push_back(file);
    } catch (const Error& error) {
      tell(file, error.what());
    }
  }
  if (entries.size() == 0) return;
  const auto first = static_cast<std::uint32_t>(series_.size() - entries.size());
  server_->append(std::move(entries));
  for (auto index = static_cast<std::uint32_t>(series_.size()); index-- > first;) {
    if (send(index, [this](stream::FramePtr frame) { server_->publish(std::move(frame)); })) return;
  }
}

/// Returns false if the file is bad or gone.
bool FrameFiles::send(std::uint32_t index, const std::function<void(stream::FramePtr)>& take) {
  const std::filesystem::path& file = series_[index];
  try {
    std::vector<std::byte> bytes = io::InputFile(file).readAll();
    const stream::Clock::time_point made = writtenAt(file);
    try {
      const Vdi vdi = io::decode(bytes);
      stream::encodeFrame(vdi, index, made, std::move(bytes), take);
    } catch (const Error& error) {
      throw Error(error.code(), error.what(), file.string());
    }
    told_.erase(file);
    return true;
  } catch (const Error& error) {
    tell(file, error.what());
    return false;
  }
}

void FrameFiles::provide(std::uint32_t index) {
  constexpr std::size_t mostKept = 4;
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [index](const stream::FramePtr& frame) { return frame->id == index; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    server_->provide(kept_.front());
    return;
  }
  stream::FramePtr last;
  const bool isSound = send(index, [this, &last](stream::FramePtr frame) {
    last = frame;
    server_->provide(std::move(frame));
  });
  if (!isSound) {
    server_->miss({index, "the file is damaged or gone"});
    return;
  }
  kept_.push_front(std::move(last));
  if (kept_.size() > mostKept) kept_.pop_back();
}

}  // namespace vdi::apps
