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

/// A VDI that's being made (VdiGenerator::start). Movable. One that's never finished costs nothing but the
/// memory of its lists, until the second one after it is started.
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

/// Makes VDIs of distributed volumes. Collective throughout: every rank of the communicator makes one, with
/// its own device, and calls the same functions in the same order. When a call throws, it throws on every
/// rank (Communicator::agree), and the object stays usable.
class VdiGenerator {
 public:
  VdiGenerator(std::shared_ptr<gpu::Device> device, comm::Communicator comm,
               const GeneratorOptions& options = {});
  ~VdiGenerator();
  VdiGenerator(const VdiGenerator&) = delete;
  VdiGenerator& operator=(const VdiGenerator&) = delete;
  VdiGenerator(VdiGenerator&&) = delete;
  VdiGenerator& operator=(VdiGenerator&&) = delete;

  /// This rank's blocks, none included; the scalars are copied to the device before it returns. With
  /// `fillGhosts`, missing layers are exchanged first (comm/GhostExchange.h). Blocks of the same shapes reuse
  /// the device's memory. After a throw there are none.
  void setBlocks(std::vector<Block> blocks, bool fillGhosts = true);

  /// The next time step's blocks: sends them on their way to the device and returns, so that they get there
  /// while the frame of those that are shown is made. The scalars must stay as they are until advance, or
  /// until another call of this or of setBlocks, which drops them. Takes memory for a second volume, which
  /// the next setBlocks gives back. After a throw none are on their way.
  void setNextBlocks(std::vector<Block> blocks, bool fillGhosts = true);
  /// Shows them, once they're there. Throws what went wrong on their way, and Error{InvalidArgument} if there
  /// are none; then those stay that were shown.
  void advance();

  const Scene& scene() const;              // global
  const ScalarRange& scalarRange() const;  // global, finite values

  /// The VDI on rank 0, nullopt on the others. Its coloring has range and function; the caller, who knows the
  /// array, adds that. Camera, transfer function and settings must be equal on all ranks
  /// (Error{InvalidArgument} on all of them otherwise). A scene that's empty or out of sight gives a
  /// VDI with empty lists. Devices write to the VDI's memory; when it goes, the next frame's takes its place.
  std::optional<Vdi> generate(const Camera& camera, const TransferFunction& transferFunction,
                              const GenerateSettings& settings, const Progress& progress = {});

  /// The same in two parts, so that frames overlap. When `start` returns, this rank's lists are made, and the
  /// blocks, camera and function aren't needed any more: setBlocks and advance may follow. The VDI is still
  /// being composited and gathered, by the device and its copy engines. `finish` waits for it. To start the
  /// next frame before finishing the last one hides that time:
  ///
  ///     VdiFrame last = generator.start(...);
  ///     while (more) {
  ///       VdiFrame next = generator.start(...);
  ///       use(generator.finish(std::move(last)));
  ///       last = std::move(next);
  ///     }
  ///
  /// All in the calling thread: MPI needs no more than MPI_THREAD_FUNNELED. Frames are finished in any order,
  /// the same on all ranks, or never. Two are under way at most: a third `start` waits for the first one.
  /// When a `start` throws beyond its parameters, frames that aren't done fail with the same error.
  VdiFrame start(const Camera& camera, const TransferFunction& transferFunction,
                 const GenerateSettings& settings, const Progress& progress = {});
  /// The VDI on rank 0, nullopt on the others.
  std::optional<Vdi> finish(VdiFrame frame);

  /// The same VDI as a file (io/VdiFile.h). Each rank encodes its own lists and writes them there: none ever
  /// has the whole VDI, and a rank's host memory is bounded by its own lists. Ranks whose host doesn't have
  /// the folder send what they've encoded to rank 0, which holds a chunk of it at a time. The file is the one
  /// that io::writeVdi writes of what generate makes, byte by byte; as there, nobody sees half of it, and the
  /// old one stays if any rank fails. `path` and `stamp` are rank 0's, whatever the others pass. Throws
  /// Error{Io} on the rank that can't write, with the path as context. The result is equal on all ranks.
  WrittenVdi write(const std::filesystem::path& path, const Camera& camera,
                   const TransferFunction& transferFunction, const GenerateSettings& settings,
                   const TimeStamp& stamp = {}, const Progress& progress = {});

  /// The same VDI straight to a renderer, rank 0's; the others' are ignored and may be null. With one rank
  /// whose device the renderer has, lists stay on that device: nothing of the VDI comes to the host.
  /// Otherwise it's generate and setVdi. Returns when the lists are made; the next render waits for the rest.
  /// Throws Error{InvalidArgument} if rank 0 has no renderer. After a throw the renderer may have no VDI.
  void show(VdiRenderer* renderer, const Camera& camera, const TransferFunction& transferFunction,
            const GenerateSettings& settings, const Progress& progress = {});

  /// Plain ray casting of the distributed volume through the same samples: the ground truth, on rank 0.
  /// supersegments, algorithm and margin of the settings are ignored.
  std::optional<Image> renderVolume(const Camera& camera, const TransferFunction& transferFunction,
                                    const GenerateSettings& settings, const Progress& progress = {});

  /// Of the last generate, finish or renderVolume: all ranks' on rank 0, empty on the others.
  const std::vector<RankReport>& reports() const;
  const gpu::Device& device() const;
  const comm::Communicator& communicator() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi
