// What a user chooses about a VDI besides camera and transfer function.
#pragma once

#include <cstdint>
#include <string>

#include "vdi/core/Budget.h"
#include "vdi/core/Region.h"
#include "vdi/core/Shading.h"
#include "vdi/core/Supersegment.h"

namespace vdi {

/// How samples become supersegments.
enum class Algorithm : std::uint32_t {
  Bisection = 0,  // the paper's: a search for the sensitivity per list (section 2.4)
  Merge = 1,      // no search: fine pieces first, then the cheapest neighbours are merged until they fit
};

const char* toString(Algorithm algorithm);  // "bisection", "merge"
/// Throws Error{InvalidArgument} that lists the names there are.
Algorithm algorithmFromString(const std::string& name);

/// What is behind material of that opacity changes no pixel by 1/255.
constexpr double pictureTermination = 0.9999;

constexpr double maxMargin = 4.0;

constexpr double automaticRate = 0.0;

struct GenerateSettings {
  int width = 1280;
  int height = 720;
  /// [0, maxMargin]: share of the picture's width that a VDI has lists for beyond its left and right edge,
  /// and of its height beyond the lower and upper one. No more than there is to see: see marginOf (Margin.h).
  double margin = 0.0;
  std::uint32_t supersegments = 25;  // N_S, 1 .. maxSupersegments
  /// Total: N_S is what lists have on average, where they have that many samples; needs Algorithm::Merge.
  Budget budget = Budget::List;
  double fill = 1.0;  // (0, 1]; with Budget::Total, share of what N_S each would give that's made
  /// [1/64, 64]; or automaticRate: 1, 2 or 4, as the transfer function needs on the volume (SamplingRate.h).
  double samplesPerVoxel = 1.0;
  Algorithm algorithm = Algorithm::Merge;
  /// Rays of more samples than depthCodeFor can number give a VDI of full precision all the same.
  Precision precision = Precision::Compact;
  /// A ray ends once it has accumulated this opacity: (0, 1]; 1 never ends early. What's hidden behind it at
  /// V_O is missing when seen from V_N, hence the default (docs/adr). Pictures need no more than
  /// pictureTermination.
  double terminationOpacity = 1.0;
  Shading shading{};  // off by default
  Region region{};    // all by default
  bool operator==(const GenerateSettings&) const = default;
};

/// Throws Error{InvalidArgument} naming the field, its value and its range.
void validate(const GenerateSettings& settings);

/// At which a ray ends (-log2 of transmittance): infinite for terminationOpacity 1, though there is material
/// of that opacity.
float terminationOpticalDepth(const GenerateSettings& settings);

}  // namespace vdi
