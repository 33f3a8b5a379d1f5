// What whole frames take: each stage over all ranks, VDIs per second, and volume rendering of the same scene.
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

/// Over the ranks, milliseconds.
struct RankTimes {
  double slowest = 0.0;
  double mean = 0.0;
};

struct StageTimes {
  RankTimes wall;
  std::optional<RankTimes> device;  // without transfers; none: reports don't tell
};

/// In the order of a frame.
enum class FrameStage : std::size_t { Generate, Distribute, Composite, Gather };
inline constexpr std::size_t frameStages = 4;

/// What making a VDI takes. Medians over the repeats; the root's, others have zeros.
struct FrameFigures {
  int ranks = 1;
  Spread wall;  // ms on the root's host, from all ranks ready to the VDI there
  std::array<StageTimes, frameStages> stages;
  std::uint64_t subSupersegments = 0;                 // of all ranks, in the last frame
  std::uint64_t bytesSent = 0;                        // likewise
  Spread volumeRendering;                             // a picture by renderVolume; ms as `wall`
  std::array<StageTimes, frameStages> pictureStages;  // of these
  Spread shown;                                       // a VDI, and its picture on the root's host; likewise
  std::optional<double> vdisPerSecond;
  int orbitFrames = 0;  // that were made for vdisPerSecond

  /// What a log of pictures by renderVolume has.
  void takePictures(const FrameFigures& pictures);
  const StageTimes& stage(FrameStage which) const { return stages[static_cast<std::size_t>(which)]; }
};

/// Wall-clock milliseconds of a collective call, from when all ranks are ready.
template <typename Work>
double readyMs(const comm::Communicator& comm, Work work) {
  comm.barrier();
  return wallMs(std::move(work));
}

/// Collects the reports of repeated frames.
class FrameLog {
 public:
  /// `reports` are VdiGenerator::reports(): where they are empty nothing is noted.
  void add(double wallMs, const std::vector<RankReport>& reports);
  /// Of the last `repeats` frames that were added.
  FrameFigures figures(std::size_t repeats) const;

 private:
  struct Frame {
    double wallMs = 0.0;
    std::array<StageTimes, frameStages> stages;
  };
  std::vector<Frame> frames_;
  int ranks_ = 1;
  std::uint64_t subSupersegments_ = 0;
  std::uint64_t bytesSent_ = 0;
};

/// What a frame is made with.
struct FrameInput {
  Camera camera;
  TransferFunction function;
  GenerateSettings settings;
};

/// VDIs per second on the root's host, each started before the last one is finished: `frames` >= 1 of them
/// after two that don't count, on an orbit of 20 viewpoints around the focal point that begins at the
/// input's camera. Collective; other ranks' figures mean nothing.
double vdisPerSecond(VdiGenerator& generator, ClockRaiser& clock, const FrameInput& input, int frames);

/// From a camera to a picture of a VDI on the root's host (VdiGenerator::show), repeated after one that
/// doesn't count: milliseconds. The root's renderer is on `device`, the generator's. Collective.
Spread measureShown(VdiGenerator& generator, const std::shared_ptr<gpu::Device>& device, ClockRaiser& clock,
                    const FrameInput& input, int repeats);

/// Repeated frames and pictures, after one of each that doesn't count, and vdisPerSecond if `orbitFrames`
/// isn't 0; and measureShown. Collective.
FrameFigures measureFrames(VdiGenerator& generator, const std::shared_ptr<gpu::Device>& device,
                           ClockRaiser& clock, const FrameInput& input, int repeats, int orbitFrames);

/// Lines for a table: every stage, if there are several ranks, and the whole frame. With a line end each.
std::string stageLines(const FrameFigures& figures);

/// Adds what VDIs are made with to a row.
void addSettings(nlohmann::json& row, const GenerateSettings& settings);

/// Adds the figures to a row. null: not measured, or no such stage on one rank.
void addFigures(nlohmann::json& row, const FrameFigures& figures);

}  // namespace vdi::bench
