// Whole files: read with clear errors, written so that no reader sees half of one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace vdi::io {

/// A regular file open for reading; it never waits for a pipe's writer. Throws Error{Io} with the path as
/// context: no such file, a folder, pipe or device, no permission, a read that fails or ends early.
class InputFile {
 public:
  explicit InputFile(std::filesystem::path path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::uint64_t size() const { return size_; }
  /// Fills `to` from `offset` on. Throws if the file ends before.
  void readInto(std::uint64_t offset, std::span<std::byte> to) const;
  /// `count` bytes from `offset`; offset + count <= size().
  std::vector<std::byte> read(std::uint64_t offset, std::uint64_t count) const;
  std::vector<std::byte> readAll() const { return read(0, size_); }

 private:
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_ = 0;
};

/// Writes the whole file, or leaves `path` as it was. Throws Error{Io} with the path as context and the
/// system's reason.
/// - A regular file gets its name when all of it is on the disk: until then, and after an error, `path` has
///   its old content. File and folder are synchronised, so that a power cut loses neither.
/// - One that was there keeps its permissions (and its owner, as far as the process may); it must be
///   writable. A symbolic link stays one: the file that it names is replaced.
/// - Character devices and pipes are written to as they are; a pipe must have a reader. Folders, block
/// devices
///   and sockets are refused.
/// A killed process leaves nothing where the file system has files without a name (O_TMPFILE). Elsewhere it
/// may leave `.vdi-<process>-<number>.tmp` in the folder, which can be deleted.
void writeAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// What writeAtomically would refuse now, before there's anything to write: throws the same Error{Io}.
/// Changes nothing. Returns the regular file that would be made or replaced, absolute and with links
/// followed; an empty path for a device or pipe. Two paths of one result are one file.
std::filesystem::path requireWritable(const std::filesystem::path& path);

}  // namespace vdi::io
