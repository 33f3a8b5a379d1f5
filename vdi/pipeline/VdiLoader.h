// A VDI on its way to where views are rendered from: from the host, or from lists that the device has just
// made. Not part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>

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
  gpu::Buffer heads;
  gpu::Buffer tileDepthMasks;
  gpu::Buffer depthRange;          // shared::DepthRange
  gpu::Buffer depthRangeReadback;  // the same, for the host
  std::unique_ptr<View> original;  // none until there's a VDI
  /// When it's loaded.
  gpu::shared::DepthRange depths() const { return depthRangeReadback.mappedAs<gpu::shared::DepthRange>()[0]; }
};

class VdiLoader {
 public:
  explicit VdiLoader(std::shared_ptr<gpu::Device> device);

  /// Whether it has the device to itself, or renders go on beside it.
  enum class Kind { Alone, Beside };
  /// Copies. Alone, it goes on on the device while this returns (VDIs of up to 128 MiB; larger ones wait for
  /// all but their last part). Beside, it's done then.
  void load(const Vdi& vdi, LoadedVdi& target, Kind kind);

  /// The same from the device's lists, band after band: `header` is the VDI without them. `target` must stay
  /// until it's loaded.
  void begin(const Vdi& header, LoadedVdi& target);
  /// A band that has been made. The result is what uses its memory.
  gpu::Submission add(const DeviceLists& band, std::uint64_t firstList);
  /// Goes on on the device when this returns.
  void finish();

  /// Returns when what was loaded last is there.
  void wait() { commands_.wait(); }
  /// Waits likewise, and drops it: after an error.
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
  std::uint64_t stagingBytes_ = 0;  // of the staging buffer that are used
  std::uint64_t stagingUsed_ = 0;
  LoadedVdi* target_ = nullptr;
  gpu::shared::ExpandConstants constants_{};
  std::uint64_t listCount_ = 0;
  std::uint64_t segmentBytes_ = 0;  // of one
  std::uint64_t added_ = 0;         // supersegments of bands
  /// Behind the buffers, for its end waits for what uses them.
  gpu::Commands commands_;
};

}  // namespace vdi::detail
