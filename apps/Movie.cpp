#include "apps/Movie.h"

#include <fmt/format.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vdi/core/Error.h"

namespace vdi::apps {

namespace {

[[noreturn]] void fail(const std::string& what, const std::filesystem::path& path) {
  throw Error(ErrorCode::Io, what, path.string());
}

/// ffmpeg's words for a movie that looks like its pictures.
std::vector<std::string> wordsOf(const std::filesystem::path& file, int width, int height, double rate) {
  std::vector<std::string> words{"ffmpeg",
                                 "-loglevel",
                                 "error",
                                 "-nostdin",
                                 "-y",
                                 "-f",
                                 "rawvideo",
                                 "-pix_fmt",
                                 "rgb24",
                                 "-s",
                                 fmt::format("{}x{}", width, height),
                                 "-framerate",
                                 fmt::format("{}", rate),
                                 "-i",
                                 "pipe:0"};
  // Players know only this format, which needs even sizes.
  for (const char* const word : {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-crf", "20"})
    words.emplace_back(word);
  if (file.extension() == ".webm") {
    for (const char* const word : {"-c:v", "libvpx-vp9", "-b:v", "0", "-row-mt", "1"})
      words.emplace_back(word);
  }
  words.push_back("file:" + file.string());
  return words;
}

}  // namespace

bool isMovie(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".webm" || extension == ".mp4" || extension == ".mkv";
}

Movie::Movie(std::filesystem::path path, int width, int height, double rate)
    : path_(std::move(path)), part_(path_) {
  part_.replace_filename(
      fmt::format(".{}.{}.part{}", path_.stem().string(), ::getpid(), path_.extension().string()));
  std::signal(SIGPIPE, SIG_IGN);  // add() reports that ffmpeg has ended
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0)
    fail(std::string("can't make a pipe: ") + std::strerror(errno), path_);
  const Descriptor input(ends[0]);
  pipe_ = Descriptor(ends[1]);
  std::vector<std::string> words = wordsOf(part_, width, height, rate);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, input.number(), STDIN_FILENO);
  const int error = ::posix_spawnp(&process_, "ffmpeg", &actions, nullptr, arguments.data(), ::environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (error == 0) return;
  fail(error == ENOENT ? "a movie needs the program ffmpeg, which isn't installed; without --movie, numbered "
                         "PNGs are written"
                       : std::string("can't start ffmpeg: ") + std::strerror(error),
       path_);
}

Movie::~Movie() {
  if (process_ < 0) return;
  ::kill(process_, SIGKILL);  // otherwise it would finish a part of the movie
  (void)end();
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

void Movie::add(const io::Picture& picture) {
  if (!writeAll(pipe_.number(), std::as_bytes(std::span(picture.rgb)))) fail("ffmpeg has failed", path_);
}

void Movie::finish() {
  std::error_code error;
  const bool isDone = end();
  if (isDone) std::filesystem::rename(part_, path_, error);
  if (isDone && !error) return;
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
  fail(isDone ? "can't write the movie: " + error.message() : "ffmpeg has failed", path_);
}

bool Movie::end() {
  pipe_ = Descriptor();
  int status = 0;
  const pid_t process = std::exchange(process_, -1);
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace vdi::apps
