// Makes the lists of a frame, band after band: casts, distributes and composites, and makes each stage wait
// for the ones before it. Not part of the library's interface.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "vdi/comm/ByteSum.h"
#include "vdi/comm/Communicator.h"
#include "vdi/comm/Exchange.h"
#include "vdi/comm/Ownership.h"
#include "vdi/core/FunctionRef.h"
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
  void makeAlone(const RayCaster::Inputs& inputs, const Progress& progress, VdiSink& sink,
                 RankReport& report);

  /// Collective: makes the bands of a VDI's lists on their owners' devices, and adds all of them but the last
  /// one to the sink. Calls `started`, which is collective, while the first band is being made. `owned` gets
  /// this rank's lists of each band.
  void makeComposited(const RayCaster::Inputs& inputs, const Progress& progress,
                      std::vector<OwnedLists>& owned, FunctionRef<void()> started, VdiSink& sink,
                      RankReport& report);
  /// Collective: adds the last band of makeComposited to the sink.
  void addLast(const std::vector<OwnedLists>& owned, VdiSink& sink, RankReport& report);

  /// A band of the flat picture, without lists, that this rank owns.
  struct FlatBand {
    std::uint64_t firstPixel = 0;
    std::uint32_t pixelCount = 0;
    gpu::Buffer colors;         // [pixelCount] glm::vec4
    gpu::Buffer depths;         // [pixelCount] float
    gpu::Submission flattened;  // writes both buffers
  };
  /// Collective: makes a flat picture only from runs. It is the limit case of the paper's section 5.3: one
  /// supersegment per run, composited in order of depth. `pass`, which is collective, waits for a composited
  /// band (Compositor::finish) and sends it on; it is not called for the last band.
  void makeFlat(const RayCaster::Inputs& inputs, const Progress& progress, std::vector<FlatBand>& flat,
                FunctionRef<void(std::size_t band)> pass, RankReport& report);

  /// Renders one rank's volume to a picture: RayCaster::render.
  void render(const RayCaster::Inputs& inputs, const Progress& progress, HostPool& pool, Image& image,
              RankReport& report);
  /// Finds the extreme scalars of one rank's volume: RayCaster::project.
  void project(const RayCaster::Inputs& inputs, const Progress& progress, HostPool& pool,
               HostVector<std::uint64_t>& keys, RankReport& report);

  /// Makes the next frame start with the first slot. Call when no frame is under way.
  void restart() { firstSlot_ = 0; }
  /// Waits for the submitted work and drops it. For use after an error.
  void drop() noexcept;

 private:
  /// Memory for a band of this rank's own lists until it is passed on; bands take slots in turns.
  struct Slot {
    DeviceLists lists;
    comm::Ownership owned = comm::Ownership::equal(0, 1);
    std::unique_ptr<Distributor> distributor;
    Distributed parts;
    gpu::Submission usedBy;  // the last to use the lists' memory
  };
  Slot& slotOf(std::size_t band) { return slots_[(firstSlot_ + band) % slots_.size()]; }
  /// Makes the next frame's first band avoid the memory of this frame's last one.
  void freeSlots(std::size_t bands) { firstSlot_ = (firstSlot_ + bands) % slots_.size(); }

  /// Bands of a picture: all have the same number of rows, except the last one.
  struct Bands {
    std::uint32_t height = 0;
    std::uint32_t rows = 1;
    std::size_t count() const { return (height + rows - 1) / rows; }
    std::uint32_t first(std::size_t band) const { return static_cast<std::uint32_t>(band) * rows; }
    std::uint32_t last(std::size_t band) const { return std::min(height, first(band) + rows); }
    double doneWith(std::size_t band) const { return static_cast<double>(last(band)) / height; }
  };
  /// The position of this rank's lists of a band in the picture, and all ranks' supersegments of them.
  struct MergedBand {
    std::uint64_t firstList = 0;
    DeviceLists interleaved;
  };

  void agreeOnLists(RayCaster::Cast& cast);
  void distribute(Slot& slot, Precision precision, Stopwatch& watch, RankReport& report);
  comm::Ownership ownershipOf(const RayCaster::Cast& cast, const Bands& all, std::size_t band,
                              std::span<const std::uint32_t> weights) const;
  /// Collective: sends this rank's lists, band after band, to their owners, which merge them by depth. The
  /// device makes the next band while one travels.
  struct OwnedSteps {
    FunctionRef<void()> started;                  // collective; called while the first band is being made
    FunctionRef<void(std::size_t band)> compose;  // submits the work on a merged band
    FunctionRef<void(std::size_t band)> pass;     // collective; sends a composed band on
  };
  void makeOwned(const RayCaster::Inputs& inputs, const Progress& progress, const OwnedSteps& steps,
                 RankReport& report);
  void add(const std::vector<OwnedLists>& owned, std::size_t band, VdiSink& sink, RankReport& report);
  float levelOfAll(const GenerateSettings& settings, const Compositor::Options& options);
  void noteTimes(RankReport& report) const;

  const comm::Communicator& comm_;
  RayCaster caster_;
  Compositor compositor_;
  comm::ByteSum levelSum_;
  HostAccesses accesses_;  // to the memory of levelSum_
  std::array<Slot, RayCaster::bandsAtOnce> slots_;
  std::size_t firstSlot_ = 0;  // slot of the current frame's first band
  std::vector<MergedBand> merged_;
};

}  // namespace vdi::detail
