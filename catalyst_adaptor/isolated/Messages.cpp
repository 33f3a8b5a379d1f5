#include "catalyst_adaptor/isolated/Messages.h"

#include <algorithm>
#include <array>

namespace vdi::catalyst {

void Setup::pack(Packer& packer) const {
  packer.put(rank);
  packer.put(isJson);
  packer.put(isGoingOn);
  packer.put(hasText);
  packer.putText(json);
  packer.put(std::uint64_t{scripts.size()});
  for (const Pipeline& script : scripts) {
    packer.putText(script.file);
    packer.put(std::uint64_t{script.arguments.size()});
    for (const std::string& argument : script.arguments) packer.putText(argument);
  }
  packer.put(std::uint64_t{environment.size()});
  for (const std::string& variable : environment) packer.putText(variable);
  packer.putText(folder);
  packer.put(umask);
}

Setup Setup::unpack(Unpacker& unpacker) {
  Setup setup;
  setup.rank = unpacker.take<std::int32_t>();
  setup.isJson = unpacker.take<bool>();
  setup.isGoingOn = unpacker.take<bool>();
  setup.hasText = unpacker.take<bool>();
  setup.json = unpacker.takeText();
  for (auto scripts = unpacker.take<std::uint64_t>(); scripts > 0; --scripts) {
    Pipeline& script = setup.scripts.emplace_back();
    script.file = unpacker.takeText();
    for (auto arguments = unpacker.take<std::uint64_t>(); arguments > 0; --arguments)
      script.arguments.push_back(unpacker.takeText());
  }
  for (auto variables = unpacker.take<std::uint64_t>(); variables > 0; --variables)
    setup.environment.push_back(unpacker.takeText());
  setup.folder = unpacker.takeText();
  setup.umask = unpacker.take<std::uint32_t>();
  return setup;
}

void LeftOutSteps::pack(Packer& packer) const {
  packer.put(std::uint64_t{steps.size()});
  for (const Step& step : steps) packer.put(step);
}

LeftOutSteps LeftOutSteps::unpack(Unpacker& unpacker) {
  LeftOutSteps all;
  for (auto count = unpacker.take<std::uint64_t>(); count > 0; --count)
    all.steps.push_back(unpacker.take<Step>());
  return all;
}

bool isOfMpiJob(std::string_view variable) {
  const auto startsWithAny = [&](const auto& prefixes) {
    return std::ranges::any_of(prefixes,
                               [&](std::string_view prefix) { return variable.starts_with(prefix); });
  };
  // Users may set parameters whose names begin with OMPI_MCA_, too.
  constexpr std::array<std::string_view, 7> jobs{"OMPI_MCA_orte_",
                                                 "OMPI_MCA_ess",
                                                 "OMPI_MCA_pmix",
                                                 "OMPI_MCA_initial_",
                                                 "OMPI_MCA_shmem_RUNTIME",
                                                 "OMPI_MCA_prte_",
                                                 "OMPI_MCA_mpi_oversubscribe"};
  constexpr std::array<std::string_view, 4> users{"OMPI_MCA_", "OMPI_ALLOW_RUN_AS_ROOT", "PMIX_MCA_",
                                                  "OMPI_PREFIX"};
  constexpr std::array<std::string_view, 8> launchers{
      "OMPI_", "PMIX_", "PMI_", "PMI2_", "HYDI_", "MPI_LOCALRANKID=", "MPI_LOCALNRANKS=", "MPIRUN_"};
  constexpr std::array<std::string_view, 6> slurm{"SLURM_PROCID=",   "SLURM_LOCALID=", "SLURM_STEP",
                                                  "SLURM_TASK_PID=", "SLURM_NODEID=",  "SLURM_GTIDS="};
  if (startsWithAny(jobs) || startsWithAny(slurm)) return true;
  return startsWithAny(launchers) && !startsWithAny(users);
}

}  // namespace vdi::catalyst
