#include "apps/FolderWatch.h"

#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
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
  const std::filesystem::path target = std::filesystem::read_symlink(entry.path(), error);
  if (error) return false;
  if (!target.has_parent_path()) return true;
  const std::filesystem::path folder = std::filesystem::canonical(entry.path().parent_path(), error);
  if (error) return false;
  const std::filesystem::path next = folder / target;  // the target alone if it is absolute
  if (std::filesystem::weakly_canonical(next.parent_path(), error) == folder && !error) return true;
  return std::filesystem::weakly_canonical(next, error).parent_path() == folder && !error;
}

}  // namespace

std::optional<FileLook> lookAt(const std::filesystem::path& file) {
  std::error_code noSize;
  std::error_code noTime;
  const FileLook look{std::filesystem::file_size(file, noSize),
                      std::filesystem::last_write_time(file, noTime)};
  return noSize || noTime ? std::nullopt : std::optional(look);
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

/// Watches the folder that has the name now, unless it is watched already.
void FolderWatch::watch() const {
  if (!descriptor_.isOpen()) return;
  // A file that is opened without a name (O_TMPFILE) is created when it gets one.
  (void)::inotify_add_watch(descriptor(), folder_.c_str(),
                            IN_CREATE | IN_CLOSE_WRITE | IN_MOVED_TO | IN_ONLYDIR);
}

FolderWatch::Changes FolderWatch::changed() {
  if (descriptor_.isOpen()) {
    std::array<std::byte, 4096> events{};
    while (::read(descriptor(), events.data(), events.size()) > 0) {
    }
    watch();  // before the listing, so that no file appears unseen in between
  }
  Changes changes;
  std::vector<std::filesystem::path>& files = changes.files;
  std::map<std::filesystem::path, FileLook> seen;
  std::error_code error;
  std::filesystem::directory_iterator entries(folder_, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::filesystem::path& file = entries->path();
    if (file.extension() != ".vdi" || file.filename().string().starts_with('.')) continue;
    if (isAnotherName(*entries)) continue;
    const std::optional<FileLook> look = lookAt(file);
    if (!look) continue;  // the file may vanish between two listings
    const auto before = known_.find(file);
    if (before == known_.end() || before->second != *look) files.push_back(file);
    seen.emplace(file, *look);
  }
  if (error) throw Error(ErrorCode::Io, "can't read the folder: " + error.message(), folder_.string());
  for (const auto& [file, look] : known_) {
    if (!seen.contains(file)) changes.gone.push_back(file);
  }
  known_ = std::move(seen);
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) {
    return comesBefore(a.filename().string(), b.filename().string());
  });
  return changes;
}

}  // namespace vdi::apps
