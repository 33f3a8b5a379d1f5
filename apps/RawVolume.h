// Raw volumes with a JSON sidecar; docs/raw-volumes.md describes the sidecar.
#pragma once

#include <filesystem>
#include <vector>

#include "apps/Decomposition.h"
#include "vdi/core/Camera.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::apps {

struct RawVolume {
  Lattice lattice;             // joint: SharedPoints for point data, Cells for cell data
  std::filesystem::path data;  // the raw file
  bool bigEndian = false;
  std::uint64_t skip = 0;  // bytes before the first value
};

/// Throws Error: Io if a file is missing; Format if the sidecar isn't JSON, lacks a field, has an unknown or
/// impossible one, or if the raw file's size doesn't match.
RawVolume readSidecar(const std::filesystem::path& path);

/// The values of one part, read from the file; the block owns them.
Block readPart(const RawVolume& volume, const Part& part);

/// {"colors": [[x, r, g, b], ...], "opacities": [[x, a], ...], "unit_distance": d}. Throws as readSidecar.
TransferFunction readTransferFunction(const std::filesystem::path& path);

/// Three hues over [min, max]: transparent below a third, nearly opaque at the top.
TransferFunction defaultTransferFunction(double min, double max, double unitDistance);

/// {"position": [x, y, z], "focal_point": [...], "view_up": [...], "view_angle": degrees} or, instead of
/// view_angle, "parallel_scale": s. Throws as readSidecar.
Camera readCamera(const std::filesystem::path& path);

}  // namespace vdi::apps
