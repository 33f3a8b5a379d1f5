// What scripts expect of the process that runs them.
#pragma once

namespace vdi::catalyst {

/// Sets the environment variable VDI_PLUGIN, unless it is set, to the plugin that was built or installed with
/// this library. Throws std::runtime_error, naming the place looked at, where there is none.
void providePlugin();

/// Makes Python's symbols those of the whole process: extension modules don't link libpython, and a library
/// that was loaded for itself alone keeps it to itself.
void sharePython();

}  // namespace vdi::catalyst
