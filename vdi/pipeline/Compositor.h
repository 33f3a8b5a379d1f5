// The owner's part of compositing, on the device: merge by depth, segment again (paper, section 5.2). Not
// part of the library's interface.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "vdi/core/Image.h"
#include "vdi/core/Vdi.h"
#include "vdi/gpu/CompositePass.h"
#include "vdi/gpu/MergePass.h"
#include "vdi/pipeline/ListBuilder.h"
#include "vdi/pipeline/SurveyBuffer.h"

namespace vdi::detail {

class Compositor {
 public:
  explicit Compositor(std::shared_ptr<gpu::Device> device);

  struct Request {
    std::uint32_t budget = 1;       // N_S
    std::uint32_t mostPerList = 1;  // N_S, or more with a level
    double sampleStep = 1.0;
    Algorithm algorithm = Algorithm::Merge;
    DepthCode code;       // of compact lists
    float level = -1.0F;  // of all owners' survey together, with Budget::Total
  };

  /// What the owner's lists need.
  template <typename Segment>
  Survey survey(const std::vector<ListsOf<Segment>>& subLists, const Request& request);

  /// subLists[r] are rank r's supersegments of the owner's lists. The result has at most
  /// `mostPerList` a list.
  template <typename Segment>
  ListsOf<Segment> composite(const std::vector<ListsOf<Segment>>& subLists, const Request& request);

 private:
  /// Lists [first, last).
  struct Band {
    std::size_t first = 0;
    std::size_t last = 0;
    std::uint32_t listCount() const { return static_cast<std::uint32_t>(last - first); }
    bool operator==(const Band&) const = default;
  };
  template <typename Segment>
  std::vector<Band> begin(const std::vector<ListsOf<Segment>>& subLists, const Request& request);
  template <typename Segment>
  void merge(const std::vector<ListsOf<Segment>>& subLists, const Band& band);
  template <typename Segment>
  void compositeBand(const Band& band, ListsOf<Segment>& result);
  template <typename Segment>
  std::uint64_t upload(const std::vector<ListsOf<Segment>>& subLists, const Band& band);

  std::shared_ptr<gpu::Device> device_;
  gpu::Commands commands_;
  gpu::ScanPass scan_;
  gpu::MergePass mergePass_;
  gpu::CompositePass compositePass_;
  ListBuilder builder_;
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
  SurveyBuffer survey_;
  std::optional<Band> surveyed_;  // the only band of a survey, still merged
};

/// The flat picture of the owner's lists: all ranks' supersegments of each list composited in order of depth.
/// Host code.
void flattenMerged(std::span<const SupersegmentLists> subLists, std::span<glm::vec4> rgba,
                   std::span<float> depth);

}  // namespace vdi::detail
