#include <Python.h>  // Python requires it to be first

#include "catalyst_adaptor/scripts/ScriptEnvironment.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace vdi::catalyst {

namespace {

/// The library or program that holds this function; empty if unknown.
template <typename Function>
std::filesystem::path fileOf(Function* function) {
  Dl_info file;
  if (dladdr(reinterpret_cast<const void*>(function), &file) == 0 || file.dli_fname == nullptr) return {};
  return std::filesystem::absolute(file.dli_fname);
}

}  // namespace

std::string pluginFile() {
  if (const char* given = std::getenv("VDI_PLUGIN"); given != nullptr && *given != '\0') return given;
  // This library lies in a folder of its own beside libvdi_catalyst.so. The plugins lie beside that.
  const auto plugin = fileOf(&pluginFile).parent_path().parent_path() / VDI_PLUGIN_FILE;
  std::error_code unreadable;
  if (!std::filesystem::exists(plugin, unreadable)) {
    throw std::runtime_error("there is no ParaView plugin at " + plugin.string() +
                             "; install pv-vdi whole, or set VDI_PLUGIN to the path of its "
                             "VolumetricDepthImages.so");
  }
  return plugin.string();
}

void sharePython() {
  // A Python program itself can't be opened again, and has no need to be.
  dlopen(fileOf(&Py_IsInitialized).c_str(), RTLD_NOW | RTLD_NOLOAD | RTLD_GLOBAL);
}

// The parentheses avoid vtkPython.h's macros of these names, which take no lock.
PythonLock::PythonLock() {
  if (Py_IsInitialized() != 0) before_ = (PyGILState_Ensure)();
}

PythonLock::~PythonLock() {
  if (Py_IsInitialized() == 0) return;  // ParaView's end is Python's end, too, if ParaView started it
  if (before_) {
    (PyGILState_Release)(static_cast<PyGILState_STATE>(*before_));
  } else {
    PyEval_SaveThread();  // ParaView has started Python: the next call may be another thread's
  }
}

}  // namespace vdi::catalyst
