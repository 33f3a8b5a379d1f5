// The algorithm in readable form: every stage of a frame on the CPU, one ray at a time, and slow. It is the
// tests' oracle and the best explanation of the shaders.
#pragma once

#include <cstdint>
#include <optional>
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
#include "vdi/reference/Blending.h"
#include "vdi/reference/Interpolation.h"
#include "vdi/reference/Segmenter.h"

namespace vdi::reference {

/// Data that all rays of a frame share.
struct RayInputs {
  Scene scene;  // scene of all ranks
  View view;
  DepthLattice lattice;
  TransferTable table;
  TransferFunction function;
  GenerateSettings settings;
  bool slabs = true;   // samplesAreSlabs
  float reach = 1.0F;  // outermostReach
  SlabTable slabTable;
  std::vector<Isosurface> isosurfaces;  // isosurfacesOf

  /// `view` includes the settings' margin, for pictures too. Throws as depthLattice, bake and View do.
  RayInputs(const Scene& scene, const Camera& camera, const TransferFunction& transferFunction,
            const GenerateSettings& settings);
};

/// The samples of the ray through the centre of pixel (x, y) that `blocks` own, front to back, including
/// transparent ones, up to the one at which the ray reaches the termination opacity. Takes only samples whose
/// number is a multiple of `atOnce`; each counts for that many. The blend mode is Composite or Isosurface.
std::vector<Interval> castRay(const RayInputs& inputs, std::span<const Block> blocks, int x, int y,
                              std::uint32_t atOnce = 1);

/// The extreme scalar of the ray's samples that `blocks` own, at the places where samples are classified, if
/// they have any. The blend mode is Maximum or Minimum.
std::optional<Projection::Extreme> projectRay(const RayInputs& inputs, std::span<const Block> blocks, int x,
                                              int y);

/// DVR: the ground truth, in any blend mode. Depths as in Image; an extreme has that of its first occurrence.
Image renderVolume(const RayInputs& inputs, std::span<const Block> blocks);

/// The (sub-)VDI of these blocks, one list per pixel. SegmentRules describes `cutAtGaps`; pass false if these
/// are all blocks of the scene.
SupersegmentLists generate(const RayInputs& inputs, std::span<const Block> blocks, bool cutAtGaps);

/// Merging: the sub-VDIs of several ranks that agree on one tolerance for each list; `ranks` has each rank's
/// blocks.
std::vector<SupersegmentLists> generateTogether(const RayInputs& inputs,
                                                std::span<const std::vector<Block>> ranks);

/// Interleaves the ranks' lists of each pixel by depth and segments them again to the budget (paper, section
/// 5.2). All inputs have the same number of lists. Uses the settings' supersegments, budget, fill and
/// algorithm.
SupersegmentLists composite(std::span<const SupersegmentLists> subLists, const GenerateSettings& settings,
                            double sampleStep);

/// The VDI seen by `view`. Each supersegment fills the part of its pixel's frustum between its two depths;
/// rays traverse the frusta of V_O's pixels in order, in any direction. `ends` has the depths at which the
/// view's rays end, for example at opaque objects: [height][width]; empty: nowhere. Only the sides that
/// `planes` show are rendered.
Image render(const Vdi& vdi, const View& view, Reconstruction reconstruction,
             std::span<const float> ends = {}, std::span<const ClipPlane> planes = {});

}  // namespace vdi::reference
