// .vdi files as the frames of a server: a list of files, or the files that appear in a folder.
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

/// Reads, checks and encodes files on a thread of its own, and passes them to a server as the
/// frames of one series. A frame's id is its index in the series. A file that is replaced becomes a
/// new frame, and the former one is missing. A file that was only touched stays the frame that it is.
/// The memory grows with the number of files that exist, and by a bit for each frame.
class FrameFiles {
 public:
  struct Options {
    std::vector<std::filesystem::path> files;     // a finished series; empty: `folder` is set
    std::filesystem::path folder;                 // the folder whose files are the series
    bool follows = true;                          // whether to watch the folder for new files
    std::function<void(const std::string&)> log;  // gets one line, from any thread
  };
  explicit FrameFiles(Options options);
  ~FrameFiles();
  FrameFiles(const FrameFiles&) = delete;
  FrameFiles& operator=(const FrameFiles&) = delete;

  /// Starts once. The server must live until stop() or this object's end. Throws Error: Io for a
  /// folder or a file that cannot be read, Format for a file that is not a VDI; bad files of a
  /// folder are logged and skipped.
  void start(stream::Server& server);
  /// Stops passing frames to the server. The server may still call show, and may end afterwards.
  void stop();
  /// Implements ServerOptions::show.
  void show(std::uint32_t index);

 private:
  struct Content {
    FileLook look;
    std::uint64_t checksum = 0;  // io::VdiFileInfo's, which distinguishes VDIs without their lists
    std::optional<double> time;
    std::uint64_t step = 0;
  };
  struct Entry {
    std::string name;  // in the folder, or the path of a listed file
    Content content;
    bool isDamaged = false;  // the file was bad when it was last read in full
    bool isGone = false;
  };
  std::filesystem::path pathOf(const std::string& name) const { return options_.folder / name; }
  std::string nameOf(const std::filesystem::path& file) const;
  static Content contentOf(const std::filesystem::path& file);
  std::optional<std::uint32_t> indexWith(const std::string& name, const Content& content) const;
  void work();
  void look();
  void add(const std::vector<std::filesystem::path>& files);
  void refresh(std::uint32_t index, const Content& content);
  void replace(const std::string& name, std::uint32_t index);
  void noteGone(const std::vector<std::filesystem::path>& gone);
  void provide(std::uint32_t index);
  bool provideKept(std::uint32_t index);
  std::string changeOf(Entry& entry) const;
  bool send(std::uint32_t index, const std::function<void(stream::FramePtr)>& take);
  bool follows() const { return watch_ && options_.follows; }
  void waitForWork();
  std::chrono::milliseconds untilWork() const;
  void leaveOut(const std::string& name, const std::string& what);
  void tellIncomplete();

  Options options_;
  stream::Server* server_ = nullptr;
  std::optional<FolderWatch> watch_;
  std::vector<bool> isReplaced_;                 // for each entry of the series
  std::map<std::uint32_t, Entry> entries_;       // those of the series that files may still have
  std::map<std::string, std::uint32_t> latest_;  // a followed file's entry
  std::deque<std::pair<std::string, std::uint32_t>> lastGone_;  // files that may come back, and their entries
  std::list<stream::FramePtr> kept_;                            // the last few frames shown
  struct Incomplete {
    std::string what;
    stream::Clock::time_point since;  // the file's last change
    bool isTold = false;
  };
  std::map<std::string, Incomplete> incomplete_;
  std::string folderTrouble_;

  int wakeup_;        // an eventfd; signals that a member below has changed
  std::mutex mutex_;  // guards the next two members
  std::deque<std::uint32_t> wanted_;
  bool isEnding_ = false;
  std::thread thread_;
};

}  // namespace vdi::apps
