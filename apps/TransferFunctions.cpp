#include "apps/TransferFunctions.h"

#include <utility>

#include "apps/JsonFile.h"
#include "vdi/config/Presets.h"
#include "vdi/core/Error.h"

namespace vdi::apps {

TransferFunction readTransferFunction(const std::filesystem::path& path, const ScalarRange& range) {
  const JsonFile file(path, {"colors", "opacities", "unit_distance", "relative"});
  TransferFunction function;
  for (const std::vector<double>& row : file.rows("colors", 4)) {
    function.colors.push_back({row[0], {row[1], row[2], row[3]}});
  }
  for (const std::vector<double>& row : file.rows("opacities", 2)) {
    function.opacities.push_back({row[0], row[1]});
  }
  if (file.has("unit_distance")) function.unitDistance = file.number("unit_distance");
  try {
    validate(function);
  } catch (const Error& error) {
    file.fail(error.what());
  }
  return file.has("relative") && file.flag("relative") ? config::stretched(std::move(function), range)
                                                       : function;
}

}  // namespace vdi::apps
