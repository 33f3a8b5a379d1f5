// From intervals to compact lists, on the device, band by band (paper, section 4). What casts
// rays and what composites share it; not part of the library's interface. vdi/reference/Segmenter.h describes
// the algorithms.
//   bisection: search of sensitivities, prefix sum of the counts, write.
//   merge: count of pre-segments, of all lists or one in countedStride x countedStride; interpolated
//   tolerance to all lists, prefix sum, write of pre-segments; prefix sum of what's to be left of them,
//   reduce. merge, with other ranks: the same with counts that all of them agreed on.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "vdi/core/GenerateSettings.h"
#include "vdi/gpu/Commands.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/InterpolatePass.h"
#include "vdi/gpu/Memory.h"
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

/// What the shaders call the form that lists of that type have in memory.
gpu::shared::StoredForm storedForm(const DepthCode& code);

/// Device milliseconds: of all steps, of the algorithm's first one, and of its second one; each with its
/// prefix sum.
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

  /// Device bytes that a list of `maxCount` supersegments may take.
  static std::uint64_t bytesPerList(std::uint32_t maxCount, Algorithm algorithm);

  /// Records the dispatch of the algorithm's first step, or (write) its second one.
  using Record = std::function<void(gpu::Commands&, const BandTargets&, bool write)>;

  struct Request {
    std::uint32_t width = 0;  // lists in a row
    std::uint32_t rows = 0;
    bool rowBehind = false;           // another row follows the band's last one
    std::uint32_t countedStride = 1;  // merge: `rows` is a multiple of it, or nothing follows
    Algorithm algorithm = Algorithm::Merge;
    gpu::ReducePass::MaxPerList maxPerList;
    double sampleStep = 1.0;
    DepthCode code;  // of compact lists
    /// Merging, with other ranks: what they agreed on about the counted lists (shaders/shared/quota.h), which
    /// aren't counted again. The first one of them is the band's.
    struct Agreed {
      std::uint64_t tolerances = 0;
      std::uint64_t preSegments = 0;
      std::uint64_t quotas = 0;
      std::uint32_t budget = 1;
    };
    std::optional<Agreed> agreed;
    /// Merging, with other ranks: one supersegment a run, as a picture needs. Nothing is counted.
    bool runsOnly = false;
    /// Merging, of lists that were merged by depth: those that fit are these. 0: none are.
    std::uint64_t fitting = 0;
    std::uint64_t fittingOffsets = 0;

    std::uint32_t listCount() const { return width * rows; }
    /// Of the lists that are counted: every countedStride-th, the row behind the band's last one included.
    std::uint32_t countedWidth() const { return (width + countedStride - 1) / countedStride; }
    std::uint32_t countedRows() const {
      return (rows + countedStride - 1) / countedStride + (rowBehind && countedStride > 1 ? 1 : 0);
    }
  };

  /// Recorded behind the last step, for the device: the host doesn't know the lists' counts then. Recorded
  /// anew where steps are; what it did before then counts for nothing.
  using Behind = std::function<void(gpu::Commands&)>;
  /// Submits the steps and returns. `lists`, what `record` and `behind` refer to, and what the request names
  /// must stay until `finish`. `after`: what the lists' memory is still used by.
  void start(const Request& request, Record record, DeviceLists& lists, Behind behind = {},
             const gpu::Submission& after = {});
  /// Waits. Where the memory of the frame before was too small, steps are submitted again. `lists` are then
  /// what was written, compact or full as the code says. Throws Error{OutOfMemory} when the supersegments
  /// don't fit, Error{DeviceFailure} if a list's written count isn't its stored count.
  void finish();
  /// The same for lists that are all empty.
  void startEmpty(std::uint32_t listCount, DeviceLists& lists, const Behind& behind = {});
  /// Start, and finish.
  void build(const Request& request, const Record& record, DeviceLists& lists) {
    start(request, record, lists);
    finish();
  }
  /// The last thing that was submitted.
  gpu::Submission last() const { return commands_.last(); }
  /// Waits, and drops what was started: after an error.
  void drop();

  /// Of the last build that was finished.
  const ListTimes& times() const { return times_; }

 private:
  /// The step that merging is submitted from.
  enum class From { Search, Write, Reduce };
  /// What was started.
  struct Started {
    Request request;
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
  bool hasQuotas() const { return started_->request.agreed || started_->request.runsOnly; }
  void recordTotal(const gpu::Buffer& offsets, std::uint32_t listCount, std::size_t which);
  std::uint32_t runsToExpect(std::uint32_t most) const;
  void submit();
  void addTimes();

  std::shared_ptr<gpu::Device> device_;
  gpu::Commands commands_;
  gpu::ScanPass scan_;
  gpu::InterpolatePass interpolate_;
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
  gpu::Buffer status_;  // as CastParams has it
  gpu::Buffer statusReadback_;
  gpu::Buffer preSegmentsFit_;  // guards: shaders/shared/scan.h
  gpu::Buffer segmentsFit_;
  gpu::Buffer totals_;  // of pre-segments, and of supersegments
  /// Of a picture's lists: there's room for as many. Once some had more, there's room for these.
  static constexpr std::uint32_t fewRuns = 3;
  std::uint32_t expectedRuns_ = fewRuns;
  std::optional<Started> started_;
  ListTimes times_;
};

}  // namespace vdi::detail
