// The volume's time steps on all ranks' devices: the one shown, and the next one while it is uploaded. Not
// part of the library's interface.
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

/// Implements VdiGenerator's setBlocks, setNextBlocks and advance. Collective, except for const functions.
class TimeSteps {
 public:
  /// `comm` and `volume` must outlive it.
  TimeSteps(const comm::Communicator& comm, gpu::VolumeStore& volume) : comm_(comm), volume_(volume) {}

  void setBlocks(std::vector<Block> blocks, bool fillGhosts);
  void setNextBlocks(std::vector<Block> blocks, bool fillGhosts);
  void advance();

  const Scene& scene() const { return shown_.scene; }             // global
  std::size_t colors() const { return shown_.colors; }            // Block::colors; equal on all ranks
  const ScalarRange& scalarRange() const { return ranges_.own; }  // global
  /// The range of the values that the transfer function colours; global.
  const ScalarRange& coloredRange() const { return shown_.colors == 1 ? shown_.colored : ranges_.own; }
  /// The part of that range that nearly all values fill, if that is a small one (SamplingRate.h). Equal on
  /// all ranks. Not collective.
  std::optional<ScalarRange> crowdedPart() const { return vdi::crowdedPart(ranges_.own, shown_.probes); }
  /// The rate that automaticRate becomes with this transfer function and region; equal on all ranks. Not
  /// collective.
  double samplingRate(const TransferTable& table, const Region& region);
  /// Throws if the transfer function distinguishes values that floats cannot.
  void requireSpans(const TransferTable& table) const;
  /// Sets this rank's upload time, blocks and volume. Each upload time is reported once.
  void report(RankReport& report);

 private:
  struct Step {
    Scene scene;                // global
    std::vector<Probe> probes;  // global
    std::size_t colors = 0;     // global
    ScalarRange colored;        // global; of the values of one colour
    std::uint64_t blocks = 0;
    std::uint64_t bytes = 0;
    double uploadSeconds = 0.0;
    bool doubles = false;  // some of this rank's blocks are f64
  };
  /// Sends blocks by setBlocks or setNextBlocks of VolumeStore.
  Step send(std::vector<Block> blocks, bool fillGhosts,
            void (gpu::VolumeStore::*way)(std::span<const Block>, const Scene&));
  void show(Step step);
  void dropNext();

  const comm::Communicator& comm_;
  gpu::VolumeStore& volume_;
  Step shown_;
  FiniteRanges ranges_;  // global
  /// The last sampling rate requested for the shown step.
  struct Rate {
    TransferTable table;
    Region region;
    double samplesPerVoxel;
  };
  std::optional<Rate> rate_;
  std::optional<Step> next_;
};

}  // namespace vdi::detail
