// A small interface to ParaView's in situ engine. Only this class depends on ParaView's version.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/Scripts.h"
#include "catalyst_adaptor/scripts/ScriptLog.h"

class vtkDataObject;

namespace vdi::catalyst {

/// A process has one engine, because ParaView can't be started twice. All functions are collective unless
/// their comments say otherwise, and except `check`.
class Engine {
 public:
  /// Whether this process has had an engine before, or other code has started ParaView's.
  static bool wasStarted();

  /// Not collective. The engine does nothing before `start`.
  Engine();
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Starts ParaView's engine. No other engine may have been started before. Scripts find `plugin`, the path
  /// of our plugin, as VDI_PLUGIN in os.environ. Throws std::runtime_error or std::bad_alloc if the engine
  /// doesn't start. If that happens on any rank, another call on all ranks continues where this one ended.
  /// For an engine that has started it does nothing.
  void start(int fortranCommunicator, const std::string& plugin);

  /// Whether the engine runs on the ranks of this communicator, in the same order, or hasn't been started.
  /// Not collective.
  bool runsOn(MPI_Comm comm) const;

  /// Throws std::runtime_error for a fault of a script that is visible before it runs: a missing file or
  /// plugin, or bad syntax.
  void check(const std::string& script);
  /// Loads our plugin. Call it before scripts run. Throws std::runtime_error if it can't be loaded.
  void loadPlugin();
  /// Takes the scripts, in place of others that `prepare` has taken. Not collective.
  void prepare(const std::vector<Script>& scripts);
  /// Adds the prepared scripts, which run at each step in this order.
  void add();

  /// Sets wanted[i] to 1 if a script does anything at step first + i, or may do so, and to 0 if not. The
  /// triggers by which scripts can refuse a step don't depend on the time. Not collective.
  void setWantedSteps(int first, std::span<std::uint8_t> wanted) const;

  /// The parameters that the simulation has declared. The scripts' extractors change their values, within
  /// `execute` alone.
  Parameters& parameters();

  /// Runs every script on `grid`, also those that failed before. Returns nullopt if all succeeded on this
  /// rank, else the reason of the failure here; that is "" if a script was stopped because of another rank.
  /// `step` >= 0.
  std::optional<std::string> execute(vtkDataObject* grid, int step, double time);

  /// Collects the frames of each later `execute` for takeFrames. Not collective.
  void collectFrames();
  /// The frames that the last `execute` has made, on the first rank, in their order. Other ranks get none.
  /// Not collective. Throws std::bad_alloc if there was no memory for one.
  std::vector<MadeFrame> takeFrames();

  /// Runs the scripts' catalyst_finalize. Only `forgetScripts` or the destructor may follow. Returns as
  /// `execute` does.
  std::optional<std::string> finish();
  /// Removes the scripts with all that they have made, and the parameters, so that another run can begin.
  void forgetScripts();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::catalyst
