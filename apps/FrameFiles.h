// .vdi files as the frames of a server: the files of a list, or those that appear in a folder.
#pragma once

#include <chrono>
#include <condition_variable>
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
    std::vector<std::filesystem::path> files;     // a finished series; or
    std::filesystem::path folder;                 // whose files are the series, and
    bool follows = true;                          // which is watched for new files
    std::chrono::milliseconds interval{250};      // between two listings of the folder
    std::function<void(const std::string&)> log;  // one line, from any thread
  };
  explicit FrameFiles(Options options);
  ~FrameFiles();
  FrameFiles(const FrameFiles&) = delete;
  FrameFiles& operator=(const FrameFiles&) = delete;

  /// Starts once. The server must outlive this. Throws Error: Io for a folder or a file that cannot be read,
  /// Format for a file that is not a VDI; bad files of a folder are logged and skipped.
  void start(stream::Server& server);
  /// For ServerOptions::show.
  void show(std::uint32_t index);

 private:
  void work();
  void look();
  void add(const std::vector<std::filesystem::path>& files);
  void provide(std::uint32_t index);
  bool send(std::uint32_t index, const std::function<void(stream::FramePtr)>& take);
  void tell(const std::filesystem::path& file, const std::string& what);

  Options options_;
  stream::Server* server_ = nullptr;
  std::optional<FolderWatch> watch_;
  std::vector<std::filesystem::path> series_;
  std::list<stream::FramePtr> kept_;  // the last few frames shown
  /// Files that were incomplete, with the message logged for each.
  std::map<std::filesystem::path, std::string> told_;
  std::string folderTrouble_;

  std::mutex mutex_;  // for the next two
  std::condition_variable changed_;
  std::deque<std::uint32_t> wanted_;
  bool isEnding_ = false;
  std::thread thread_;
};

}  // namespace vdi::apps
