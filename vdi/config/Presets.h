// Transfer functions that fit any data.
#pragma once

#include <string>
#include <vector>

#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::config {

struct PresetInfo {
  std::string name;
  std::string description;
};
const std::vector<PresetInfo>& transferFunctionPresets();

/// A preset stretched over the range, as `stretched` does. Throws Error{InvalidArgument} that lists the valid
/// names.
TransferFunction presetTransferFunction(const std::string& name, const ScalarRange& range,
                                        double unitDistance);

/// The function with x of 0 and 1 moved to the ends of `range`. A range without width is widened to 1, and an
/// empty one becomes [0, 1].
TransferFunction stretched(TransferFunction function, const ScalarRange& range);

}  // namespace vdi::config
