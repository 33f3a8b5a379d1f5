// Transfer functions from JSON files, and presets that fit any data.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::apps {

struct PresetInfo {
  std::string name;
  std::string description;
};
const std::vector<PresetInfo>& transferFunctionPresets();

/// A preset stretched over the range; a range without width is widened to 1, an empty one becomes [0, 1].
/// Throws Error{InvalidArgument} that lists the valid names.
TransferFunction presetTransferFunction(const std::string& name, const ScalarRange& range,
                                        double unitDistance);

/// Reads the file that docs/raw-volumes.md describes. With "relative": true its x of 0 and 1 are the ends of
/// `range`, which is widened as above. Throws Error: Io if the file cannot be read, Format if it is not a
/// transfer function.
TransferFunction readTransferFunction(const std::filesystem::path& path, const ScalarRange& range);

}  // namespace vdi::apps
