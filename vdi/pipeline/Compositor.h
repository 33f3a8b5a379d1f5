// The owner's part of compositing, on the device: merge by depth, segment again (paper, section 5.2). Not
// part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "vdi/core/Image.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/CompositePass.h"
#include "vdi/gpu/MergePass.h"
#include "vdi/pipeline/ListBuilder.h"

namespace vdi::detail {

class Compositor {
 public:
  explicit Compositor(std::shared_ptr<gpu::Device> device);

  struct Request {
    std::uint32_t budget = 1;
    double sampleStep = 1.0;
    Algorithm algorithm = Algorithm::Merge;
    DepthCode code;  // of compact lists
  };

  /// subLists[r] are rank r's supersegments of the owner's lists. The result has at most `budget` a list.
  template <typename Segment>
  ListsOf<Segment> composite(const std::vector<ListsOf<Segment>>& subLists, const Request& request);

 private:
  template <typename Segment>
  void compositeBand(const std::vector<ListsOf<Segment>>& subLists, std::size_t first, std::size_t last,
                     ListsOf<Segment>& result);
  template <typename Segment>
  void upload(const std::vector<ListsOf<Segment>>& subLists, std::size_t first, std::size_t last);

  std::shared_ptr<gpu::Device> device_;
  gpu::Commands commands_;
  gpu::ScanPass scan_;
  gpu::MergePass mergePass_;
  gpu::CompositePass compositePass_;
  ListBuilder builder_;
  gpu::Buffer params_;
  gpu::Buffer staging_;
  gpu::Buffer received_;
  gpu::Buffer rankAddresses_;
  gpu::Buffer subOffsets_;
  gpu::Buffer heads_;
  gpu::Buffer mergedCounts_;
  gpu::Buffer mergedOffsets_;
  gpu::Buffer merged_;
  gpu::shared::CompositeParams settings_{};
  Request request_;
};

/// The flat picture of the owner's lists: all ranks' supersegments of each list composited in order of depth.
/// Host code.
void flattenMerged(std::span<const SupersegmentLists> subLists, std::span<glm::vec4> rgba,
                   std::span<float> depth);

}  // namespace vdi::detail
