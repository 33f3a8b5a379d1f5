// The subcommand `vdi bench`.
#pragma once

#include "apps/Commands.h"

namespace vdi::bench {

void addBench(CLI::App& app, apps::Job& job);

}  // namespace vdi::bench
