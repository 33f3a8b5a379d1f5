// Lists of a frame, band after band: cast, distribute and composite, and who waits for whom. Not part of the
// library's interface.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/ByteSum.h"
#include "vdi/comm/Communicator.h"
#include "vdi/comm/Exchange.h"
#include "vdi/comm/Ownership.h"
#include "vdi/pipeline/Compositor.h"
#include "vdi/pipeline/Distributor.h"
#include "vdi/pipeline/GatheredLists.h"
#include "vdi/pipeline/GeneratorOptions.h"
#include "vdi/pipeline/RayCaster.h"
#include "vdi/pipeline/Stages.h"
#include "vdi/pipeline/VdiSink.h"

namespace vdi::detail {

class BandMaker {
 public:
  /// `comm` must outlive it.
  BandMaker(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm,
            const GeneratorOptions& options);

  RayCaster& caster() { return caster_; }
  Compositor& compositor() { return compositor_; }

  /// With one rank: makes the bands of a VDI's lists and adds them to the sink.
  void makeAlone(const RayCaster::Request& request, const Progress& progress, VdiSink& sink,
                 RankReport& report);

  /// Collective: makes the bands of a VDI's lists on the devices of their owners, and adds all of them to the
  /// sink except the last one. `started`, collective, is called when the first band is being made. `owned`
  /// gets this rank's lists of each band.
  void makeComposited(const RayCaster::Request& request, const Progress& progress,
                      std::vector<OwnedLists>& owned, const std::function<void()>& started, VdiSink& sink,
                      RankReport& report);
  /// Collective: adds that one.
  void addLast(const std::vector<OwnedLists>& owned, VdiSink& sink, RankReport& report);

  /// A band of the picture that this rank owns, without lists.
  struct FlatBand {
    std::uint64_t firstPixel = 0;
    std::uint32_t pixelCount = 0;
    gpu::Buffer colors;         // [pixelCount] glm::vec4
    gpu::Buffer depths;         // [pixelCount] float
    gpu::Submission flattened;  // which writes these two
  };
  /// Collective: the same for a picture, of runs alone. The limit case of the paper's section 5.3: one
  /// supersegment a run, composited in order of depth. `pass`, collective, waits for a composited band
  /// (Compositor::finish) and sends it on; it isn't called for the last band.
  void makeFlat(const RayCaster::Request& request, const Progress& progress, std::vector<FlatBand>& flat,
                const std::function<void(std::size_t band)>& pass, RankReport& report);

  /// The picture of one rank's volume: RayCaster::render.
  void render(const RayCaster::Request& request, const Progress& progress, HostPool& pool, Image& image,
              RankReport& report);

  /// No frame is under way: the next one takes the same memory as the last that was made so.
  void restart() { firstSlot_ = 0; }
  /// Waits for what was started, and drops it: after an error.
  void drop() noexcept;

 private:
  /// What a band of this rank's own lists needs until it's passed on; bands take them in turns.
  struct Slot {
    DeviceLists lists;
    comm::Ownership owned = comm::Ownership::equal(0, 1);
    std::unique_ptr<Distributor> distributor;
    Distributed parts;
    gpu::Submission usedBy;  // the lists' memory
  };
  Slot& slotOf(std::size_t band) { return slots_[(firstSlot_ + band) % slots_.size()]; }
  /// The next frame's first band isn't made where this one's last band still is.
  void freeSlots(std::size_t bands) { firstSlot_ = (firstSlot_ + bands) % slots_.size(); }

  /// Bands of a picture: as many rows each, but for the last one.
  struct Bands {
    std::uint32_t height = 0;
    std::uint32_t rows = 1;
    std::size_t count() const { return (height + rows - 1) / rows; }
    std::uint32_t first(std::size_t band) const { return static_cast<std::uint32_t>(band) * rows; }
    std::uint32_t last(std::size_t band) const { return std::min(height, first(band) + rows); }
    double doneWith(std::size_t band) const { return static_cast<double>(last(band)) / height; }
  };
  /// Where this rank's lists of a band begin in the picture, and all ranks' supersegments of them.
  struct MergedBand {
    std::uint64_t firstList = 0;
    DeviceLists interleaved;
  };

  void agreeOnLists(RayCaster::Cast& cast);
  void distribute(Slot& slot, const DepthCode& code, Stopwatch& watch, RankReport& report);
  comm::Ownership ownershipOf(const RayCaster::Cast& cast, const Bands& all, std::size_t band,
                              std::span<const std::uint32_t> weights) const;
  /// Collective: this rank's lists, band after band, to those who own them, where they're merged by depth.
  /// While a band is on its way, the device makes the next one.
  struct OwnedSteps {
    std::function<void()> started;                  // collective: the first band is being made
    std::function<void(std::size_t band)> compose;  // submits what's made of a merged band
    std::function<void(std::size_t band)> pass;     // collective: sends on a band that was composed
  };
  void makeOwned(const RayCaster::Request& request, const Progress& progress, const OwnedSteps& steps,
                 RankReport& report);
  void add(const std::vector<OwnedLists>& owned, std::size_t band, VdiSink& sink, RankReport& report);
  float levelOfAll(const GenerateSettings& settings, const Compositor::Request& request);
  void noteTimes(RankReport& report) const;

  const comm::Communicator& comm_;
  RayCaster caster_;
  Compositor compositor_;
  comm::ByteSum levelSum_;
  HostAccesses accesses_;  // to the memory of levelSum_
  std::array<Slot, RayCaster::bandsAtOnce> slots_;
  std::size_t firstSlot_ = 0;  // of the frame that's made
  std::vector<MergedBand> merged_;
};

}  // namespace vdi::detail
