// A user's choices for a VDI besides camera and transfer function.
#pragma once

#include <cstdint>
#include <string>

#include "vdi/core/Blending.h"
#include "vdi/core/Budget.h"
#include "vdi/core/Region.h"
#include "vdi/core/Shading.h"
#include "vdi/core/Supersegment.h"

namespace vdi {

/// The algorithm that makes supersegments of samples.
enum class Algorithm : std::uint32_t {
  Bisection = 0,  // the paper's: searches each list's sensitivity (section 2.4)
  Merge = 1,      // no search: starts with fine pieces, then merges the cheapest neighbours until they fit
};

const char* toString(Algorithm algorithm);  // "bisection", "merge"
/// Throws Error{InvalidArgument} that lists the valid names.
Algorithm algorithmFromString(const std::string& name);

/// How values make the scalar between them: trilinear, or the value of the nearest lattice point or cell, as
/// labels need it. The numbers are VTK's.
enum class Interpolation : std::uint32_t { Nearest = 0, Linear = 1 };

const char* toString(Interpolation interpolation);  // "nearest", "linear"
/// Throws Error{InvalidArgument} that lists the valid names.
Interpolation interpolationFromString(const std::string& name);

/// Material behind this opacity changes no pixel by 1/255.
constexpr double pictureTermination = 0.9999;

constexpr double maxMargin = 4.0;

constexpr double automaticRate = 0.0;
/// What automaticRate becomes with Interpolation::Nearest.
constexpr double rateOfNearest = 2.0;

/// The functions of VdiGenerator throw Error{InvalidArgument} for values outside the ranges given here.
struct GenerateSettings {
  int width = 1280;  // of the picture, in pixels, 1 .. View::maxSide; the margin is extra
  int height = 720;  // likewise
  /// Extent of the margin in [0, maxMargin]: beyond the left and right edges as a share of the picture's
  /// width, and beyond the lower and upper edges as a share of its height. Vdi::margin is smaller if the
  /// scene's box ends earlier, or if the picture's samples would else not be slabs (samplesAreSlabs).
  double margin = 0.0;
  std::uint32_t supersegments = 25;  // N_S, 1 .. maxSupersegments
  /// Total: lists have N_S on average, if they have that many samples; needs Algorithm::Merge.
  Budget budget = Budget::List;
  double fill = 1.0;  // (0, 1]; with Budget::Total, the share to make of N_S supersegments per list
  /// Samples per smallest spacing of the scene, along the view axis: [1/64, 64]; or automaticRate: 1, 2 or 4,
  /// as the transfer function needs on the volume. automaticRate is the default of ParaView's filter and of
  /// JSON runs, but not of this struct.
  double samplesPerVoxel = 1.0;
  /// Nearest: blocks that neighbours of other spacings touch should have Block::nearest set.
  Interpolation interpolation = Interpolation::Linear;
  Algorithm algorithm = Algorithm::Merge;
  /// If rays have more samples than depthCodeFor can number, the VDI has full precision regardless.
  Precision precision = Precision::Compact;
  /// A ray ends once it has accumulated this opacity: (0, 1]; 1 never ends early. Material that such a ray
  /// leaves out at V_O is missing when seen from V_N, hence the default (docs/adr). Pictures need no more
  /// than pictureTermination.
  double terminationOpacity = 1.0;
  Shading shading{};    // off by default
  Region region{};      // everything by default
  Blending blending{};  // composite by default; VDIs need it
  bool operator==(const GenerateSettings&) const = default;
};

/// The optical depth (-log2 of transmittance) at which a ray ends. It is infinite for a terminationOpacity of
/// 1, although material of that opacity exists.
float terminationOpticalDepth(const GenerateSettings& settings);

}  // namespace vdi
