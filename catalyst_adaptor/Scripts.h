// The scripts that a simulation names.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

/// A Python file, and the arguments that paraview.catalyst.get_args() returns in it.
struct Script {
  std::string file;
  std::vector<std::string> arguments;
};

/// Copies the arguments of vdi_catalyst_initialize or vdi_catalyst_initialize_pipelines. Throws
/// std::invalid_argument for a null pointer or a negative number.
std::vector<Script> scriptsOf(std::int32_t count, const char* const* files);
std::vector<Script> scriptsOf(std::int32_t count, const vdi_catalyst_pipeline* given);

}  // namespace vdi::catalyst
