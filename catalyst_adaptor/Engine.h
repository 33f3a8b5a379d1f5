// ParaView's in situ engine behind a small interface: the only place that depends on its version.
#pragma once

#include <mpi.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "catalyst_adaptor/Parameters.h"

class vtkDataObject;

namespace vdi::catalyst {

/// One a process: ParaView can't be started twice. Collective throughout, but for check.
class Engine {
 public:
  /// Whether there was one before in this process, or ParaView's engine was started by others.
  static bool wasStarted();

  /// Scripts find `plugin`, the path of our plugin, as VDI_PLUGIN in os.environ. Throws std::runtime_error
  /// if the engine doesn't start. None may have been started before.
  Engine(int fortranCommunicator, const std::string& plugin);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Whether it runs on the ranks of this communicator, in the same order. Not collective.
  bool runsOn(MPI_Comm comm) const;

  /// Throws std::runtime_error with what can be told to be wrong with a script before it runs: a file or a
  /// plugin that's missing, bad syntax.
  void check(const std::string& script);
  /// Loads our plugin, before scripts run. Throws std::runtime_error if it can't be loaded.
  void loadPlugin();
  /// To be run at each step, in that order.
  void add(const std::vector<std::string>& scripts);

  /// Whether a script does anything at this step, or may. Not collective.
  bool wants(int step, double time) const;

  /// What the simulation has declared. Scripts' extractors change values, in execute alone.
  Parameters& parameters();

  /// Runs every script on `grid`, also those that failed before. nullopt if all went well on this rank, else
  /// what went wrong here; "" where a script was stopped because of another rank. `step` >= 0.
  std::optional<std::string> execute(vtkDataObject* grid, int step, double time);

  /// Runs the scripts' catalyst_finalize, after which only the destructor may follow. Returns as execute
  /// does.
  std::optional<std::string> finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::catalyst
