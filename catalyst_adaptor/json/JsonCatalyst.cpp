// The C interface for runs without a script. It checks arguments and keeps the ranks together.
#include <mpi.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/FieldCalls.h"
#include "catalyst_adaptor/FieldEntries.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/json/RunEngine.h"
#include "vdi/comm/Communicator.h"
#include "vdi/io/Json.h"

struct vdi_catalyst : vdi::catalyst::FieldCalls {
  std::unique_ptr<vdi::catalyst::RunEngine> engine;
  vdi::catalyst::Parameters parameters;
};

namespace {

using vdi::catalyst::guarded;
using vdi::catalyst::guardedTogether;
using vdi::catalyst::require;

/// Reads the run that rank 0 names. Rank 0 reads the files, and all others get their text.
class Reading {
 public:
  Reading(vdi_catalyst& self, const vdi::comm::Communicator& comm) : self_(self), comm_(comm) {}

  /// `isGoingOn`: the run's own earlier files stay.
  int read(const char* json, bool isGoingOn) {
    int code = guarded(self_, VDI_CATALYST_BAD_ARGUMENT,
                       [&] { require(comm_.rank() != 0 || json != nullptr, "no JSON given"); });
    if (code != VDI_CATALYST_OK) return code;
    code = guarded(self_, VDI_CATALYST_SCRIPT, [&] {
      if (comm_.rank() != 0) return;
      const vdi::io::JsonLimits limits;
      source_ = vdi::config::readRun({json, ::strnlen(json, limits.bytes + 1)});
    });
    if (code != VDI_CATALYST_OK) return code;
    code = guardedTogether(self_, VDI_CATALYST_ENGINE, [&] { share(source_.text); });
    if (code != VDI_CATALYST_OK) return code;
    code = guarded(self_, VDI_CATALYST_SCRIPT, [&] {
      run = vdi::config::parseRun(source_.text, source_.name);
      if (isGoingOn) run.existing = vdi::config::Existing::Continue;
    });
    if (code != VDI_CATALYST_OK) return code;
    for (vdi::config::RunField& field : run.fields) {
      if (code == VDI_CATALYST_OK && !field.colors.file.empty()) code = readMap(field.colors);
    }
    if (code != VDI_CATALYST_OK) return code;
    return guarded(self_, VDI_CATALYST_SCRIPT, [&] {
      if (comm_.rank() == 0) vdi::config::requireNothingInTheWay(run);
    });
  }

  vdi::config::Run run;

 private:
  int readMap(vdi::config::RunColors& colors) {
    std::string text;
    int code = guarded(self_, VDI_CATALYST_SCRIPT, [&] {
      if (comm_.rank() == 0) text = vdi::config::readColorsFile(colors, source_);
    });
    if (code != VDI_CATALYST_OK) return code;
    code = guardedTogether(self_, VDI_CATALYST_ENGINE, [&] { share(text); });
    if (code != VDI_CATALYST_OK) return code;
    return guarded(self_, VDI_CATALYST_SCRIPT,
                   [&] { colors.map = vdi::config::colorMapOf(text, colors.file, colors.name); });
  }
  /// Gives all ranks rank 0's text.
  void share(std::string& text) {
    text = comm_.broadcastText([&] { return std::move(text); }, 0);
  }

  vdi_catalyst& self_;
  const vdi::comm::Communicator& comm_;
  vdi::config::RunText source_;
};

/// The process that makes a run's frames: the simulation's, a separate one, or the successor of a separate
/// one.
enum class FrameMaker { Simulation, Process, NextProcess };

int start(vdi_catalyst& self, const char* json, FrameMaker maker) {
  std::optional<vdi::comm::Communicator> comm;
  int code = guardedTogether(self, VDI_CATALYST_ENGINE,
                             [&] { comm = vdi::comm::Communicator::fromMpi(MPI_Comm_c2f(self.comm)); });
  if (code != VDI_CATALYST_OK) return code;
  std::optional<Reading> reading;
  code = guarded(self, VDI_CATALYST_ENGINE, [&] { reading.emplace(self, *comm); });
  if (code == VDI_CATALYST_OK) code = reading->read(json, maker == FrameMaker::NextProcess);
  if (code != VDI_CATALYST_OK) return code;
  code = guarded(self, VDI_CATALYST_ENGINE, [&] {
    self.engine = std::make_unique<vdi::catalyst::RunEngine>(MPI_Comm_c2f(self.comm), std::move(*comm),
                                                             std::move(reading->run));
  });
  if (code != VDI_CATALYST_OK) return code;
  return guardedTogether(self, VDI_CATALYST_ENGINE,
                         [&] { self.engine->start(maker != FrameMaker::Simulation); });
}

int initializeAny(int32_t fortran_communicator, const char* json, FrameMaker maker, vdi_catalyst** catalyst) {
  // Loader.c has checked that MPI runs and that the handle is a communicator's, and *catalyst is null.
  std::unique_ptr<vdi_catalyst> self;
  int code = vdi::catalyst::makeHandle(fortran_communicator, self);
  if (code != VDI_CATALYST_OK) return code;
  code = start(*self, json, maker);
  if (code == VDI_CATALYST_OK) {
    *catalyst = self.release();
  } else {
    self->engine.reset();
    MPI_Comm_free(&self->comm);
  }
  return code;
}

int initializeJson(int32_t fortran_communicator, const char* json, vdi_catalyst** catalyst) {
  return initializeAny(fortran_communicator, json, FrameMaker::Simulation, catalyst);
}

int makeFramesOfJson(int32_t fortran_communicator, const char* json, int goesOn, vdi_catalyst** catalyst) {
  const FrameMaker maker = goesOn != 0 ? FrameMaker::NextProcess : FrameMaker::Process;
  return initializeAny(fortran_communicator, json, maker, catalyst);
}

void setClock(vdi_catalyst* catalyst, double seconds) {
  catalyst->engine->setClock(seconds);
}

void logLeftOut(vdi_catalyst* catalyst, int64_t step, double time) {
  catalyst->engine->logLeftOut(step, time);
}

int setBlocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  return vdi::catalyst::setBlocks(*catalyst, count, blocks);
}

int wants(vdi_catalyst* catalyst, int64_t step, double time) {
  int wanted = catalyst->engine->wants(step, time) ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &wanted, 1, MPI_INT, MPI_MAX, catalyst->comm);
  return wanted;
}

int execute(vdi_catalyst* catalyst, int64_t step, double time) {
  const auto start = std::chrono::steady_clock::now();
  int code =
      vdi::catalyst::checkStep(*catalyst, step, time, [&] { require(step >= 0, "steps count from 0"); });
  if (code != VDI_CATALYST_OK || !catalyst->engine->mayExecute(step, time)) return code;
  // All ranks have met by now.
  const double waited = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  code = guardedTogether(
      *catalyst, VDI_CATALYST_SCRIPT,
      [&] { catalyst->engine->execute(catalyst->fields, catalyst->parameters, step, time, waited); }, step);
  if (code == VDI_CATALYST_OK) catalyst->printed.clear();
  return code;
}

vdi::catalyst::Parameters& parametersOf(vdi_catalyst& catalyst) {
  return catalyst.parameters;
}

int finalize(vdi_catalyst* catalyst) {
  const std::unique_ptr<vdi_catalyst> self(catalyst);
  const int code = guardedTogether(*self, VDI_CATALYST_ENGINE, [&] { self->engine->finish(); });
  self->engine.reset();
  MPI_Comm_free(&self->comm);
  return code;
}

using Entries = vdi::catalyst::FieldEntries<vdi_catalyst, parametersOf>;

}  // namespace

constinit const vdi_catalyst_functions VDI_CATALYST_ENGINE_FUNCTIONS = [] {
  vdi_catalyst_functions table = Entries::table();
  table.initialize_json = initializeJson;
  table.make_frames_of_json = makeFramesOfJson;
  table.set_blocks = setBlocks;
  table.wants = wants;
  table.execute = execute;
  table.finalize = finalize;
  table.set_clock = setClock;
  table.log_left_out = logLeftOut;
  return table;
}();
