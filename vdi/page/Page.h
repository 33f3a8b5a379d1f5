// One file for browsers: the page of web/ with VDIs inside. docs/page.md is for users.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace vdi::page {

/// A frame of the page.
struct PageFrame {
  std::string name;                              // shown by the page; UTF-8
  std::function<std::vector<std::byte>()> file;  // gives the bytes of a .vdi file; called once
};

/// Frames of files, which are read when the page is written.
std::vector<PageFrame> framesOf(std::span<const std::filesystem::path> files);

/// Writes the page with `frames` in their order, as io::OutputFile does: `path` has its old content, or none,
/// until all of the page is on the disk. Equal frames and titles give equal bytes on every machine with the
/// same zlib. One frame is in memory at a time. Throws Error{InvalidArgument} without frames, Error{Format}
/// for one that io::decode refuses, Error{OutOfMemory} for one that takes too much memory in a page,
/// Error{Io} for one that takes more text than browsers hold (512 MB), for files that can't be read, and for
/// `path`.
void writePage(const std::filesystem::path& path, const std::string& title,
               std::span<const PageFrame> frames);

/// The page without frames, UTF-8. From a server, with #token=… in its link, it shows that server's stream;
/// else a user opens or drops files. It may connect to its own origin; a page with frames may connect to
/// nothing.
std::string emptyPage(const std::string& title);

}  // namespace vdi::page
