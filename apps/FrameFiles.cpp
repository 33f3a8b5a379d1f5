#include "apps/FrameFiles.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <system_error>

#include "vdi/core/Error.h"
#include "vdi/core/Estimate.h"
#include "vdi/io/Files.h"
#include "vdi/io/VdiFile.h"

namespace vdi::apps {

namespace {

/// The file's time on the clock of frames.
stream::Clock::time_point writtenAt(const std::filesystem::path& file) {
  std::error_code error;
  const auto time = std::filesystem::last_write_time(file, error);
  const stream::Clock::time_point now = stream::Clock::now();
  if (error) return now;
  const auto age = std::filesystem::file_time_type::clock::now() - time;
  return age.count() > 0 ? now - std::chrono::duration_cast<stream::Clock::duration>(age) : now;
}

/// The time that a program may take to write a file under its final name.
constexpr std::chrono::seconds writingTime{1};
constexpr char damagedOrGone[] = "the file is damaged or gone";
constexpr char replaced[] = "the file was replaced";

int makeWakeup() {
  const int descriptor = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (descriptor < 0)
    throw Error(ErrorCode::Io, "can't watch files: " + std::generic_category().message(errno));
  return descriptor;
}

void wake(int wakeup) {
  (void)::eventfd_write(wakeup, 1);
}

}  // namespace

FrameFiles::FrameFiles(Options options) : options_(std::move(options)), wakeup_(makeWakeup()) {
  assert(options_.files.empty() != options_.folder.empty());
}

FrameFiles::~FrameFiles() {
  stop();
  ::close(wakeup_);
}

void FrameFiles::stop() {
  {
    const std::scoped_lock lock(mutex_);
    isEnding_ = true;
  }
  wake(wakeup_);
  if (thread_.joinable()) thread_.join();
}

void FrameFiles::start(stream::Server& server) {
  server_ = &server;
  if (options_.folder.empty()) {
    add(options_.files);
  } else {
    watch_.emplace(options_.folder);
    if (!options_.follows) look();
  }
  thread_ = std::thread([this] { work(); });
}

void FrameFiles::show(std::uint32_t index) {
  {
    const std::scoped_lock lock(mutex_);
    if (std::find(wanted_.begin(), wanted_.end(), index) == wanted_.end()) wanted_.push_back(index);
  }
  wake(wakeup_);
}

void FrameFiles::work() {
  while (true) {
    if (follows()) look();
    std::optional<std::uint32_t> index;
    {
      const std::scoped_lock lock(mutex_);
      if (isEnding_) return;
      if (!wanted_.empty()) {
        index = wanted_.front();
        wanted_.pop_front();
      }
    }
    if (index && server_->isWanted(*index)) provide(*index);
    tellIncomplete();
    if (!index) waitForWork();
  }
}

/// The time until something is due in a followed folder: the next listing, or a line on an incomplete file.
std::chrono::milliseconds FrameFiles::untilWork() const {
  constexpr std::chrono::milliseconds lineDelay{250};
  const bool awaitsLine = std::any_of(incomplete_.begin(), incomplete_.end(),
                                      [](const auto& file) { return !file.second.isTold; });
  const std::chrono::milliseconds listing = watch_->untilListing();
  return awaitsLine ? std::min(listing, lineDelay) : listing;
}

void FrameFiles::waitForWork() {
  std::array<pollfd, 2> descriptors{pollfd{wakeup_, POLLIN, 0},
                                    pollfd{follows() ? watch_->descriptor() : -1, POLLIN, 0}};
  const int timeout = follows() ? static_cast<int>(untilWork().count()) : -1;
  (void)::poll(descriptors.data(), descriptors.size(), timeout);
  eventfd_t count = 0;
  (void)::eventfd_read(wakeup_, &count);
}

void FrameFiles::look() {
  try {
    const FolderWatch::Changes changes = watch_->changed();
    add(changes.files);
    noteGone(changes.gone);
    folderTrouble_.clear();
  } catch (const Error& error) {
    if (folderTrouble_ != error.what()) options_.log(error.what());
    folderTrouble_ = error.what();
  }
}

/// Skips a file for now. The watch reports it again when it changes.
void FrameFiles::leaveOut(const std::string& name, const std::string& what) {
  Incomplete& incomplete = incomplete_[name];
  incomplete.what = what;
  incomplete.since = stream::Clock::now();
}

/// Logs each incomplete file once. In a followed folder, a program may still be writing the file, so it gets
/// some time first.
void FrameFiles::tellIncomplete() {
  const auto patience = follows() ? writingTime : std::chrono::seconds(0);
  for (auto& [name, incomplete] : incomplete_) {
    if (incomplete.isTold || stream::Clock::now() - incomplete.since < patience) continue;
    options_.log(incomplete.what + "; it was skipped");
    incomplete.isTold = true;
  }
}

/// Throws Error as io::readVdiInfo does, and OutOfMemory for a VDI that viewers' pages can't hold.
FrameFiles::Content FrameFiles::contentOf(const std::filesystem::path& file) {
  Content content;
  content.look = lookAt(file).value_or(FileLook());  // before reading, so that a later change shows
  const io::VdiFileInfo info = io::readVdiInfo(file);
  try {
    requireFitsPages(std::uint64_t{static_cast<std::uint32_t>(info.header.width)} *
                         static_cast<std::uint32_t>(info.header.height),
                     info.supersegmentCount, info.header.precision());
  } catch (const Error& error) {
    throw Error(error.code(), error.what(), file.string());
  }
  if (std::isfinite(info.header.time)) content.time = info.header.time;
  content.step = info.header.timeStep;
  content.checksum = info.checksum;
  return content;
}

std::string FrameFiles::nameOf(const std::filesystem::path& file) const {
  return options_.folder.empty() ? file.string() : file.filename().string();
}

/// The entry of a followed file, if it has this content, perhaps with another time.
std::optional<std::uint32_t> FrameFiles::indexWith(const std::string& name, const Content& content) const {
  const auto found = latest_.find(name);
  if (found == latest_.end()) return std::nullopt;
  const Content& before = entries_.at(found->second).content;
  const bool isSame = before.look.size == content.look.size && before.checksum == content.checksum;
  return isSame ? std::optional(found->second) : std::nullopt;
}

/// Keeps the entry of a file that still has its content, or has come back with it.
void FrameFiles::refresh(std::uint32_t index, const Content& content) {
  Entry& entry = entries_.at(index);
  entry.content = content;
  entry.isGone = false;
  if (!entry.isDamaged) incomplete_.erase(entry.name);
}

/// Gives a followed file a new entry, and forgets the former one.
void FrameFiles::replace(const std::string& name, std::uint32_t index) {
  const auto [at, isNew] = latest_.try_emplace(name, index);
  if (isNew) return;
  const std::uint32_t before = std::exchange(at->second, index);
  isReplaced_[before] = true;
  entries_.erase(before);
  kept_.remove_if([before](const stream::FramePtr& frame) { return frame->id == before; });
}

/// Forgets files that are gone, except the last ones, which come back if only their file system had
/// failed.
void FrameFiles::noteGone(const std::vector<std::filesystem::path>& gone) {
  constexpr std::size_t mostGone = 256;
  for (const std::filesystem::path& file : gone) {
    const std::string name = nameOf(file);
    incomplete_.erase(name);
    const auto found = latest_.find(name);
    if (found == latest_.end()) continue;
    entries_.at(found->second).isGone = true;
    lastGone_.emplace_back(name, found->second);
    if (lastGone_.size() <= mostGone) continue;
    const auto [oldest, index] = lastGone_.front();
    lastGone_.pop_front();
    const auto entry = entries_.find(index);
    if (entry == entries_.end() || !entry->second.isGone)
      continue;  // another came in its place, or it came back
    entries_.erase(entry);
    latest_.erase(oldest);
  }
}

/// Adds all files to the series and shows the last complete one. Throws Error as io::readVdiInfo does for a
/// bad file of a list; bad files of a folder are left out.
void FrameFiles::add(const std::vector<std::filesystem::path>& files) {
  stream::Series entries;
  std::size_t unshown = isReplaced_.size();
  for (const std::filesystem::path& file : files) {
    const std::string name = nameOf(file);
    try {
      const Content content = contentOf(file);
      const auto index = static_cast<std::uint32_t>(isReplaced_.size());
      if (const std::optional<std::uint32_t> same = indexWith(name, content)) {
        refresh(*same, content);
        // The newest entry's lists may be sound now.
        if (entries_.at(*same).isDamaged && *same + 1 == index) unshown = *same;
        continue;
      }
      entries.times.push_back(content.time);
      entries.steps.push_back(content.step);
      isReplaced_.push_back(false);
      entries_.emplace(index, Entry{name, content});
      if (follows()) replace(name, index);
    } catch (const Error& error) {
      if (!watch_) throw;
      leaveOut(name, error.what());
    }
  }
  if (entries.size() > 0) server_->append(std::move(entries));
  // A viewer that receives this phase has the whole series.
  if (!follows()) server_->setPhase(stream::Phase::Ended);
  for (auto index = static_cast<std::uint32_t>(isReplaced_.size()); index-- > unshown;) {
    if (send(index, [this](stream::FramePtr frame) { server_->publish(std::move(frame)); })) return;
  }
}

/// Returns false if the file is bad or gone.
bool FrameFiles::send(std::uint32_t index, const std::function<void(stream::FramePtr)>& take) {
  Entry& entry = entries_.at(index);
  const std::filesystem::path file = pathOf(entry.name);
  entry.isDamaged = true;
  try {
    std::vector<std::byte> bytes = io::InputFile(file).readAll();
    const stream::Clock::time_point made = writtenAt(file);
    try {
      stream::passFrame(std::move(bytes), index, made, take);
    } catch (const Error& error) {
      throw Error(error.code(), error.what(), file.string());
    }
    incomplete_.erase(entry.name);
    entry.isDamaged = false;
    return true;
  } catch (const Error& error) {
    leaveOut(entry.name, error.what());
    return false;
  }
}

/// The reason why the file is no longer the entry's; empty if it may be. A file that is gone may
/// still be kept.
std::string FrameFiles::changeOf(Entry& entry) const {
  const std::filesystem::path file = pathOf(entry.name);
  const std::optional<FileLook> look = lookAt(file);
  if (!look || *look == entry.content.look) return {};
  try {
    const Content content = contentOf(file);
    if (content.look.size != entry.content.look.size || content.checksum != entry.content.checksum)
      return replaced;
    entry.content = content;
    return {};
  } catch (const Error&) {
    return damagedOrGone;
  }
}

/// Answers with a frame that was shown before. Returns false if it isn't kept.
bool FrameFiles::provideKept(std::uint32_t index) {
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [index](const stream::FramePtr& frame) { return frame->id == index; });
  if (found == kept_.end()) return false;
  kept_.splice(kept_.begin(), kept_, found);
  server_->provide(kept_.front());
  return true;
}

void FrameFiles::provide(std::uint32_t index) {
  constexpr std::size_t mostKept = 4;
  const auto entry = entries_.find(index);
  const std::string change = entry == entries_.end() ? "" : changeOf(entry->second);
  if (!change.empty()) {
    kept_.remove_if([index](const stream::FramePtr& frame) { return frame->id == index; });
    server_->miss({index, change});
    return;
  }
  if (provideKept(index)) return;
  if (entry == entries_.end() || entry->second.isGone) {
    server_->miss({index, isReplaced_[index] ? replaced : damagedOrGone});
    return;
  }
  stream::FramePtr last;
  const bool isSound = send(index, [this, &last](stream::FramePtr frame) {
    last = frame;
    server_->provide(std::move(frame));
  });
  if (!isSound) {
    server_->miss({index, damagedOrGone});
    return;
  }
  kept_.push_front(std::move(last));
  if (kept_.size() > mostKept) kept_.pop_back();
}

}  // namespace vdi::apps
