// The volume's time steps on all ranks' devices: one that's shown, and the next one on its way. Not part of
// the library's interface.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/SamplingRate.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/gpu/VolumeStore.h"
#include "vdi/pipeline/Reports.h"

namespace vdi::detail {

/// VdiGenerator's setBlocks, setNextBlocks and advance say what these do. Collective, but for what is const.
class TimeSteps {
 public:
  /// Both must outlive it.
  TimeSteps(const comm::Communicator& comm, gpu::VolumeStore& volume) : comm_(comm), volume_(volume) {}

  void setBlocks(std::vector<Block> blocks, bool fillGhosts);
  void setNextBlocks(std::vector<Block> blocks, bool fillGhosts);
  void advance();

  const Scene& scene() const { return shown_.scene; }        // global
  const ScalarRange& scalarRange() const { return range_; }  // global
  /// What automaticRate means for that transfer function and region: the same on all ranks. Not collective.
  double samplingRate(const TransferTable& table, const Region& region);
  /// Throws where floats can't tell values apart that the transfer function does.
  void requireSpans(const TransferTable& table) const;
  /// Of this rank's part. The seconds are told once.
  void report(RankReport& report);

 private:
  struct Step {
    Scene scene;                // global
    std::vector<Probe> probes;  // global
    std::uint64_t blocks = 0;
    std::uint64_t bytes = 0;
    double uploadSeconds = 0.0;
    bool doubles = false;  // some of this rank's are f64
  };
  /// By one of VolumeStore's ways.
  Step send(std::vector<Block> blocks, bool fillGhosts,
            void (gpu::VolumeStore::*way)(std::span<const Block>, const Scene&));
  void show(Step step);
  void dropNext();

  const comm::Communicator& comm_;
  gpu::VolumeStore& volume_;
  Step shown_;
  ScalarRange range_;
  /// Of the shown step: the last one that was asked for.
  struct Rate {
    TransferTable table;
    Region region;
    double samplesPerVoxel;
  };
  std::optional<Rate> rate_;
  std::optional<Step> next_;
};

}  // namespace vdi::detail
