// Raw volumes with a JSON sidecar; docs/raw-volumes.md describes the sidecar.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "vdi/synthetic/Decomposition.h"

namespace vdi::apps {

struct RawVolume {
  synthetic::Lattice lattice;  // joint: SharedPoints for point data, Cells for cell data
  std::filesystem::path data;  // the raw file
  bool bigEndian = false;
  std::uint64_t skip = 0;         // bytes before the first value
  std::vector<double> missing{};  // numbers that stand for missing values
};

/// Throws Error: Io if a file is missing; Format if the sidecar is not JSON, lacks a field, or has
/// an unknown or impossible one, or if the raw file's size differs from the sidecar's.
RawVolume readSidecar(const std::filesystem::path& path);

/// Reads the values of one part from the file; the block owns them. Throws Error{Io}.
Block readPart(const RawVolume& volume, const synthetic::Part& part);

}  // namespace vdi::apps
