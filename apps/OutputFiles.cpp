#include "apps/OutputFiles.h"

#include <fmt/format.h>

#include <map>
#include <system_error>

#include "vdi/core/Error.h"
#include "vdi/io/Files.h"

namespace vdi::apps {

void requireOutputs(const std::vector<NamedFile>& outputs, const std::vector<NamedFile>& inputs) {
  std::map<std::filesystem::path, std::string> origins;
  for (const NamedFile& input : inputs) {
    std::error_code error;  // reading reports a missing file
    origins.emplace(std::filesystem::canonical(input.path, error), input.origin);
  }
  for (const NamedFile& output : outputs) {
    const std::filesystem::path file = io::requireWritable(output.path);
    if (file.empty()) continue;
    const auto [found, isNew] = origins.emplace(file, output.origin);
    if (isNew) continue;
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("{} would overwrite {}", output.origin,
                            found->second == output.origin ? "itself" : "the file of " + found->second),
                output.path.string());
  }
}

}  // namespace vdi::apps
