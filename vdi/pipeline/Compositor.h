// The owner's part of compositing, on the device: interleaves supersegments by depth and segments them again
// (paper, section 5.2). Not part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vdi/gpu/CompositePass.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/PipelineSet.h"
#include "vdi/pipeline/Distributor.h"
#include "vdi/pipeline/HistogramBuffer.h"
#include "vdi/pipeline/ListBuilder.h"

namespace vdi::detail {

class Compositor {
 public:
  explicit Compositor(std::shared_ptr<gpu::Device> device);

  struct Options {
    std::uint32_t budget = 1;      // N_S
    std::uint32_t maxPerList = 1;  // N_S, or more with a level
    double sampleStep = 1.0;
    Algorithm algorithm = Algorithm::Merge;
    ListForm form;
    float level = -1.0F;  // with Budget::Total, from the histogram of all owners
  };

  /// Puts all ranks' supersegments of some lists in order of depth. The device continues after this returns:
  /// `parts` and `interleaved` must stay until `finish`. The transfer queue copies the received lists while
  /// the device computes. `behind` records the steps that follow.
  void interleave(const Distributed& parts, const ListForm& form, DeviceLists& interleaved,
                  const ListBuilder::Behind& behind = {});

  /// The histogram of these lists. Waits for the submitted work.
  SupersegmentHistogram histogram(const DeviceLists& interleaved, const Options& options);
  /// Makes lists of at most `maxPerList` supersegments. The device continues after this returns;
  /// `interleaved` and `lists` must stay until `finish`.
  void composite(const DeviceLists& interleaved, const Options& options, DeviceLists& lists);
  /// Composites each list to a pixel of the flat picture, as [listCount] glm::vec4 and [listCount] float. The
  /// device continues after this returns.
  void flatten(const DeviceLists& interleaved, const ListForm& form, gpu::Buffer& colors,
               gpu::Buffer& depths);
  /// Waits for the submitted work; then `lists` are complete. Throws as ListBuilder::finish does.
  void finish();
  /// Waits for the submitted work and drops it. For use after an error.
  void drop();
  /// The latest submission.
  gpu::Submission last() const { return last_; }

  /// Device time of all work since the last call, except the transfer queue's.
  double takeMilliseconds();

 private:
  void apply(const DeviceLists& interleaved, const Options& options);
  void receive(const Distributed& parts);
  void recordOffsets(const Distributed& parts);
  void recordInterleave(gpu::Commands& commands, const gpu::shared::InterleaveConstants& constants);
  void wait();
  void noteTimes();
  std::vector<HostAccess*> receivedFrom_;  // memory that the merge under way reads
  bool merging_ = false;
  bool flattening_ = false;
  bool building_ = false;
  gpu::Submission last_;

  std::shared_ptr<gpu::Device> device_;
  gpu::Commands transfers_;
  gpu::Commands commands_;
  gpu::Commands flattens_;
  gpu::ScanPass scan_;
  gpu::ComputePipeline counts_;  // unpacks the counts of the ranks' lists
  gpu::PipelineSet interleave_;  // by precision: puts the ranks' supersegments of each list in order of depth
  gpu::CompositePass compositePass_;
  ListBuilder builder_;
  gpu::Buffer received_;
  gpu::Buffer packedCounts_;
  gpu::Buffer wideCounts_;
  gpu::Buffer subCounts_;
  gpu::Buffer subOffsets_;
  gpu::Buffer heads_;
  gpu::Buffer interleavedCounts_;
  gpu::shared::CompositeParams settings_{};
  HistogramBuffer histogram_;
  double milliseconds_ = 0.0;
};

}  // namespace vdi::detail
