// Measures whole frames: each stage over all ranks, VDIs per second, and volume rendering of the
// same scene.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/Timing.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace vdi::bench {

/// The slowest rank's milliseconds, and the mean over all ranks.
struct RankTimes {
  double slowest = 0.0;
  double mean = 0.0;
};

struct StageTimes {
  RankTimes wall;
  std::optional<RankTimes> device;  // without transfers; nullopt: not reported
};

/// The stages, in the order of a frame.
enum class FrameStage : std::size_t { Generate, Distribute, Composite, Gather };
inline constexpr std::size_t frameStages = 4;

/// Figures of making a VDI: medians over the repeats, on the root; other ranks have zeros.
struct FrameFigures {
  int ranks = 1;
  Spread wall;  // ms, on the root's host, from all ranks being ready to the VDI
  std::array<StageTimes, frameStages> stages;
  std::uint64_t subSupersegments = 0;                 // sum over all ranks, in the last frame
  std::uint64_t bytesSent = 0;                        // sum over all ranks, in the last frame
  Spread volumeRendering;                             // a picture by renderVolume; ms, measured as `wall`
  std::array<StageTimes, frameStages> pictureStages;  // stages of these pictures
  Spread shown;  // a VDI, and its picture on the root's host; ms, measured as `wall`
  std::optional<double> vdisPerSecond;
  int orbitFrames = 0;  // frames made for vdisPerSecond

  /// Sets the figures of renderVolume's pictures from a log.
  void takePictures(const FrameFigures& pictures);
  const StageTimes& stage(FrameStage which) const { return stages[static_cast<std::size_t>(which)]; }
};

/// Wall-clock milliseconds of a collective call, from the moment when all ranks are ready.
template <typename Work>
double readyMs(const comm::Communicator& comm, Work work) {
  comm.barrier();
  return wallMs(std::move(work));
}

/// Collects the reports of repeated frames.
class FrameLog {
 public:
  /// `reports` are VdiGenerator::reports(). Ranks without reports collect nothing.
  void add(double wallMs, const std::vector<RankReport>& reports);
  /// Figures of the last `repeats` frames added.
  FrameFigures figures(std::size_t repeats) const;

 private:
  struct FrameTimes {
    double wallMs = 0.0;
    std::array<StageTimes, frameStages> stages;
  };
  std::vector<FrameTimes> frames_;
  int ranks_ = 1;
  std::uint64_t subSupersegments_ = 0;
  std::uint64_t bytesSent_ = 0;
};

/// The inputs of a frame.
struct FrameInput {
  Camera camera;
  TransferFunction function;
  GenerateSettings settings;
};

/// Returns VDIs per second on the root's host. Makes two warm-up frames and then `frames` >= 1
/// VDIs, each started before the former one is finished. The viewpoints lie on an orbit of 20
/// around the focal point, which begins at the input's camera. Collective; other ranks' results are
/// meaningless.
double vdisPerSecond(VdiGenerator& generator, ClockRaiser& clock, const FrameInput& input, int frames);

/// Measures the milliseconds from a camera to a picture of a VDI on the root's host
/// (VdiGenerator::show), after a warm-up. The root's renderer uses `device`, which is the
/// generator's. Collective.
Spread measureShown(VdiGenerator& generator, const std::shared_ptr<gpu::Device>& device, ClockRaiser& clock,
                    const FrameInput& input, int repeats);

/// Measures repeated frames and pictures, each after a warm-up; vdisPerSecond, if `orbitFrames` is
/// not 0; and measureShown. Collective.
FrameFigures measureFrames(VdiGenerator& generator, const std::shared_ptr<gpu::Device>& device,
                           ClockRaiser& clock, const FrameInput& input, int repeats, int orbitFrames);

/// Lines for a table, each with a line end: each stage, if there are several ranks, and the whole
/// frame.
std::string stageLines(const FrameFigures& figures);

/// Adds a VDI's settings to a row.
void addSettings(nlohmann::json& row, const GenerateSettings& settings);

/// Adds the figures to a row. A figure that wasn't measured is null, and so is a stage that one
/// rank lacks.
void addFigures(nlohmann::json& row, const FrameFigures& figures);

}  // namespace vdi::bench
