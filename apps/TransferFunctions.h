// Transfer functions from JSON files.
#pragma once

#include <filesystem>

#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::apps {

/// Reads the file that docs/raw-volumes.md describes. With "relative": true, x of 0 and 1 are
/// the ends of `range`, as in config::stretched. Throws Error: Io if the file cannot be read,
/// Format if it is not a transfer function.
TransferFunction readTransferFunction(const std::filesystem::path& path, const ScalarRange& range);

}  // namespace vdi::apps
