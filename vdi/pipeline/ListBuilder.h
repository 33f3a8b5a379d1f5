// Makes lists without gaps from intervals, on the device, band by band (paper, section 4). RayCaster and
// Compositor share it; not part of the library's interface. vdi/reference/Segmenter.h describes the
// algorithms.
//   Bisection: search of sensitivities, prefix sum of the counts, write.
//   Merge: the five steps of docs/architecture.md, with a prefix sum before steps 3 and 5. With other ranks,
//   all ranks agree on the counts first.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "vdi/core/GenerateSettings.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/Memory.h"
#include "vdi/gpu/PipelineSet.h"
#include "vdi/gpu/ReducePass.h"
#include "vdi/gpu/ScanPass.h"
#include "vdi/pipeline/DeviceLists.h"

namespace vdi::detail {

/// Device addresses of one band of lists, counted from the band's first list. See shaders/shared/cast.h.
struct BandTargets {
  std::uint64_t thresholds = 0;
  std::uint64_t capacities = 0;
  std::uint64_t offsets = 0;
  std::uint64_t segments = 0;
  std::uint64_t preSegments = 0;
  std::uint64_t written = 0;
  std::uint64_t left = 0;
  std::uint64_t quotas = 0;
  std::uint64_t status = 0;
  std::uint64_t guard = 0;
};

/// The form as shaders take it.
gpu::shared::StoredForm storedForm(const ListForm& form);

/// Device milliseconds of all steps, of the algorithm's counting, and of its writing, each with its prefix
/// sum.
struct ListTimes {
  double all = 0.0;
  double count = 0.0;
  double write = 0.0;
  ListTimes& operator+=(const ListTimes& other) {
    all += other.all;
    count += other.count;
    write += other.write;
    return *this;
  }
};

class ListBuilder {
 public:
  explicit ListBuilder(std::shared_ptr<gpu::Device> device);

  /// The most device bytes that a list of `maxCount` supersegments takes.
  static std::uint64_t bytesPerList(std::uint32_t maxCount, Algorithm algorithm);

  /// Records the dispatch that counts, or with `write` the one that writes.
  using Record = std::function<void(gpu::Commands&, const BandTargets&, bool write)>;

  struct Options {
    std::uint32_t width = 0;  // lists in a row
    std::uint32_t rows = 0;
    bool rowBehind = false;           // another row follows the band's last one
    std::uint32_t countedStride = 1;  // merge: divides `rows`, except in the last band
    Algorithm algorithm = Algorithm::Merge;
    gpu::ReducePass::MaxPerList maxPerList;
    double sampleStep = 1.0;
    ListForm form;
    /// Merging with other ranks: the agreed values of the counted lists (shaders/shared/quota.h), which are
    /// not counted again. They begin with the band's first list.
    struct Agreed {
      std::uint64_t tolerances = 0;
      std::uint64_t preSegments = 0;
      std::uint64_t quotas = 0;
      std::uint32_t budget = 1;
    };
    std::optional<Agreed> agreed;
    /// Merging with other ranks: one supersegment per run, as a flat picture needs. Nothing is counted.
    bool runsOnly = false;
    /// Merging interleaved lists: address of the lists that fit the budget as they are. 0: none.
    std::uint64_t fitting = 0;
    std::uint64_t fittingOffsets = 0;

    std::uint32_t listCount() const { return width * rows; }
    /// Size of the grid of counted lists: every countedStride-th, including the row after the band's last
    /// one.
    std::uint32_t countedWidth() const { return (width + countedStride - 1) / countedStride; }
    std::uint32_t countedRows() const {
      return (rows + countedStride - 1) / countedStride + (rowBehind && countedStride > 1 ? 1 : 0);
    }
  };

  /// Records device work after the last step, when the host does not know the lists' counts yet. It is called
  /// again when steps are repeated; the results of the last call must replace earlier ones.
  using Behind = std::function<void(gpu::Commands&)>;
  /// Submits the steps and returns. `lists`, the data that `record` and `behind` refer to, and the request's
  /// buffers must stay until `finish`. `after` is the last submission that uses the lists' memory.
  void start(const Options& options, Record record, DeviceLists& lists, Behind behind = {},
             const gpu::Submission& after = {});
  /// Waits for the steps. If the previous frame's memory was too small, submits steps again. Then `lists` are
  /// complete, in the form of the options. Throws Error{OutOfMemory} if the supersegments
  /// do not fit, Error{DeviceFailure} if a list's written count differs from its stored count.
  void finish();
  /// Starts lists that are all empty.
  void startEmpty(std::uint32_t listCount, DeviceLists& lists, const Behind& behind = {});
  /// Starts and finishes.
  void build(const Options& options, const Record& record, DeviceLists& lists) {
    start(options, record, lists);
    finish();
  }
  /// The latest submission.
  gpu::Submission last() const { return commands_.last(); }
  /// Waits for the submitted work and drops it. For use after an error.
  void drop();

  /// Times of the last finished build.
  const ListTimes& times() const { return times_; }

 private:
  /// The step from which merging is submitted.
  enum class From { Search, Write, Reduce };
  /// The work under way.
  struct Started {
    Options options;
    Record record;
    Behind behind;
    DeviceLists* lists = nullptr;
    bool empty = false;
  };
  void reserve();
  void submitMerging(From from, const gpu::Submission& after);
  void recordSearch();
  void recordWrite();
  void recordReduce();
  void finishMerging();
  std::optional<From> againFrom(From from);
  void submitBisection(const gpu::Submission& after);
  void finishBisection();
  bool hasQuotas() const { return started_->options.agreed || started_->options.runsOnly; }
  void recordTotal(const gpu::Buffer& offsets, std::uint32_t listCount, std::size_t which);
  std::uint32_t runsToExpect(std::uint32_t most) const;
  void submit();
  void addTimes();

  std::shared_ptr<gpu::Device> device_;
  gpu::Commands commands_;
  gpu::ScanPass scan_;
  /// List tolerances, interpolated from those of the counted lists: for one rank, and for one of several
  /// ranks.
  gpu::PipelineSet interpolate_;
  gpu::ReducePass reduce_;
  gpu::Buffer thresholds_;
  gpu::Buffer capacities_;
  gpu::Buffer quotas_;
  gpu::Buffer preSegmentOffsets_;
  gpu::Buffer preSegments_;
  gpu::Buffer written_;
  gpu::Buffer left_;
  gpu::Buffer countedTolerances_;
  gpu::Buffer countedPreSegments_;
  gpu::Buffer status_;  // as in CastParams
  gpu::Buffer statusReadback_;
  gpu::Buffer preSegmentsFit_;  // guards: shaders/shared/scan.h
  gpu::Buffer segmentsFit_;
  gpu::Buffer totals_;  // numbers of pre-segments, then of supersegments
  /// Runs per list of a flat picture for which memory is reserved. Once a list has more, `expectedRuns_`
  /// grows.
  static constexpr std::uint32_t fewRuns = 3;
  std::uint32_t expectedRuns_ = fewRuns;
  std::optional<Started> started_;
  ListTimes times_;
};

}  // namespace vdi::detail
