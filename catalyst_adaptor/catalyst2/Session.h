// One use of Catalyst, from initialize to finalize. It passes the simulation's data on to vdi_catalyst.h.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/Parameters.h"
#include "catalyst_adaptor/catalyst2/Grid.h"
#include "catalyst_adaptor/catalyst2/Node.h"
#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

/// The settings that catalyst_initialize is given.
struct Settings {
  struct Script {
    std::string file;
    std::vector<std::string> arguments;
  };
  std::vector<Script> scripts;
  std::optional<std::string> json;  // a run without a script
  std::string channel;              // "": "grid", or the only one
  std::vector<Parameter> parameters;
};

/// All calls are collective and return a code of vdi_catalyst.h, the same on all ranks. Rank 0 has reported
/// the reason of an error.
class Session {
 public:
  explicit Session(MPI_Comm comm);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  int initialize(const Node& params);
  int execute(const Node& params);
  /// Fills in catalyst/vdi.
  int results(conduit_node* params);
  int finalize();

 private:
  int start();
  int declareParameters();
  int handOver(std::int64_t step, const Node& params);
  void setStream(const Node& node);
  int setArrays();
  /// This rank's channel, if it has one. Throws std::invalid_argument for several without a choice.
  std::optional<Node> channelOf(const Node& params) const;
  double valueOf(const Parameter& parameter);

  Calls calls_;
  Settings settings_;
  vdi_catalyst* catalyst_ = nullptr;
  Grid grid_;
  bool handedOver_ = false;        // whether all ranks have handed over the current grid
  bool hasLostEngine_ = false;     // by the last vdi_catalyst_execute
  std::set<std::string> leftOut_;  // reported fields
  std::int64_t made_ = 0;          // number of steps
  std::int64_t failed_ = 0;
};

}  // namespace vdi::catalyst
