// Makes VDIs of distributed volumes, one frame from end to end: blocks -> sub-VDI -> distribute -> composite
// -> gather (paper, section 5). VdiRenderer.h shows them.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Image.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/Device.h"
#include "vdi/pipeline/GeneratorOptions.h"
#include "vdi/pipeline/Reports.h"

namespace vdi {

class VdiRenderer;

/// A VDI under way (VdiGenerator::start). Movable. A frame that is never finished only costs the memory of
/// its lists, until the second start after its own.
class VdiFrame {
 public:
  ~VdiFrame();
  VdiFrame(VdiFrame&&) noexcept;
  VdiFrame& operator=(VdiFrame&&) noexcept;
  VdiFrame(const VdiFrame&) = delete;
  VdiFrame& operator=(const VdiFrame&) = delete;

 private:
  friend class VdiGenerator;
  struct State;
  explicit VdiFrame(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

/// Makes VDIs of distributed volumes. Each rank of the communicator has a generator with its own device. All
/// functions but the const ones are collective, constructor and destructor included: each rank calls the same
/// ones in the same order, from one thread at a time. When a call throws, it throws on every rank. If only
/// some ranks fail, they throw their own errors, and the others Error{RemoteRank}. The object stays usable
/// unless the device is lost (Device::isLost).
///
/// Any of these functions may throw Error{OutOfMemory}, Error{DeviceFailure} or Error{Communication}.
class VdiGenerator {
 public:
  /// Keeps `device` alive, which is not null, and takes `comm`. Reads no environment variables; for those,
  /// pass requestFromEnvironment to Device::create, and generatorOptionsFromEnvironment here.
  VdiGenerator(std::shared_ptr<gpu::Device> device, comm::Communicator comm,
               const GeneratorOptions& options = {});
  ~VdiGenerator();
  VdiGenerator(const VdiGenerator&) = delete;
  VdiGenerator& operator=(const VdiGenerator&) = delete;
  VdiGenerator(VdiGenerator&&) = delete;
  VdiGenerator& operator=(VdiGenerator&&) = delete;

  /// Sets this rank's blocks, which may be none; copies the scalars to the device before it returns. Points
  /// of all ranks that lie in one plane are shown as a sheet one spacing thick. `fillGhosts` first fetches
  /// the layers around blocks from their neighbours, of any rank. Blocks of the same shapes reuse device
  /// memory. Throws Error{InvalidArgument} for blocks that validate(blocks) rejects, that overlap, or whose
  /// values are all too small for the device. After a throw, no blocks are set.
  void setBlocks(std::vector<Block> blocks, bool fillGhosts = true);

  /// Starts to send the next time step's blocks to the device and returns, so that they arrive while frames
  /// of the current blocks are made. The scalars must stay unchanged until advance, or until another call of
  /// this or of setBlocks, which drops them. Takes memory for a second volume, which the next setBlocks gives
  /// back. After a throw, no upload is pending.
  void setNextBlocks(std::vector<Block> blocks, bool fillGhosts = true);
  /// Waits for the next blocks and shows them. Throws the error that stopped them, and Error{InvalidArgument}
  /// if no upload is pending; then the current blocks stay.
  void advance();

  const Scene& scene() const;  // global
  /// The global range of finite values that blocks own. Ghost layers don't count, nor do values that finer
  /// blocks cover.
  const ScalarRange& scalarRange() const;
  /// The global range of the values that transfer functions colour: scalarRange(), unless blocks have one
  /// value for colours beside that for opacities (Block::colors).
  const ScalarRange& coloredRange() const;
  /// The part of that range that nearly all values fill, if it is less than a 256th of it,
  /// so that colours over the whole range would tell few values apart. Equal on all ranks.
  std::optional<ScalarRange> crowdedPart() const;

  /// Returns the VDI on rank 0, nullopt on the others. Its coloring has range and function; the caller knows
  /// the array and adds it. Camera, transfer function and settings must be equal on all ranks (otherwise all
  /// throw Error{InvalidArgument}). A scene that is empty or out of sight gives a VDI with empty lists.
  /// Devices write to the VDI's memory; once it is freed, the next frame reuses it.
  ///
  /// All functions that make frames throw Error{InvalidArgument} also for settings, transfer functions and
  /// cameras that are invalid, for blend modes other than Composite (renderVolume has all), for rays of too
  /// many samples (depthLattice), for a camera so far away that floats can't tell samples apart, and for f64
  /// values whose range is too large for the transfer function's. They throw Error{Cancelled} if a rank's
  /// `progress` returned false.
  std::optional<Vdi> generate(const Camera& camera, const TransferFunction& transferFunction,
                              const GenerateSettings& settings, const Progress& progress = {});

  /// Does the work of generate in two parts, so that frames overlap. When `start` returns, this rank's lists
  /// are made, and the blocks, camera and function are no longer needed: setBlocks and advance may follow.
  /// Devices and copy engines still composite and gather the VDI; `finish` waits for it. Starting the next
  /// frame before finishing the last one hides that time:
  ///
  ///     VdiFrame last = generator.start(...);
  ///     while (more) {
  ///       VdiFrame next = generator.start(...);
  ///       use(generator.finish(std::move(last)));
  ///       last = std::move(next);
  ///     }
  ///
  /// All calls come from one thread: MPI needs no more than MPI_THREAD_FUNNELED. Frames may be finished in
  /// any order, the same on all ranks, or never. At most two are under way: a third `start` waits for the
  /// first one. When `start` throws for a reason other than its arguments, unfinished frames fail with the
  /// same error.
  VdiFrame start(const Camera& camera, const TransferFunction& transferFunction,
                 const GenerateSettings& settings, const Progress& progress = {});
  /// Waits for the frame. Returns the VDI on rank 0, nullopt on the others. Throws Error{InvalidArgument} if
  /// the frame was moved from, another generator started it, or its generator no longer exists.
  std::optional<Vdi> finish(VdiFrame frame);

  /// Writes the VDI of generate to a file (VdiFile.h). Each rank encodes and writes its own lists: no rank
  /// ever has the whole VDI, and a rank's host memory is bounded by its own lists. Ranks whose host lacks the
  /// folder send their encoded lists to rank 0, which holds one chunk of them at a time. The file equals that
  /// of io::writeVdi byte for byte. No reader sees an incomplete file, and if any rank fails, the old file
  /// stays. `path` and `stamp` are rank 0's; other ranks' are ignored. Throws Error{Io} on the rank that
  /// cannot write, with the path as context. The result is equal on all ranks.
  WrittenVdi write(const std::filesystem::path& path, const Camera& camera,
                   const TransferFunction& transferFunction, const GenerateSettings& settings,
                   const TimeStamp& stamp = {}, const Progress& progress = {});

  /// Hands the VDI of generate to a renderer on rank 0; other ranks' are ignored and may be null. With one
  /// rank whose device the renderer uses, lists stay on that device: no part of the VDI reaches the host.
  /// Otherwise it equals generate and setVdi. Returns when the lists are made; the next render waits for the
  /// rest. Throws Error{InvalidArgument} if rank 0 has no renderer. After a throw the renderer may have no
  /// VDI.
  void show(VdiRenderer* renderer, const Camera& camera, const TransferFunction& transferFunction,
            const GenerateSettings& settings, const Progress& progress = {});

  /// Plain ray casting of the distributed volume through the same samples: the ground truth. Returns a
  /// picture of the settings' width x height, premultiplied RGBA with depth, on rank 0, nullopt on the
  /// others. Ignores the settings' supersegments, algorithm and margin, and supports all blend modes.
  std::optional<Image> renderVolume(const Camera& camera, const TransferFunction& transferFunction,
                                    const GenerateSettings& settings, const Progress& progress = {});

  /// Reports of the last frame that was completed, by any of these functions: on rank 0 all ranks', by rank;
  /// none on the others, and none before the first frame.
  const std::vector<RankReport>& reports() const;
  const gpu::Device& device() const;
  const comm::Communicator& communicator() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi
