// How rendering fills the space between a VDI's lists.
#pragma once

#include <cstdint>
#include <string>

namespace vdi {

enum class Reconstruction : std::uint32_t {
  Constant = 0,  // a list fills the frustum of its pixel, as in the paper (section 2.4)
  /// At each column of V_O's picture that a ray crosses (or row, if it crosses more of these), it blends two
  /// lists by its distance from their centres. V_O's own picture is the same. More accurate, but reads more.
  Smooth = 1,
  /// Smooth, and the faces of supersegments lean as the lists around them suggest (vdi/reference/Slopes.h).
  /// Surfaces keep their place between lists. V_O's own picture is the same. Most accurate, and takes
  /// longest.
  Sheared = 2,
};

constexpr Reconstruction defaultReconstruction = Reconstruction::Sheared;

const char* toString(Reconstruction reconstruction);  // "constant", "smooth", "sheared"
/// Throws Error{InvalidArgument} that lists the valid names.
Reconstruction reconstructionFromString(const std::string& name);

}  // namespace vdi
