// Whole files: read with clear errors, written so that no reader sees half of one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
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

/// writeAtomically in steps, for bytes that aren't all there at once, or that several processes have. All of
/// it throws as writeAtomically does.
class OutputFile {
 public:
  /// Refuses what requireWritable does. Nothing is seen of the file until commit.
  explicit OutputFile(const std::filesystem::path& path);
  ~OutputFile();  // without commit, nothing has happened
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  OutputFile(OutputFile&&) = delete;
  OutputFile& operator=(OutputFile&&) = delete;

  /// False: a device or pipe, which takes bytes one behind the other.
  bool takesOffsets() const;
  /// Anywhere in the file. Into what takes no offsets: behind what was written before.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// The file is to have that many bytes: throws if there's no room for them, as far as the file system can
  /// tell. Before other processes write, for a client of NFS may fill up the page at a file's end with zeros,
  /// and write them over what others have there. Not less than what was written.
  void reserve(std::uint64_t bytes);
  /// What other processes can open (SharedOutput) until commit, or until this goes: an absolute path, whose
  /// last part is random. A process that's killed in between leaves that file. Requires takesOffsets().
  std::filesystem::path share();
  /// Once others are finished too. The file gets its name, and this object has no file any more.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Another process's OutputFile, by the name that it shares it under.
class SharedOutput {
 public:
  /// None: there's no such file here, or none that may be written to, as on a host that doesn't have the
  /// folder. Throws Error{Io} for other reasons. Errors have `path` as context.
  static std::optional<SharedOutput> open(const std::filesystem::path& shared,
                                          const std::filesystem::path& path);
  ~SharedOutput();
  SharedOutput(SharedOutput&& other) noexcept;
  SharedOutput(const SharedOutput&) = delete;
  SharedOutput& operator=(const SharedOutput&) = delete;
  SharedOutput& operator=(SharedOutput&&) = delete;

  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// What was written is on the disk when this returns. Nothing can be written afterwards.
  void finish();

 private:
  SharedOutput(std::filesystem::path path, int descriptor);
  std::filesystem::path path_;
  int descriptor_;
};

/// What writeAtomically would refuse now, before there's anything to write: throws the same Error{Io}.
/// Changes nothing. Returns the regular file that would be made or replaced, absolute and with links
/// followed; an empty path for a device or pipe. Two paths of one result are one file.
std::filesystem::path requireWritable(const std::filesystem::path& path);

}  // namespace vdi::io
