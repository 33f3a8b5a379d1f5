#include "catalyst_adaptor/Scripts.h"

#include "catalyst_adaptor/Calls.h"

namespace vdi::catalyst {

std::vector<Script> scriptsOf(std::int32_t count, const char* const* files) {
  require(count >= 0 && (count == 0 || files != nullptr), "no scripts given");
  std::vector<Script> scripts;
  for (int i = 0; i < count; ++i) {
    require(files[i] != nullptr, "a script's path is null");
    scripts.push_back({files[i], {}});
  }
  return scripts;
}

std::vector<Script> scriptsOf(std::int32_t count, const vdi_catalyst_pipeline* given) {
  require(count >= 0 && (count == 0 || given != nullptr), "no scripts given");
  std::vector<Script> scripts;
  for (int i = 0; i < count; ++i) {
    const vdi_catalyst_pipeline& one = given[i];
    require(one.file != nullptr, "a script's path is null");
    require(one.argument_count >= 0 && (one.argument_count == 0 || one.arguments != nullptr),
            "no arguments given");
    Script& script = scripts.emplace_back();
    script.file = one.file;
    for (int a = 0; a < one.argument_count; ++a) {
      require(one.arguments[a] != nullptr, "a script's argument is null");
      script.arguments.emplace_back(one.arguments[a]);
    }
  }
  return scripts;
}

}  // namespace vdi::catalyst
