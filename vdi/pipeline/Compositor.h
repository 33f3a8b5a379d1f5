// The owner's part of compositing, on the device: interleave by depth, segment again (paper, section 5.2).
// Not part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vdi/gpu/CompositePass.h"
#include "vdi/gpu/CountsPass.h"
#include "vdi/gpu/InterleavePass.h"
#include "vdi/pipeline/Distributor.h"
#include "vdi/pipeline/HistogramBuffer.h"
#include "vdi/pipeline/ListBuilder.h"

namespace vdi::detail {

class Compositor {
 public:
  explicit Compositor(std::shared_ptr<gpu::Device> device);

  struct Request {
    std::uint32_t budget = 1;      // N_S
    std::uint32_t maxPerList = 1;  // N_S, or more with a level
    double sampleStep = 1.0;
    Algorithm algorithm = Algorithm::Merge;
    DepthCode code;       // of compact lists
    float level = -1.0F;  // of all owners' histogram together, with Budget::Total
  };

  /// Puts all ranks' supersegments of some lists in order of depth. Goes on on the device when this returns:
  /// `parts` and `interleaved` must stay until `finish`. What came is copied by the transfer queue, beside
  /// what the device computes. `behind`: steps that follow.
  void interleave(const Distributed& parts, const DepthCode& code, DeviceLists& interleaved,
                  const ListBuilder::Behind& behind = {});

  /// What these lists need. Waits for what was started.
  SupersegmentHistogram histogram(const DeviceLists& interleaved, const Request& request);
  /// Makes lists of at most `maxPerList` supersegments. Goes on on the device when this returns;
  /// `interleaved` and `lists` must stay until `finish`.
  void composite(const DeviceLists& interleaved, const Request& request, DeviceLists& lists);
  /// The flat picture: each list's supersegments composited, as [listCount] glm::vec4 and [listCount] float.
  /// Goes on on the device likewise.
  void flatten(const DeviceLists& interleaved, const DepthCode& code, gpu::Buffer& colors,
               gpu::Buffer& depths);
  /// Waits for what was started; then `lists` are complete. Throws what ListBuilder::finish throws.
  void finish();
  /// Waits, and drops it: after an error.
  void drop();
  /// The last thing that was submitted.
  gpu::Submission last() const { return last_; }

  /// Device time of all that has been done since the last call, but for the transfer queue's.
  double takeMilliseconds();

 private:
  void apply(const DeviceLists& interleaved, const Request& request);
  void receive(const Distributed& parts);
  void wait();
  void noteTimes();
  std::vector<HostAccess*> receivedFrom_;  // by the merge that goes on
  bool merging_ = false;
  bool flattening_ = false;
  bool building_ = false;
  gpu::Submission last_;

  std::shared_ptr<gpu::Device> device_;
  gpu::Commands transfers_;
  gpu::Commands commands_;
  gpu::Commands flattens_;
  gpu::ScanPass scan_;
  gpu::CountsPass counts_;
  gpu::InterleavePass interleavePass_;
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
