// The C interface for scripts. It starts ParaView's engine, keeps the ranks together, and shows scripts the
// blocks and arrays as a VtkGrid.
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "catalyst_adaptor/Deposits.h"
#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/FieldCalls.h"
#include "catalyst_adaptor/FieldEntries.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/Scripts.h"
#include "catalyst_adaptor/scripts/Engine.h"
#include "catalyst_adaptor/scripts/ScriptEnvironment.h"
#include "catalyst_adaptor/scripts/ScriptLog.h"
#include "catalyst_adaptor/scripts/VtkGrid.h"

struct vdi_catalyst : vdi::catalyst::FieldCalls {
  std::unique_ptr<vdi::catalyst::Engine> engine;
  std::unique_ptr<vdi::catalyst::VtkGrid> grid;           // null: no blocks were given
  std::optional<vdi::catalyst::DeviceDeposits> deposits;  // present once there are particles
  bool isLogged = false;                                  // the same on all ranks
  std::unique_ptr<vdi::catalyst::ScriptLog> log;          // the first rank's
};

namespace {

using vdi::catalyst::guarded;
using vdi::catalyst::guardedTogether;
using vdi::catalyst::isStep;
using vdi::catalyst::PythonLock;
using vdi::catalyst::requireEqual;
using vdi::catalyst::Script;
using vdi::catalyst::ScriptLog;
using vdi::catalyst::scriptsOf;
using Clock = std::chrono::steady_clock;

/// An engine without a run: its vdi_catalyst_initialize failed after its start, for example because of a
/// script, or vdi_catalyst_end_run has kept it. The next initialising takes it, because ParaView starts once
/// in a process. It is never deleted: that needs MPI, which is gone at the process's end.
vdi::catalyst::Engine*& spareEngine() {
  static vdi::catalyst::Engine* engine = nullptr;
  return engine;
}

/// Takes the spare engine or a new one. All ranks check whether they can before any of them starts, because
/// the others would wait for a rank that doesn't.
int takeEngine(vdi_catalyst& self) {
  using vdi::catalyst::Engine;
  std::string plugin;
  std::unique_ptr<Engine> fresh;
  const int code = guarded(self, VDI_CATALYST_ENGINE, [&] {
    if (spareEngine() != nullptr ? !spareEngine()->runsOn(self.comm) : Engine::wasStarted()) {
      throw std::runtime_error(spareEngine() != nullptr
                                   ? "ParaView was started before in this process, on another communicator"
                                   : "ParaView's in situ engine starts only once in a process");
    }
    plugin = vdi::catalyst::pluginFile();
    vdi::catalyst::sharePython();
    if (spareEngine() == nullptr) fresh = std::make_unique<Engine>();
  });
  if (code != VDI_CATALYST_OK) return code;
  self.engine = fresh ? std::move(fresh) : std::unique_ptr<Engine>(std::exchange(spareEngine(), nullptr));
  return guarded(self, VDI_CATALYST_ENGINE, [&] { self.engine->start(MPI_Comm_c2f(self.comm), plugin); });
}

void sayIfNothingIsMade(const vdi_catalyst& self, const std::vector<Script>& scripts) {
  int rank = 0;
  MPI_Comm_rank(self.comm, &rank);
  if (rank == 0 && scripts.empty())
    std::fprintf(stderr, "vdi_catalyst: no scripts were given, so no step will make anything\n");
}

/// The process that makes a run's frames: the simulation's, or a separate one.
enum class FrameMaker { Simulation, Process };

/// Opens the log that the first rank's VDI_LOG names.
int openLog(vdi_catalyst& self, const std::vector<Script>& scripts, FrameMaker maker) {
  int rank = 0;
  MPI_Comm_rank(self.comm, &rank);
  const int code = guarded(self, VDI_CATALYST_SCRIPT, [&] {
    if (rank != 0) return;
    const std::optional<vdi::runlog::LogFiles> files = ScriptLog::filesFromEnvironment();
    if (!files) return;
    vdi::runlog::RunStart start;
    start.unixTime = std::time(nullptr);
    start.isIsolated = maker == FrameMaker::Process;
    MPI_Comm_size(self.comm, &start.ranks);
    for (const Script& script : scripts) start.scripts.push_back(script.file);
    self.log = std::make_unique<ScriptLog>(*files, start);
    self.engine->collectFrames();
  });
  if (code != VDI_CATALYST_OK) return code;
  int isLogged = self.log ? 1 : 0;
  MPI_Bcast(&isLogged, 1, MPI_INT, 0, self.comm);
  self.isLogged = isLogged != 0;
  return code;
}

/// Collective: logs a step that has ended with `code` after this rank has waited for others. Returns the
/// step's code: a line that can't be written fails a step.
int logStep(vdi_catalyst& self, const ScriptLog::Step& step, double waitedMilliseconds, int code) {
  double* const waits = self.log ? self.log->waits().data() : nullptr;
  MPI_Gather(&waitedMilliseconds, 1, MPI_DOUBLE, waits, 1, MPI_DOUBLE, 0, self.comm);
  if (code == VDI_CATALYST_OK) {
    return guarded(
        self, VDI_CATALYST_SCRIPT,
        [&] {
          if (self.log) self.log->add(step, self.engine->takeFrames(), "");
        },
        step.number);
  }
  if (!self.log) return code;
  try {  // the step's own error stays the one that is reported
    self.log->add(step, self.engine->takeFrames(), self.error);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vdi_catalyst: step %lld: %s\n", static_cast<long long>(step.number), error.what());
  }
  return code;
}

/// As Engine::setWantedSteps, for all ranks' scripts, and 0 for numbers that aren't steps.
void setWantedSteps(const vdi_catalyst& self, std::int64_t first, std::span<std::uint8_t> wanted) {
  std::ranges::fill(wanted, std::uint8_t{0});
  if (isStep(first)) {
    const auto steps = static_cast<std::uint64_t>(std::numeric_limits<int>::max() - first) + 1;
    self.engine->setWantedSteps(static_cast<int>(first),
                                wanted.first(std::min<std::uint64_t>(wanted.size(), steps)));
  }
  MPI_Allreduce(MPI_IN_PLACE, wanted.data(), static_cast<int>(wanted.size()), MPI_UINT8_T, MPI_MAX,
                self.comm);
}

bool isWanted(const vdi_catalyst& self, std::int64_t step) {
  std::uint8_t wanted = 0;
  setWantedSteps(self, step, {&wanted, 1});
  return wanted != 0;
}

/// Makes values readable, and the arrays of all particles, if a script will do anything at the step.
int fetchIfWanted(vdi_catalyst& self, std::int64_t step) {
  if (!isWanted(self, step)) return VDI_CATALYST_OK;
  const int code = guarded(
      self, VDI_CATALYST_SCRIPT, [&] { self.fields.fetchArrays(); }, step);
  if (code != VDI_CATALYST_OK || self.fields.particles().empty()) return code;
  return guardedTogether(
      self, VDI_CATALYST_SCRIPT,
      [&] {
        if (!self.deposits) self.deposits.emplace(MPI_Comm_c2f(self.comm));
        self.deposits->make(self.fields, step);
      },
      step);
}

/// `given`: the files, with or without arguments.
template <typename Given>
int initializeAny(int32_t fortran_communicator, int32_t script_count, const Given* given, FrameMaker maker,
                  vdi_catalyst** catalyst) {
  const PythonLock lock;
  // Loader.c has checked that MPI runs and that the handle is a communicator's, and *catalyst is null.
  std::unique_ptr<vdi_catalyst> self;
  int code = vdi::catalyst::makeHandle(fortran_communicator, self);
  if (code != VDI_CATALYST_OK) return code;
  std::vector<Script> scripts;
  code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] { scripts = scriptsOf(script_count, given); });
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] {
      requireEqual(self->comm, script_count, "the ranks give different numbers of scripts");
    });
  }
  if (code == VDI_CATALYST_OK) code = takeEngine(*self);
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_SCRIPT, [&] {
      for (const Script& script : scripts) self->engine->check(script.file);
      self->engine->prepare(scripts);
    });
  }
  if (code == VDI_CATALYST_OK)
    code = guarded(*self, VDI_CATALYST_ENGINE, [&] { self->engine->loadPlugin(); });
  if (code == VDI_CATALYST_OK) code = openLog(*self, scripts, maker);
  if (code == VDI_CATALYST_OK) code = guarded(*self, VDI_CATALYST_SCRIPT, [&] { self->engine->add(); });
  if (code != VDI_CATALYST_OK) {
    if (self->engine) spareEngine() = self->engine.release();
    MPI_Comm_free(&self->comm);
    return code;
  }
  sayIfNothingIsMade(*self, scripts);
  *catalyst = self.release();
  return VDI_CATALYST_OK;
}

int initialize(int32_t fortran_communicator, int32_t script_count, const char* const* scripts,
               vdi_catalyst** catalyst) {
  return initializeAny(fortran_communicator, script_count, scripts, FrameMaker::Simulation, catalyst);
}

int initializePipelines(int32_t fortran_communicator, int32_t script_count,
                        const vdi_catalyst_pipeline* scripts, vdi_catalyst** catalyst) {
  return initializeAny(fortran_communicator, script_count, scripts, FrameMaker::Simulation, catalyst);
}

int makeFramesOfPipelines(int32_t fortran_communicator, int32_t script_count,
                          const vdi_catalyst_pipeline* scripts, vdi_catalyst** catalyst) {
  return initializeAny(fortran_communicator, script_count, scripts, FrameMaker::Process, catalyst);
}

int setBlocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  const PythonLock lock;
  std::unique_ptr<vdi::catalyst::VtkGrid> grid;
  const int code = vdi::catalyst::setBlocks(*catalyst, count, blocks, [&] {
    grid = std::make_unique<vdi::catalyst::VtkGrid>(std::span(blocks, static_cast<std::size_t>(count)));
  });
  if (code == VDI_CATALYST_OK) catalyst->grid = std::move(grid);
  return code;
}

int wants(vdi_catalyst* catalyst, int64_t step, double /*time*/) {
  const PythonLock lock;
  return isWanted(*catalyst, step) ? 1 : 0;
}

void setWantedSteps(vdi_catalyst* catalyst, int64_t first, int32_t count, std::uint8_t* wanted) {
  const PythonLock lock;
  setWantedSteps(*catalyst, first, {wanted, static_cast<std::size_t>(count)});
}

/// Runs the scripts on the step's values.
int runScripts(vdi_catalyst& self, int64_t step, double time) {
  int code = fetchIfWanted(self, step);
  if (code != VDI_CATALYST_OK) return code;
  code = guarded(
      self, VDI_CATALYST_ENGINE, [&] { self.grid->update(self.fields); }, step);
  if (code != VDI_CATALYST_OK) return code;
  return guarded(
      self, VDI_CATALYST_SCRIPT,
      [&] { return self.engine->execute(&self.grid->data(), static_cast<int>(step), time); }, step);
}

int execute(vdi_catalyst* catalyst, int64_t step, double time) {
  const PythonLock lock;
  const auto begin = Clock::now();
  int code = vdi::catalyst::checkStep(*catalyst, step, time, [&] { vdi::catalyst::requireStep(step); });
  if (code != VDI_CATALYST_OK) return code;
  // All ranks have met by now.
  const std::chrono::duration<double, std::milli> waited = Clock::now() - begin;
  code = runScripts(*catalyst, step, time);
  if (catalyst->isLogged) code = logStep(*catalyst, {step, time, begin}, waited.count(), code);
  if (code == VDI_CATALYST_OK) catalyst->printed.clear();
  return code;
}

void logLeftOut(vdi_catalyst* catalyst, int64_t step, double time) {
  if (!catalyst->log) return;
  try {
    catalyst->log->addLeftOut(step, time);
  } catch (const std::exception& error) {  // the other ranks don't know of it, and no step fails
    std::fprintf(stderr, "vdi_catalyst: step %lld: %s\n", static_cast<long long>(step), error.what());
  }
}

vdi::catalyst::Parameters& parametersOf(vdi_catalyst& catalyst) {
  return catalyst.engine->parameters();
}

enum class ParaViewAfterwards { Ends, Stays };

int end(vdi_catalyst* catalyst, ParaViewAfterwards paraView) {
  const PythonLock lock;
  const std::unique_ptr<vdi_catalyst> self(catalyst);
  int code = guarded(*self, VDI_CATALYST_SCRIPT, [&] { return self->engine->finish(); });
  if (self->isLogged) {
    const int logged = guarded(*self, VDI_CATALYST_ENGINE, [&] {
      if (self->log) std::fprintf(stderr, "vdi_catalyst: %s\n", self->log->finish().c_str());
    });
    if (code == VDI_CATALYST_OK) code = logged;
  }
  self->grid.reset();
  self->deposits.reset();
  const int ended = guarded(*self, VDI_CATALYST_ENGINE, [&] {
    if (paraView == ParaViewAfterwards::Ends) {
      self->engine.reset();
    } else {
      self->engine->forgetScripts();
    }
  });
  if (self->engine) spareEngine() = self->engine.release();
  if (code == VDI_CATALYST_OK) code = ended;
  MPI_Comm_free(&self->comm);
  return code;
}

int finalize(vdi_catalyst* catalyst) {
  return end(catalyst, ParaViewAfterwards::Ends);
}

int endRun(vdi_catalyst* catalyst) {
  return end(catalyst, ParaViewAfterwards::Stays);
}

using Entries = vdi::catalyst::FieldEntries<vdi_catalyst, parametersOf, PythonLock>;

}  // namespace

constinit const vdi_catalyst_functions VDI_CATALYST_ENGINE_FUNCTIONS = [] {
  vdi_catalyst_functions table = Entries::table();
  table.initialize = initialize;
  table.initialize_pipelines = initializePipelines;
  table.make_frames_of_pipelines = makeFramesOfPipelines;
  table.set_blocks = setBlocks;
  table.wants = wants;
  table.wanted_steps = setWantedSteps;
  table.execute = execute;
  table.finalize = finalize;
  table.end_run = endRun;
  table.log_left_out = logLeftOut;
  return table;
}();
