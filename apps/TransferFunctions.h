// Transfer functions from JSON files, and some that fit any data.
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

/// A preset stretched over the range; a range of no width gets one of 1, an empty one becomes [0, 1]. Throws
/// Error{InvalidArgument} that lists the names there are.
TransferFunction presetTransferFunction(const std::string& name, const ScalarRange& range,
                                        double unitDistance);

/// docs/raw-volumes.md describes the file. With "relative": true its x of 0 and 1 are the ends of `range`,
/// which is widened as above. Throws Error: Io if the file can't be read, Format for anything that isn't a
/// transfer function.
TransferFunction readTransferFunction(const std::filesystem::path& path, const ScalarRange& range);

}  // namespace vdi::apps
