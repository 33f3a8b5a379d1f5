// The subcommands of `vdi`. Each adds its options to the program. Selecting it on the command line
// sets the job, which runs after the whole command line is parsed.
#pragma once

#include <functional>

#include "vdi/comm/Communicator.h"

namespace CLI {
class App;
}

namespace vdi::apps {

struct Job {
  std::function<void(const comm::Communicator& world)> run;
  bool collective = false;  // may run on several ranks, which all call it
};

void addGenerate(CLI::App& app, Job& job);
void addRender(CLI::App& app, Job& job);
void addExport(CLI::App& app, Job& job);
void addServe(CLI::App& app, Job& job);
void addReceive(CLI::App& app, Job& job);
void addCompare(CLI::App& app, Job& job);
void addCheck(CLI::App& app, Job& job);
void addLog(CLI::App& app, Job& job);
void addInfo(CLI::App& app, Job& job);

}  // namespace vdi::apps
