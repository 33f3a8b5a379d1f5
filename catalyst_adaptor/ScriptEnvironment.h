// What scripts expect of the process that runs them.
#pragma once

#include <optional>
#include <string>

namespace vdi::catalyst {

/// The path of our plugin for ParaView: what the environment variable VDI_PLUGIN names or, unless it is set,
/// the one that was built or installed with this library. Throws std::runtime_error, naming the place looked
/// at, where there is none.
std::string pluginFile();

/// Makes Python's symbols those of the whole process: extension modules don't link libpython, and a library
/// that was loaded for itself alone keeps it to itself.
void sharePython();

/// Python's lock, as long as it lives and where Python runs: a simulation in Python that calls through
/// ctypes.CDLL has released it.
class PythonLock {
 public:
  PythonLock();
  ~PythonLock();
  PythonLock(const PythonLock&) = delete;
  PythonLock& operator=(const PythonLock&) = delete;

 private:
  std::optional<int> before_;
};

}  // namespace vdi::catalyst
