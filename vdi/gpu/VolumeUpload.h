// Uploads blocks' values to texels on the device.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"
#include "vdi/gpu/VolumePages.h"

namespace vdi::gpu {

/// All cores copy values into a ring of slots in host memory as the simulation stores them. The device's
/// transfer queue moves each filled slot to the device, where a shader turns the values into texels and puts
/// them in place. A copy of host memory to a texture would instead pay for each row of a block. Layers that
/// another block of the rank has are copied from its texels, if both have the same scale and offset.
///
/// A CPU device, and one that cannot store texels, gets texels that the host has made, and copies them.
/// If values can be texels as they are and the driver can import host memory
/// (VK_EXT_external_memory_host), a process with one core lets the device copy them from the block's own
/// memory instead. Values of patches are inserted among the staged ones, or copied after the block's own
/// values.
class VolumeUpload {
 public:
  explicit VolumeUpload(std::shared_ptr<Device> device);

  /// Call before each run: its copies wait on the device for the last submission of `before`.
  void begin(const Commands& before);
  /// Copies the pieces to their places in the pages, which stay ready to be sampled. Returns when all values
  /// are copied; host data is not needed afterwards. Any thread may call it while others use the device.
  void run(std::span<const VolumePiece> pieces, std::span<const SampledImage> pages);
  /// The commands that run submitted last, for other queues to wait for.
  const Commands& last() const { return frame_; }

 private:
  /// Commands and memory for a part of the values on their way.
  struct Slot {
    explicit Slot(const std::shared_ptr<Device>& device)
        : copies(device, QueueKind::Transfer), stores(device) {}
    Buffer staging;
    Buffer values;  // on the device, if a shader places them
    Commands copies;
    Commands stores;
  };
  struct Load;
  struct Batch;
  struct Plan;

  bool copyDirectly(const VolumePiece& piece, const SampledImage& page, std::vector<Buffer>& imported);
  void planTexels(Plan& plan, const VolumePiece& piece, const SampledImage& page,
                  std::vector<Buffer>& imported);
  void bindPages(std::span<const SampledImage> pages);
  void makeSlots(const Plan& plan);
  void send(const Plan& plan, std::span<const SampledImage> pages);
  void submit(const Plan& plan, const Batch& batch, Slot& slot, std::span<const SampledImage> pages);
  void copyLayers(const Plan& plan);

  std::shared_ptr<Device> device_;
  bool places_;     // whether a shader places the values
  Commands frame_;  // what comes before and after the slots' commands
  Sampler sampler_;
  PipelineSet pipelines_;  // by page count
  ComputePipeline* pipeline_ = nullptr;
  std::vector<std::unique_ptr<Slot>> slots_;
  Buffer layerJobs_;
};

}  // namespace vdi::gpu
