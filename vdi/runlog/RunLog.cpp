#include "vdi/runlog/RunLog.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "vdi/core/Descriptor.h"
#include "vdi/core/Error.h"

namespace vdi::runlog {

namespace {

[[noreturn]] void failWith(const char* what, int number, const std::filesystem::path& path) {
  throw Error(ErrorCode::Io, std::string("can't ") + what + ": " + std::system_category().message(number),
              path.string());
}

}  // namespace

/// A file to which lines are appended. Unless it is kept, a file that this object has made is removed again.
class RunLog::Appended {
 public:
  explicit Appended(std::filesystem::path path) : path_(std::move(path)) {
    std::error_code error;
    if (path_.has_parent_path()) std::filesystem::create_directories(path_.parent_path(), error);
    if (error) throw Error(ErrorCode::Io, "can't make the log's folder: " + error.message(), path_.string());
    // Non-blocking, so that opening a file that isn't regular doesn't wait.
    constexpr mode_t readable = 0666;
    constexpr int flags = O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NONBLOCK;
    descriptor_ = Descriptor(::open(path_.c_str(), flags | O_EXCL, readable));
    isToRemove_ = descriptor_.isOpen();
    if (!isToRemove_ && errno == EEXIST) descriptor_ = Descriptor(::open(path_.c_str(), flags, readable));
    if (!descriptor_.isOpen()) failWith("open the log", errno, path_);
    struct stat status {};
    if (::fstat(descriptor_.number(), &status) != 0 || !S_ISREG(status.st_mode))
      throw Error(ErrorCode::Io, "the log must be a regular file", path_.string());
  }

  ~Appended() {
    if (isToRemove_) ::unlink(path_.c_str());
  }
  Appended(const Appended&) = delete;
  Appended& operator=(const Appended&) = delete;

  void keep() { isToRemove_ = false; }

  void empty() {
    if (::ftruncate(descriptor_.number(), 0) != 0) failWith("empty the log", errno, path_);
  }

  void append(const std::string& line) {
    const int file = descriptor_.number();
    const off_t before = ::lseek(file, 0, SEEK_END);
    if (before < 0) failWith("write the log", errno, path_);
    std::string bytes = line + '\n';
    char last = '\n';
    // A line that another program has left unfinished doesn't spoil this one.
    if (before > 0 && ::pread(file, &last, 1, before - 1) == 1 && last != '\n') bytes.insert(0, 1, '\n');
    if (writeAll(file, std::as_bytes(std::span(bytes)))) return;
    const int reason = errno;
    const bool isPartWritten = ::lseek(file, 0, SEEK_CUR) > before;
    if (isPartWritten) (void)::ftruncate(file, before);
    failWith("write the log", reason, path_);
  }

 private:
  std::filesystem::path path_;
  Descriptor descriptor_;
  bool isToRemove_ = false;
};

RunLog::RunLog(const LogFiles& files, const RunStart& start, Before before) {
  if (files.json) json_ = std::make_unique<Appended>(*files.json);
  if (files.text) text_ = std::make_unique<Appended>(*files.text);
  // Empties the files only once both are open, so that a failure to open one spares the other.
  for (Appended* file : {json_.get(), text_.get()}) {
    if (file != nullptr && before == Before::Goes) file->empty();
  }
  summary_.isIsolated = start.isIsolated;
  append(jsonLine(start), textLine(start));
  // An empty log, left by a start that failed, would be in the way of the next one.
  for (Appended* file : {json_.get(), text_.get()}) {
    if (file != nullptr) file->keep();
  }
}

RunLog::~RunLog() = default;

void RunLog::append(const std::string& json, const std::string& text) {
  std::optional<Error> failure;
  const auto add = [&](Appended* file, const std::string& line) {
    try {
      if (file != nullptr) file->append(line);
    } catch (const Error& error) {
      failure = failure ? Error(error.code(), std::string(failure->what()) + "; " + error.what()) : error;
    }
  };
  add(json_.get(), json);
  add(text_.get(), text);
  if (failure) throw *failure;
}

void RunLog::add(const FrameRecord& record) {
  summary_.add(record);
  append(jsonLine(record), textLine(record));
}

void RunLog::add(const LeftOut& frame) {
  ++summary_.leftOut;
  append(jsonLine(frame), textLine(frame));
}

void RunLog::addNotHandedOver(std::int64_t step, double time) {
  add(LeftOut{step, time, "two earlier frames were still to be made"});
}

RunSummary RunLog::finish() {
  summary_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  append(jsonLine(summary_), textLine(summary_));
  return summary_;
}

}  // namespace vdi::runlog
