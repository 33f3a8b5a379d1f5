#include "vdi/pipeline/GeneratorOptions.h"

#include <string>

#include "vdi/core/Environment.h"

namespace vdi {

GeneratorOptions generatorOptionsFromEnvironment(const comm::Communicator& comm) {
  const std::string transport = comm.environment("VDI_TRANSPORT");
  const std::string bands = comm.environment("VDI_BANDS");
  GeneratorOptions options;
  comm.together([&] {
    options.transport = comm::transportFromText(transport);
    options.bands = environmentCount("VDI_BANDS", 1, bands).value_or(0);
  });
  return options;
}

}  // namespace vdi
