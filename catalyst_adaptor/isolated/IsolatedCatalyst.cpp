// The C interface for runs in processes of their own. It decides whether a run is one, checks arguments, and
// keeps the ranks together.
#include <mpi.h>

#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/FieldCalls.h"
#include "catalyst_adaptor/FieldEntries.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/Scripts.h"
#include "catalyst_adaptor/isolated/IsolatedRun.h"
#include "vdi/config/Run.h"
#include "vdi/core/Environment.h"
#include "vdi/io/Json.h"

struct vdi_catalyst : vdi::catalyst::FieldCalls {
  std::unique_ptr<vdi::catalyst::IsolatedRun> run;
  bool isJson = false;
};

namespace {

using vdi::catalyst::guarded;
using vdi::catalyst::IsolatedOptions;

std::optional<double> patienceFromEnvironment() {
  const std::optional<std::uint32_t> seconds = vdi::environmentCount("VDI_ISOLATION_PATIENCE", 0);
  return seconds ? std::optional<double>(*seconds) : std::nullopt;
}

/// The first rank's answer: how the run is isolated, if at all. `given` comes from the run's text; the
/// environment overrides it.
std::optional<vdi::config::RunIsolation> isolationOf(std::optional<vdi::config::RunIsolation> given) {
  const std::optional<std::string> wish = vdi::environmentText("VDI_ISOLATION");
  if (wish == "none") return std::nullopt;
  if (wish && *wish != "process" && *wish != "restart") vdi::refuseEnvironment("VDI_ISOLATION", *wish);
  if (wish && !given) given.emplace();
  if (!given) return std::nullopt;
  if (wish == "restart") given->restart = true;
  given->patience = patienceFromEnvironment().value_or(given->patience);
  return given;
}

/// Collective: gives all ranks the first rank's text.
int share(vdi_catalyst& self, std::string& text) {
  auto size = static_cast<int>(text.size());
  MPI_Bcast(&size, 1, MPI_INT, 0, self.comm);
  const int code = guarded(self, VDI_CATALYST_ENGINE, [&] { text.resize(static_cast<std::size_t>(size)); });
  if (code == VDI_CATALYST_OK) MPI_Bcast(text.data(), size, MPI_CHAR, 0, self.comm);
  return code;
}

/// Collective: the first rank's decision, which all ranks get.
class Decision {
 public:
  explicit Decision(vdi_catalyst& self) : self_(self) { MPI_Comm_rank(self.comm, &rank_); }

  /// The code of a failure, VDI_CATALYST_NOT_ISOLATED, or VDI_CATALYST_OK.
  int decide(const char* json, bool isJson, IsolatedOptions& options) {
    std::string text;
    std::string name;
    std::optional<vdi::config::RunIsolation> isolation;
    int code = guarded(self_, VDI_CATALYST_ENGINE, [&] {
      if (rank_ != 0) return;
      std::optional<vdi::config::Run> run;
      if (isJson) {
        // Another engine reports what's wrong with the text.
        run = readable(json, text, name);
        if (!run) return;
      }
      isolation = isolationOf(isJson ? run->isolation : std::nullopt);
      options.launcher = vdi::environmentText("VDI_ISOLATION_LAUNCHER").value_or("");
    });
    if (code != VDI_CATALYST_OK) return code;
    struct {
      int isIsolated;
      int restart;
      double patience;
    } answer{isolation ? 1 : 0, isolation && isolation->restart ? 1 : 0, isolation ? isolation->patience : 0};
    MPI_Bcast(&answer, sizeof answer, MPI_BYTE, 0, self_.comm);
    if (answer.isIsolated == 0) return VDI_CATALYST_NOT_ISOLATED;
    options.isolation = {answer.restart != 0, answer.patience};
    if (!isJson) return VDI_CATALYST_OK;
    code = share(self_, text);
    if (code != VDI_CATALYST_OK) return code;
    return guarded(self_, VDI_CATALYST_ENGINE,
                   [&] { options.run = vdi::config::parseRun(text, "the JSON text"); });
  }

 private:
  static std::optional<vdi::config::Run> readable(const char* json, std::string& text, std::string& name) {
    if (json == nullptr) return std::nullopt;
    try {
      const vdi::io::JsonLimits limits;
      vdi::config::RunText source = vdi::config::readRun({json, ::strnlen(json, limits.bytes + 1)});
      text = std::move(source.text);
      name = std::move(source.name);
      return vdi::config::parseRun(text, name);
    } catch (const std::bad_alloc&) {
      throw;  // the text may be sound, and ask for isolation
    } catch (const std::exception&) {
      return std::nullopt;
    }
  }

  vdi_catalyst& self_;
  int rank_ = 0;
};

/// `read` fills in the scripts or the text.
template <typename Read>
int initializeAny(int32_t fortran_communicator, const char* json, bool isJson, vdi_catalyst** catalyst,
                  Read read) {
  // Loader.c has checked that MPI runs and that the handle is a communicator's, and *catalyst is null.
  std::unique_ptr<vdi_catalyst> self;
  int code = vdi::catalyst::makeHandle(fortran_communicator, self);
  if (code != VDI_CATALYST_OK) return code;
  self->isJson = isJson;
  IsolatedOptions options;
  code = Decision(*self).decide(json, isJson, options);
  if (code == VDI_CATALYST_OK) code = guarded(*self, VDI_CATALYST_BAD_ARGUMENT, [&] { read(options); });
  if (code == VDI_CATALYST_OK) {
    code = guarded(*self, VDI_CATALYST_ENGINE, [&] {
      self->run = std::make_unique<vdi::catalyst::IsolatedRun>(*self, std::move(options));
    });
  }
  if (code == VDI_CATALYST_OK) code = self->run->start();
  if (code == VDI_CATALYST_OK) {
    *catalyst = self.release();
  } else {
    MPI_Comm_free(&self->comm);
  }
  return code;
}

int initializeJson(int32_t fortran_communicator, const char* json, vdi_catalyst** catalyst) {
  return initializeAny(fortran_communicator, json, true, catalyst, [&](IsolatedOptions& options) {
    if (json != nullptr) options.json = json;
  });
}

template <typename Given>
int initializeScripts(int32_t fortran_communicator, int32_t script_count, const Given* given,
                      vdi_catalyst** catalyst) {
  return initializeAny(fortran_communicator, nullptr, false, catalyst, [&](IsolatedOptions& options) {
    options.scripts = vdi::catalyst::scriptsOf(script_count, given);
  });
}

int initialize(int32_t fortran_communicator, int32_t script_count, const char* const* scripts,
               vdi_catalyst** catalyst) {
  return initializeScripts(fortran_communicator, script_count, scripts, catalyst);
}

int initializePipelines(int32_t fortran_communicator, int32_t script_count,
                        const vdi_catalyst_pipeline* scripts, vdi_catalyst** catalyst) {
  return initializeScripts(fortran_communicator, script_count, scripts, catalyst);
}

/// Throws if ParaView couldn't have the marks of the blocks' ghost cells.
void requireMarks(int32_t count, const vdi_catalyst_block* blocks) {
  for (int32_t i = 0; i < count; ++i) static_cast<void>(vdi::catalyst::newMarks(blocks[i]));
}

int setBlocks(vdi_catalyst* catalyst, int32_t count, const vdi_catalyst_block* blocks) {
  return vdi::catalyst::setBlocks(*catalyst, count, blocks, [&] {
    if (!catalyst->isJson) requireMarks(count, blocks);
  });
}

int wants(vdi_catalyst* catalyst, int64_t step, double time) {
  return catalyst->run->wants(step, time) ? 1 : 0;
}

int execute(vdi_catalyst* catalyst, int64_t step, double time) {
  return catalyst->run->execute(step, time);
}

vdi::catalyst::Parameters& parametersOf(vdi_catalyst& catalyst) {
  return catalyst.run->parameters();
}

int finalize(vdi_catalyst* catalyst) {
  const std::unique_ptr<vdi_catalyst> self(catalyst);
  const int code = self->run->finish();
  self->run.reset();
  MPI_Comm_free(&self->comm);
  return code;
}

using Entries = vdi::catalyst::FieldEntries<vdi_catalyst, parametersOf>;

}  // namespace

constinit const vdi_catalyst_functions VDI_CATALYST_ENGINE_FUNCTIONS = [] {
  vdi_catalyst_functions table = Entries::table();
  table.initialize = initialize;
  table.initialize_pipelines = initializePipelines;
  table.initialize_json = initializeJson;
  table.set_blocks = setBlocks;
  table.wants = wants;
  table.execute = execute;
  table.finalize = finalize;
  return table;
}();
