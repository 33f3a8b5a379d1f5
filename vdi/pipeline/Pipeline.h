// One frame from end to end: blocks -> sub-VDI -> distribute -> composite -> gather -> VDI (paper, section
// 5). The only place where gpu, comm and io meet; plugin, adaptor and command line call nothing below it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdi/comm/Communicator.h"
#include "vdi/core/Block.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Image.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/Device.h"

namespace vdi {

namespace detail {
class VdiLoader;
}

/// Wall-clock seconds and bytes of one rank in the last frame.
struct RankReport {
  double uploadSeconds = 0.0;          // of setBlocks, or setNextBlocks and advance, since the last frame
  double generateSeconds = 0.0;        // casting and segmenting, transfers included
  double generateDeviceSeconds = 0.0;  // of these, the device's work without transfers
  double countSeconds = 0.0;  // of these, the first step: bisection's search or the counting of pre-segments
  double writeSeconds = 0.0;  // and the second
  double distributeSeconds = 0.0;
  double compositeSeconds = 0.0;
  double compositeDeviceSeconds = 0.0;  // of these, the device's work, and the copying of what was received
  double gatherSeconds = 0.0;
  double outputSeconds = 0.0;  // of write, instead of the gather: downloading, encoding and writing
  std::uint64_t blocks = 0;
  std::uint64_t volumeBytes = 0;
  std::uint64_t subSupersegments = 0;
  std::uint64_t bytesSent = 0;
  std::uint64_t bytesWritten = 0;   // of write: into the file, by this rank
  std::uint64_t deviceBytes = 0;    // device memory held
  std::uint64_t hostPeakBytes = 0;  // the most host memory that the process has had, shared one included
};

/// A file that VdiGenerator::write has made.
struct WrittenVdi {
  std::uint64_t supersegments = 0;
  std::uint64_t bytes = 0;
};

/// What a VDI's file says of the simulation.
struct TimeStamp {
  double time = 0.0;
  std::uint64_t step = 0;
};

/// Called on every rank with the share done, 0 .. 1; returns false to ask for an abort, which all ranks then
/// obey together at the next stage (Error{Cancelled}).
using Progress = std::function<bool(double)>;

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

class VdiRenderer;

/// Makes VDIs of distributed volumes. Collective throughout: every rank of the communicator makes one, with
/// its own device, and calls the same functions in the same order. When a call throws, it throws on every
/// rank (Communicator::agree), and the object stays usable.
class VdiGenerator {
 public:
  VdiGenerator(std::shared_ptr<gpu::Device> device, comm::Communicator comm);
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

  /// The VDI on rank 0, nullopt on the others. Camera, transfer function and settings must be equal on all
  /// ranks (Error{InvalidArgument} on all of them otherwise). A scene that's empty or out of sight gives a
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

/// Renders a VDI from anywhere, on one device. Not collective.
class VdiRenderer {
 public:
  explicit VdiRenderer(std::shared_ptr<gpu::Device> device);
  ~VdiRenderer();
  VdiRenderer(const VdiRenderer&) = delete;
  VdiRenderer& operator=(const VdiRenderer&) = delete;
  VdiRenderer(VdiRenderer&&) = delete;
  VdiRenderer& operator=(VdiRenderer&&) = delete;

  /// Copies; `vdi` isn't needed afterwards. Upload and set-up go on on the device while this returns, the
  /// next render waits for them there (VDIs of up to 128 MiB; larger ones wait for all but their last part).
  void setVdi(const Vdi& vdi);
  /// Double buffering: the same into buffers of its own, while renders go on with the VDI that is shown. On
  /// any one thread; not beside setVdi, showPrepared or another of this. Returns when the VDI is on the
  /// device. Takes memory for a second VDI, which stays for the next one. Throws Error{OutOfMemory} where
  /// there's none; what is shown stays.
  void prepareVdi(const Vdi& vdi);
  /// Shows what was prepared, at once. Returns whether there was anything.
  bool showPrepared();
  /// Rays end at an opacity of 1 - 1/512, along V_O's of 1 - 1/1024: what's behind changes a colour of 8 bits
  /// by half a step at most. Throws Error{InvalidArgument} before the first setVdi, and for what View
  /// rejects.
  Image render(const Camera& camera, int width, int height,
               Reconstruction reconstruction = Reconstruction::Smooth);
  /// The same for a screen: 8 instead of 20 bytes a pixel come from the device, which takes longer than
  /// rendering. Premultiplied, each byte is toByte of what render gives. Valid until the next call.
  ImageBytes renderBytes(const Camera& camera, int width, int height, Alpha alpha,
                         Reconstruction reconstruction = Reconstruction::Smooth);
  /// Either one among other things that are seen. `ends`: [height][width] of the view, the depths at which
  /// its rays end, at opaque objects; infinity where there's none, empty if there's none at all.
  Image render(const View& view, std::span<const float> ends,
               Reconstruction reconstruction = Reconstruction::Smooth);
  ImageBytes renderBytes(const View& view, std::span<const float> ends, Alpha alpha,
                         Reconstruction reconstruction = Reconstruction::Smooth);
  double renderMilliseconds() const;  // device time of the last render

 private:
  friend class VdiGenerator;
  const gpu::Device* device() const;
  detail::VdiLoader& loadShown(const Vdi& header);
  void showNothing();
  struct State;
  std::unique_ptr<State> state_;
};

/// Fewer lists: about one in `factor` of each row and of each column, as they are. Views of it take less time
/// on a CPU, and are as rough as pictures with that many fewer pixels. On the host.
Vdi thinned(const Vdi& vdi, int factor);

/// The VDI's picture, seen from V_O: each list but the margin's composited front to back, on the host. Equals
/// DVR.
Image flatten(const Vdi& vdi);

}  // namespace vdi
