// The state of a file, from which a reader sees that the file has changed.
#ifndef VDIFileState_h
#define VDIFileState_h

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace pv {

struct FileState {
  std::filesystem::file_time_type written;
  std::uintmax_t bytes = 0;

  bool operator==(const FileState&) const = default;
};

/// The file's state; nullopt if there is no such file.
inline std::optional<FileState> stateOf(const std::string& name) {
  std::error_code error;
  FileState state;
  state.written = std::filesystem::last_write_time(name, error);
  if (!error) state.bytes = std::filesystem::file_size(name, error);
  return error ? std::nullopt : std::optional(state);
}

}  // namespace pv

#endif
