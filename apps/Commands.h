// The subcommands of `vdi`. Each adds its options to the program and returns what runs when it's chosen.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

#include "vdi/comm/Communicator.h"

namespace vdi::apps {

void addGenerate(CLI::App& app, const comm::Communicator& world);
void addRender(CLI::App& app);
void addCompare(CLI::App& app);
void addInfo(CLI::App& app);
void addBench(CLI::App& app);

}  // namespace vdi::apps
