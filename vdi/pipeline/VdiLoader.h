// Loads a VDI into the memory that views are rendered from, from the host or from lists that the device has
// just made. Not part of the library's interface.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "vdi/core/BoxFaces.h"
#include "vdi/core/Camera.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/ExpandPass.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/ScanPass.h"
#include "vdi/pipeline/DeviceLists.h"

namespace vdi::detail {

/// A VDI on the device, as render.comp reads it.
struct LoadedVdi {
  gpu::Buffer segments;
  gpu::Buffer slopes;  // a word for each supersegment, once it leans
  gpu::Buffer heads;
  gpu::Buffer tileDepthMasks;
  gpu::Buffer depthRange;          // shared::DepthRange
  gpu::Buffer depthRangeReadback;  // the same, for the host
  gpu::Buffer boxFaces;            // shared::renderFaces vec4, once it leans
  BoxFaces faces{};                // faces of the VDI's box, in the view space of V_O
  double depthStep = 0.0;          // DepthCode::step
  std::unique_ptr<View> original;  // null until a VDI is loaded
  bool leans = false;              // whether recordLeaning has been called for it
  /// Call when the VDI is loaded.
  gpu::shared::DepthRange depths() const { return depthRangeReadback.mappedAs<gpu::shared::DepthRange>()[0]; }
};

/// RenderParams::boxFaces.
std::array<glm::vec4, gpu::shared::renderFaces> facesForDevice(const LoadedVdi& vdi);

/// Finds how the faces of a loaded VDI's supersegments lean, which Reconstruction::Sheared needs.
void recordLeaning(gpu::Commands& commands, gpu::ExpandPass& expand,
                   const std::shared_ptr<gpu::Device>& device, LoadedVdi& vdi);

class VdiLoader {
 public:
  explicit VdiLoader(std::shared_ptr<gpu::Device> device);

  /// Alone: the loader has the device to itself. DuringRenders: renders continue meanwhile.
  enum class Kind { Alone, DuringRenders };
  /// Copies the VDI. Alone, the device continues after this returns (for VDIs of up to 128 MiB; larger ones
  /// wait for all but their last part). With Kind::DuringRenders, the VDI is loaded when this returns.
  void load(const Vdi& vdi, LoadedVdi& target, Kind kind);

  /// Starts to load from the device's lists, band after band; `header` is the VDI without lists. `target`
  /// must stay until the VDI is loaded.
  void begin(const Vdi& header, LoadedVdi& target);
  /// Adds a complete band. Returns the submission that uses its memory.
  gpu::Submission add(const DeviceLists& band, std::uint64_t firstList);
  /// Call after the last band. The device continues after this returns.
  void finish();

  /// Waits until the last VDI is loaded.
  void wait() { commands_.wait(); }
  /// Waits for the submitted work and drops it. For use after an error.
  void drop() noexcept { commands_.drop(); }

 private:
  void start(const Vdi& header, LoadedVdi& target);
  void reserveSegments(std::uint64_t count);
  void recordSegments(VkDeviceAddress from, std::uint64_t first, std::uint64_t count);
  void recordMasks();
  template <typename Segment>
  void loadLists(const ListsOf<Segment>& lists, Kind kind);
  template <typename T, typename Use>
  void inParts(const HostVector<T>& values, Use use);

  std::shared_ptr<gpu::Device> device_;
  gpu::ExpandPass expand_;
  gpu::ScanPass scan_;
  gpu::Buffer staging_;
  gpu::Buffer offsets_;
  gpu::Buffer outgrown_;
  std::uint64_t stagingBytes_ = 0;  // size of the part of the staging buffer in use
  std::uint64_t stagingUsed_ = 0;
  LoadedVdi* target_ = nullptr;
  gpu::shared::ExpandConstants constants_{};
  std::uint64_t listCount_ = 0;
  std::uint64_t segmentBytes_ = 0;  // size of one supersegment
  std::uint64_t added_ = 0;         // supersegments of the bands so far
  /// Declared after the buffers, because its destructor waits for the commands that use them.
  gpu::Commands commands_;
};

}  // namespace vdi::detail
