// .vdi files as the frames of a server: the files of a list, or those that appear in a folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/FolderWatch.h"
#include "vdi/stream/Frame.h"
#include "vdi/stream/Server.h"

namespace vdi::apps {

/// Reads, checks and encodes files on a thread of its own, and hands them to a server as the frames of one
/// series. A frame's id is its index in the series.
class FrameFiles {
 public:
  struct Options {
    std::vector<std::filesystem::path> files;  // a finished series; or
    std::filesystem::path folder;              // whose files are the series, and
    bool follows = true;                       // which is watched for new files
    std::chrono::milliseconds interval{250};   // between two listings of a folder that doesn't report changes
    std::function<void(const std::string&)> log;  // one line, from any thread
  };
  explicit FrameFiles(Options options);
  ~FrameFiles();
  FrameFiles(const FrameFiles&) = delete;
  FrameFiles& operator=(const FrameFiles&) = delete;

  /// Starts once. The server must live until stop() or this object's end. Throws Error: Io for a folder or a
  /// file that cannot be read, Format for a file that is not a VDI; bad files of a folder are logged and
  /// skipped.
  void start(stream::Server& server);
  /// Nothing is handed to the server any more. The server may end afterwards, and may still call show.
  void stop();
  /// For ServerOptions::show.
  void show(std::uint32_t index);

 private:
  void work();
  void look();
  void add(const std::vector<std::filesystem::path>& files);
  void provide(std::uint32_t index);
  bool send(std::uint32_t index, const std::function<void(stream::FramePtr)>& take);
  bool follows() const { return watch_ && options_.follows; }
  void waitForWork();
  void leaveOut(const std::filesystem::path& file, const std::string& what);
  void tellIncomplete();

  Options options_;
  stream::Server* server_ = nullptr;
  std::optional<FolderWatch> watch_;
  std::vector<std::filesystem::path> series_;
  std::list<stream::FramePtr> kept_;  // the last few frames shown
  struct Incomplete {
    std::string what;
    stream::Clock::time_point since;  // the file's last change
    bool isTold = false;
  };
  std::map<std::filesystem::path, Incomplete> incomplete_;
  std::string folderTrouble_;

  int wakeup_;        // an eventfd: something below has changed
  std::mutex mutex_;  // for the next two
  std::deque<std::uint32_t> wanted_;
  bool isEnding_ = false;
  std::thread thread_;
};

}  // namespace vdi::apps
