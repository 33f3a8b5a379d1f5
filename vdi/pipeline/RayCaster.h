// One rank's part of a frame on the device: the sub-VDI or DVR of its blocks. Not part of the library's
// interface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Image.h"
#include "vdi/core/Scene.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/gpu/CastPass.h"
#include "vdi/gpu/ComputePipeline.h"
#include "vdi/gpu/VolumeStore.h"
#include "vdi/pipeline/HistogramBuffer.h"
#include "vdi/pipeline/HostAccess.h"
#include "vdi/pipeline/ListBuilder.h"

namespace vdi::detail {

class RayCaster {
 public:
  /// `bands` is the number per frame, if memory allows; 0 lets the device decide.
  RayCaster(std::shared_ptr<gpu::Device> device, std::uint32_t bands);

  /// The volume to cast through. The caller sets its blocks.
  gpu::VolumeStore& volume() { return volume_; }

  struct Inputs {
    const Scene& scene;
    const View& view;
    const DepthLattice& lattice;
    const TransferTable& table;
    const GenerateSettings& settings;
    bool cutAtGaps;
    bool runsOnly;  // one supersegment per run, without a search
    ListForm form;
    std::span<const ColorNode> colorNodes{};  // if the blocks have one value for colours (Block::colors)
  };
  /// Called with the finished share; returning false ends the work early with the present result.
  using Progress = std::function<bool(double)>;

  /// Lists of one frame, one per pixel, made band after band.
  struct Cast {
    gpu::shared::CastParams params{};
    ListBuilder::Options build;  // without the band's rows
    bool cutAtGaps = false;
    bool isEmpty = false;
    std::uint32_t height = 0;
    std::uint32_t rowsPerBand = 1;  // as memory allows; a multiple of shared::countedStride, or all rows
    bool agreed = false;            // ranks agree on each list's tolerance
  };
  Cast begin(const Inputs& inputs);
  /// Merging with several ranks: writes this rank's counts of the counted lists, levelBytes of them, to a
  /// place in host memory. All ranks then add them up byte by byte (comm::ByteSum).
  void countLevels(Cast& cast, HostAccess& memory, std::uint64_t at);
  static std::uint64_t levelBytes(const Cast& cast);
  /// The sum of all ranks' levels, in stretches, which decides the tolerances and this rank's shares of
  /// lists. The device goes on after this returns; the sum must stay until agreedWeights.
  struct LevelSum {
    HostAccess* memory = nullptr;
    std::uint64_t at = 0;
    std::uint64_t first = 0;
    std::uint64_t bytes = 0;
  };
  void takeLevelSum(Cast& cast, std::span<const LevelSum> sum);
  /// Call after takeLevelSum. Returns the number of supersegments that all ranks together will have in each
  /// stretch of shared::countedStride rows.
  std::vector<std::uint32_t> agreedWeights(const Cast& cast);
  /// Starts rows [firstRow, lastRow), which begin at a multiple of shared::countedStride. The device goes on
  /// after this returns; up to bandsAtOnce may be started before the first one is finished. `cast`, `lists`
  /// and the data that `behind` refers to must stay until then. ListBuilder describes `behind` and `after`.
  void startBand(Cast& cast, std::uint32_t firstRow, std::uint32_t lastRow, DeviceLists& lists,
                 const ListBuilder::Behind& behind = {}, const gpu::Submission& after = {});
  /// Waits for the oldest band under way.
  void finishBand();
  static constexpr std::size_t bandsAtOnce = 2;
  /// Waits for the submitted work and drops it. For use after an error.
  void drop();
  /// DVR: renders all pixels of `image`, which has the view's size and its memory from `pool`.
  void render(const Inputs& inputs, const Progress& progress, HostPool& pool, Image& image);
  /// Finds the extreme scalar of each pixel's ray, for a blend mode that projects: colorExtremes explains
  /// `keys`, which has the view's size and its memory from `pool`.
  void project(const Inputs& inputs, const Progress& progress, HostPool& pool,
               HostVector<std::uint64_t>& keys);
  /// Times of the last frame, without transfers. A picture sets only `all`.
  const ListTimes& times() const { return times_; }

 private:
  /// An array of values for the pixels of a picture, on the device and on the host.
  struct PixelArray {
    gpu::Buffer& buffer;
    std::byte* host;      // from a HostPool
    std::uint64_t bytes;  // size of a pixel's value
    std::uint64_t gpu::shared::CastParams::*address;
  };
  void castPixels(const Inputs& inputs, const Progress& progress, HostPool& pool,
                  std::span<const PixelArray> arrays);
  void setColors(gpu::shared::CastParams& params, std::span<const ColorNode> nodes);
  gpu::shared::CastParams prepare(const Inputs& inputs);
  float levelOfNeed(gpu::shared::CastParams params, const Inputs& inputs);
  std::uint32_t bandsWanted() const;
  std::uint32_t rowsPerBand(const Inputs& inputs, std::uint64_t bytesPerPixel, std::uint32_t bands) const;

  std::shared_ptr<gpu::Device> device_;
  std::uint32_t bands_;  // requested per frame; 0: as suits the device
  gpu::VolumeStore volume_;
  gpu::CastPass pass_;
  std::array<ListBuilder, bandsAtOnce> builders_;  // taken in turns
  std::size_t started_ = 0;                        // number of bands
  std::size_t finished_ = 0;
  gpu::Commands commands_;
  gpu::ComputePipeline quota_;  // the ranks' agreement on lists that they have counted together
  gpu::Buffer levels_;
  gpu::Buffer levelsSum_;
  std::vector<HostAccess*> sumsOnHost_;
  gpu::Buffer agreedTolerances_;
  gpu::Buffer agreedPreSegments_;
  gpu::Buffer agreedQuotas_;
  gpu::Buffer weights_;
  gpu::Buffer weightsReadback_;
  gpu::Buffer colors_;
  gpu::Buffer depths_;
  gpu::Buffer extremes_;
  gpu::Buffer colorNodes_;
  HistogramBuffer histogram_;
  ListTimes times_;
};

}  // namespace vdi::detail
