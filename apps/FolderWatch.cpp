#include "apps/FolderWatch.h"

#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <system_error>
#include <utility>

#include "vdi/core/Error.h"

namespace vdi::apps {

namespace {

bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

/// The digits at `at`, without leading zeros.
std::string numberAt(const std::string& text, std::size_t& at) {
  while (at + 1 < text.size() && text[at] == '0' && isDigit(text[at + 1])) ++at;
  const std::size_t begin = at;
  while (at < text.size() && isDigit(text[at])) ++at;
  return text.substr(begin, at - begin);
}

/// Whether the entry is a link to a file of the same folder, such as latest.vdi, directly or through other
/// links.
bool isAnotherName(const std::filesystem::directory_entry& entry) {
  std::error_code error;
  if (!entry.is_symlink(error)) return false;
  const std::filesystem::path target = std::filesystem::read_symlink(entry.path(), error);
  if (error) return false;
  if (!target.has_parent_path()) return true;
  const std::filesystem::path folder = std::filesystem::canonical(entry.path().parent_path(), error);
  if (error) return false;
  const std::filesystem::path next = folder / target;  // the target alone if it is absolute
  if (std::filesystem::weakly_canonical(next.parent_path(), error) == folder && !error) return true;
  return std::filesystem::weakly_canonical(next, error).parent_path() == folder && !error;
}

bool isFrame(std::string_view name) {
  return name.ends_with(".vdi") && !name.starts_with('.');
}

/// The properties of the entry's file; nullopt if it is another name of a file, or gone.
std::optional<FileLook> frameAt(const std::filesystem::directory_entry& entry) {
  return isAnotherName(entry) ? std::nullopt : lookAt(entry.path());
}

}  // namespace

std::optional<FileLook> lookAt(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  return FileLook{static_cast<std::uint64_t>(status.st_size), status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

bool comesBefore(const std::string& a, const std::string& b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (isDigit(a[i]) && isDigit(b[j])) {
      const std::string left = numberAt(a, i);
      const std::string right = numberAt(b, j);
      if (left.size() != right.size()) return left.size() < right.size();
      if (left != right) return left < right;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) return i == a.size();
  return a < b;  // "01" and "1"
}

FolderWatch::FolderWatch(std::filesystem::path folder)
    : folder_(std::move(folder)), descriptor_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
  std::error_code error;
  const std::filesystem::directory_iterator entries(folder_, error);
  if (error) throw Error(ErrorCode::Io, "can't read the folder: " + error.message(), folder_.string());
  watch();
}

/// Watches the folder that has the name now. Returns whether it is a different one than before.
bool FolderWatch::watch() {
  if (!descriptor_.isOpen()) return false;
  // A file that is opened without a name (O_TMPFILE) is created when it gets one.
  const int number =
      ::inotify_add_watch(descriptor(), folder_.c_str(),
                          IN_CREATE | IN_CLOSE_WRITE | IN_MOVED_TO | IN_DELETE | IN_MOVED_FROM | IN_ONLYDIR);
  const int before = std::exchange(number_, number);
  if (before == number) return false;
  if (before >= 0) (void)::inotify_rm_watch(descriptor(), before);
  return true;
}

/// Reads the names of the files that the system reports. Returns false if it has lost some.
bool FolderWatch::readReported(std::set<std::string>& names) const {
  bool isWhole = true;
  constexpr std::size_t room = 4096;
  std::array<char, room> events{};
  while (descriptor_.isOpen()) {
    const ssize_t size = ::read(descriptor(), events.data(), events.size());
    if (size <= 0) break;
    for (std::size_t at = 0; at < static_cast<std::size_t>(size);) {
      inotify_event event{};
      std::memcpy(&event, events.data() + at, sizeof event);
      if ((event.mask & IN_Q_OVERFLOW) != 0) isWhole = false;
      const std::string name = event.len > 0 ? events.data() + at + sizeof event : "";
      if (event.wd == number_ && isFrame(name)) names.insert(name);
      at += sizeof event + event.len;
    }
  }
  return isWhole;
}

std::chrono::milliseconds FolderWatch::untilListing() const {
  using std::chrono::milliseconds;
  const auto left = nextListing_ - std::chrono::steady_clock::now();
  return std::max(std::chrono::ceil<milliseconds>(left), milliseconds(0));
}

bool FolderWatch::isKnown(const std::string& name, const FileLook& look) const {
  const auto known = known_.find(name);
  return known != known_.end() && known->second == look;
}

/// Compares a file with its last known properties.
void FolderWatch::check(const std::string& name, Changes& changes) {
  const std::filesystem::path file = folder_ / name;
  std::error_code error;  // the entry of a file that is gone has no path
  if (const auto look = frameAt(std::filesystem::directory_entry(file, error))) {
    if (isKnown(name, *look)) return;
    known_[name] = *look;
    changes.files.push_back(file);
  } else if (known_.erase(name) > 0) {
    changes.gone.push_back(file);
  }
}

/// Compares the whole folder with its last known files.
void FolderWatch::list(Changes& changes) {
  constexpr std::chrono::steady_clock::duration shortest = std::chrono::milliseconds(250);
  constexpr std::chrono::steady_clock::duration longest = std::chrono::minutes(1);
  constexpr int share = 50;  // of the time
  const auto begin = std::chrono::steady_clock::now();
  std::map<std::string, FileLook> seen;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder_, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    std::string name = entries->path().filename().string();
    if (!isFrame(name)) continue;
    const std::optional<FileLook> look = frameAt(*entries);
    if (!look) continue;  // the file may vanish between two listings
    if (!isKnown(name, *look)) changes.files.push_back(*entries);
    seen.emplace_hint(seen.end(), std::move(name), *look);
  }
  const auto end = std::chrono::steady_clock::now();
  nextListing_ = end + std::clamp((end - begin) * share, shortest, longest);
  if (error) throw Error(ErrorCode::Io, "can't read the folder: " + error.message(), folder_.string());
  for (const auto& [name, look] : known_) {
    if (!seen.contains(name)) changes.gone.push_back(folder_ / name);
  }
  known_ = std::move(seen);
}

FolderWatch::Changes FolderWatch::changed() {
  Changes changes;
  std::set<std::string> names;
  const bool isWhole = readReported(names);
  const bool isOther = watch();  // before the listing, so that no file appears unseen in between
  if (!isWhole || isOther || untilListing() == std::chrono::milliseconds(0)) {
    list(changes);
  } else {
    for (const std::string& name : names) check(name, changes);
  }
  std::sort(changes.files.begin(), changes.files.end(), [](const auto& a, const auto& b) {
    return comesBefore(a.filename().string(), b.filename().string());
  });
  return changes;
}

}  // namespace vdi::apps
