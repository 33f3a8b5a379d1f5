// The algorithm in readable form: every stage of a frame on the CPU, one ray at a time, nothing clever. It's
// the oracle of the tests and the best explanation of what the shaders do. Slow.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Camera.h"
#include "vdi/core/GenerateSettings.h"
#include "vdi/core/Image.h"
#include "vdi/core/Reconstruction.h"
#include "vdi/core/Region.h"
#include "vdi/core/Scene.h"
#include "vdi/core/SlabTable.h"
#include "vdi/core/TransferFunction.h"
#include "vdi/core/Vdi.h"
#include "vdi/reference/Interpolation.h"
#include "vdi/reference/Segmenter.h"

namespace vdi::reference {

/// What all rays of one frame share.
struct Frame {
  Scene scene;  // of all ranks
  View view;
  DepthLattice lattice;
  TransferTable table;
  GenerateSettings settings;
  bool slabs = true;  // samplesAreSlabs
  SlabTable slabTable;

  /// `view` has the settings' margin, for pictures too. Throws as depthLattice, bake and View do.
  Frame(const Scene& scene, const Camera& camera, const TransferFunction& transferFunction,
        const GenerateSettings& settings);
};

/// The samples of the ray through the centre of pixel (x, y) that `blocks` own, front to back, transparent
/// ones included, up to the one with which the ray's opacity reaches the termination opacity.
/// With `atOnce`, just the samples of the lattice's multiples of it, each in place of that many.
std::vector<Interval> castRay(const Frame& frame, std::span<const Block> blocks, int x, int y,
                              std::uint32_t atOnce = 1);

/// DVR: the ground truth. Depth as Image says.
Image renderVolume(const Frame& frame, std::span<const Block> blocks);

/// The (sub-)VDI of these blocks, one list per pixel. `cutAtGaps`: see SegmentRules; false when these are all
/// blocks there are.
SupersegmentLists generate(const Frame& frame, std::span<const Block> blocks, bool cutAtGaps);

/// By merging: the sub-VDIs of several ranks that agree on one tolerance for each list; `ranks` are their
/// blocks.
std::vector<SupersegmentLists> generateTogether(const Frame& frame,
                                                std::span<const std::vector<Block>> ranks);

/// The ranks' lists of each pixel interleaved by depth and segmented again to the budget (paper,
/// section 5.2). All inputs have the same number of lists. Of the settings: supersegments, budget, fill and
/// algorithm.
SupersegmentLists composite(std::span<const SupersegmentLists> subLists, const GenerateSettings& settings,
                            double sampleStep);

/// The VDI seen by `view`. Each supersegment fills the part of its pixel's frustum between its two depths;
/// rays traverse the frusta of V_O's pixels in order, whatever their direction. `ends`: [height][width]
/// of the view, the depths at which its rays end, say at opaque objects; empty: nowhere. Of the planes, the
/// sides that they show are seen.
Image render(const Vdi& vdi, const View& view, Reconstruction reconstruction,
             std::span<const float> ends = {}, std::span<const ClipPlane> planes = {});

}  // namespace vdi::reference
