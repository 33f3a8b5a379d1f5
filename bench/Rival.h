// Volume rendering composited by IceT, for comparison with VDIs of the same volume, camera and
// devices.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/ConvexRegions.h"
#include "bench/Frames.h"
#include "bench/IcetCompositor.h"
#include "bench/Timing.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Image.h"
#include "vdi/core/Scene.h"
#include "vdi/gpu/Device.h"
#include "vdi/pipeline/VdiGenerator.h"

namespace vdi::bench {

/// Figures on the root; times are ms, medians over the repeats.
struct RivalFigures {
  Spread frame;                 // on the root's host, from all ranks being ready to the picture
  double renderMs = 0.0;        // part of the frame: the ranks' own pictures; slowest rank
  double compositeMs = 0.0;     // part of the frame: IceT; slowest rank
  std::uint64_t bytesSent = 0;  // sent by IceT in one frame, sum over all ranks
  /// Time to make the ranks' volumes convex; nullopt: they were.
  std::optional<double> redistributeMs;
  std::uint64_t redistributedBytes = 0;  // sum over all ranks
  double maxDifference = 0.0;            // largest difference of a channel from our picture, in 1/255
};

/// All functions are collective. Each rank casts rays through its own blocks into a picture of
/// floats, with a generator of one rank that uses the whole scene's samples. IceT blends the
/// pictures in order of visibility. If planes don't separate the ranks' blocks, the blocks are
/// redistributed first.
class IcetRival {
 public:
  /// `handle` is MPI_Comm_c2f of the communicator's ranks. Throws Error{InvalidArgument} without
  /// IceT.
  IcetRival(std::shared_ptr<gpu::Device> device, comm::Communicator comm, int handle);

  /// Sets this rank's blocks, which are those of `generator`; `scene` is the generator's. Times
  /// `repeats` redistributions.
  void setBlocks(const std::vector<Block>& blocks, const Scene& scene, int repeats);
  /// Frees the device's memory.
  void dropBlocks();

  /// `ours` is the root's picture of the same input by VdiGenerator::renderVolume; other ranks' pictures are
  /// ignored.
  RivalFigures measure(ClockRaiser& clock, const FrameInput& input, int repeats,
                       const std::optional<Image>& ours);

 private:
  struct Timed {
    std::span<const glm::vec4> picture;  // the root's
    double renderMs = 0.0;
    double compositeMs = 0.0;
  };
  std::vector<Block> makeConvex(const std::vector<Block>& blocks, int repeats, double tolerance);
  Timed draw(const FrameInput& input, const PixelBox& drawn, const std::vector<int>& order);

  comm::Communicator comm_;
  IcetCompositor compositor_;
  VdiGenerator own_;  // generator of this rank alone
  std::optional<SeparatingPlanes> planes_;
  Box box_;  // bounds of this rank's blocks
  std::optional<Image> image_;
  RivalFigures redistribution_;  // the redistribution's figures only
};

std::string rivalLine(const RivalFigures& figures);
void addRival(nlohmann::json& row, const RivalFigures& figures);

}  // namespace vdi::bench
