// Whole files: read with clear errors, written so that no reader sees half of one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace vdi::io {

/// A regular file open for reading. Throws Error{Io} with the path as context: no such file, not a regular
/// file, no permission, a read that fails or ends early.
class InputFile {
 public:
  explicit InputFile(std::filesystem::path path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::uint64_t size() const { return size_; }
  /// `count` bytes from `offset`; offset + count <= size().
  std::vector<std::byte> read(std::uint64_t offset, std::uint64_t count) const;
  std::vector<std::byte> readAll() const { return read(0, size_); }

 private:
  std::filesystem::path path_;
  int descriptor_;
  std::uint64_t size_ = 0;
};

/// Writes a file of a name that nobody else uses beside `path` and renames it. Until then `path` keeps its
/// old content, and after an error too; the other file is removed. The bytes aren't forced to the disk: a
/// power cut may still lose them. Throws Error{Io} with the path as context and the system's reason.
void writeAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace vdi::io
