// Movies, which the program ffmpeg makes of pictures.
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "vdi/core/Descriptor.h"
#include "vdi/io/Png.h"

namespace vdi::apps {

/// The extensions of movies in words, for messages and help.
inline constexpr const char* movieExtensions = ".webm, .mp4 or .mkv";
bool isMovie(const std::filesystem::path& path);

/// A movie in the making. It replaces an older file when it is whole.
class Movie {
 public:
  /// Starts ffmpeg. All pictures have this size, and `rate` of them are shown per second. Throws
  /// Error{Io} if ffmpeg can't be started.
  Movie(std::filesystem::path path, int width, int height, double rate);
  /// Without finish(), ends ffmpeg and leaves no file.
  ~Movie();
  Movie(const Movie&) = delete;
  Movie& operator=(const Movie&) = delete;

  /// Throws Error{Io} if ffmpeg has ended. It has told why on standard error.
  void add(const io::Picture& picture);
  /// Waits for ffmpeg to end. Throws Error{Io} if it fails.
  void finish();

 private:
  /// Closes the pipe and waits. Returns whether ffmpeg has succeeded.
  bool end();

  std::filesystem::path path_;
  std::filesystem::path part_;
  pid_t process_ = -1;
  Descriptor pipe_;  // to ffmpeg
};

}  // namespace vdi::apps
