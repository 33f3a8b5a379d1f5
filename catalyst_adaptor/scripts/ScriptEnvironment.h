// The process's environment as scripts expect it.
#pragma once

#include <optional>
#include <string>

namespace vdi::catalyst {

/// The path of our plugin for ParaView: the environment variable VDI_PLUGIN or, unless it is set, the plugin
/// that was built or installed with this library. Throws std::runtime_error with the searched place if there
/// is none.
std::string pluginFile();

/// Gives the whole process Python's symbols. Extension modules don't link libpython, and a library that
/// loaded libpython privately keeps its symbols to itself.
void sharePython();

/// Holds Python's lock during its lifetime if Python runs. A simulation in Python that calls through
/// ctypes.CDLL has released the lock. If Python starts during its lifetime, no thread holds the lock
/// afterwards.
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
