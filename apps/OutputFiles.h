// Checks a command's outputs before the command computes anything.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vdi::apps {

/// A file and the origin of its name, such as "--flat", for messages.
struct NamedFile {
  std::string origin;
  std::filesystem::path path;
};

/// Throws Error: Io if one of `outputs` cannot be written (as io::requireWritable), InvalidArgument
/// if two of them are the same file or one is among `inputs`. Devices and pipes may be written
/// twice.
void requireOutputs(const std::vector<NamedFile>& outputs, const std::vector<NamedFile>& inputs);

}  // namespace vdi::apps
