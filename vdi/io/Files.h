// Reads files with clear errors, and writes them so that no reader sees half a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace vdi::io {

/// A regular file that is open for reading. Opening a pipe does not wait for its writer. Throws
/// Error{Io} with the path as context for: no such file; a folder, pipe or device; no permission; a
/// read that fails or ends early.
class InputFile {
 public:
  explicit InputFile(std::filesystem::path path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::uint64_t size() const { return size_; }
  /// Fills `to` from `offset` on. Throws if the file ends earlier.
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
///   its old content. File and folder are synchronised, so a power cut loses neither.
/// - An existing file keeps its permissions (and its owner, as far as the process may set it); it must be
///   writable. A symbolic link stays one: the file that it names is replaced.
/// - Character devices and pipes are written directly; a pipe must have a reader. Folders, block devices and
///   sockets are refused.
/// A killed process leaves nothing behind on file systems with unnamed files (O_TMPFILE). Elsewhere it may
/// leave `.vdi-<process>-<number>.tmp` in the folder, which can be deleted.
void writeAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// writeAtomically in steps, for bytes that are made piece by piece, or by several processes. All functions
/// throw as writeAtomically does.
class OutputFile {
 public:
  /// Refuses what requireWritable refuses. The file is invisible until commit.
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();  // without commit, discards the file
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  OutputFile(OutputFile&&) = delete;
  OutputFile& operator=(OutputFile&&) = delete;

  /// False for a device or pipe, which takes bytes only in sequence.
  bool takesOffsets() const;
  /// Writes anywhere in the file. Without offsets, appends to the bytes written before.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Sets the file's size, which may not be less than what was written. Throws if there is no room for it, as
  /// far as the file system can tell. Call before other processes write: an NFS client may fill the page at a
  /// file's end with zeros and overwrite their bytes with it.
  void reserve(std::uint64_t bytes);
  /// Gives the file a name under which other processes can open it (SharedOutput) until commit, or until this
  /// object ends: an absolute path whose last part is random. If the process is killed in between, that file
  /// stays. Requires takesOffsets().
  std::filesystem::path share();
  /// Call when the other processes have finished too. The file gets its final name, and this object has no
  /// file any more.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Another process's OutputFile, opened by the name under which it is shared.
class SharedOutput {
 public:
  /// Returns nullopt if there is no such file here or it may not be written, as on a host that lacks the
  /// folder. Throws Error{Io} for other reasons. Errors have `path` as context.
  static std::optional<SharedOutput> open(const std::filesystem::path& shared,
                                          const std::filesystem::path& path);
  ~SharedOutput();
  SharedOutput(SharedOutput&& other) noexcept;
  SharedOutput(const SharedOutput&) = delete;
  SharedOutput& operator=(const SharedOutput&) = delete;
  SharedOutput& operator=(SharedOutput&&) = delete;

  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// All written bytes are on the disk when this returns. Nothing can be written afterwards.
  void finish();

 private:
  SharedOutput(std::filesystem::path path, int descriptor);
  std::filesystem::path path_;
  int descriptor_;
};

/// Appends `line` and a line end to a file, which it creates. Throws Error{Io} with the file as context.
void appendLine(const std::filesystem::path& path, std::string_view line);

/// Makes `link` a symbolic link to `target`, which is relative to the link's folder. Readers see the old link
/// or the new one. Throws Error{Io} with the link as context. Never replaces anything but a link.
void replaceLink(const std::filesystem::path& link, const std::filesystem::path& target);

/// Throws the Error{Io} that writeAtomically would throw now, before there is anything to write. Changes
/// nothing. Returns the regular file that would be made or replaced, absolute and with links followed; an
/// empty path for a device or pipe. Two paths with the same result are one file.
std::filesystem::path requireWritable(const std::filesystem::path& path);

}  // namespace vdi::io
