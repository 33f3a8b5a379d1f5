// The ways in which rendering fills the space between a VDI's lists.
#pragma once

#include <cstdint>
#include <string>

namespace vdi {

enum class Reconstruction : std::uint32_t {
  Constant = 0,  // a list fills the frustum of its pixel, as in the paper (section 2.4)
  /// At each column of V_O's picture that a ray crosses (or row, if it crosses more rows), rendering blends
  /// two lists by the ray's distance from their centres. V_O's own picture is the same as with Constant. More
  /// accurate, but reads more.
  Smooth = 1,
  /// Like Smooth, but the faces of supersegments slope as the lists around them suggest, so that surfaces
  /// keep their place between lists. V_O's own picture is the same. The most accurate and slowest.
  Sheared = 2,
};

constexpr Reconstruction defaultReconstruction = Reconstruction::Sheared;

const char* toString(Reconstruction reconstruction);  // "constant", "smooth", "sheared"
/// Throws Error{InvalidArgument} that lists the valid names.
Reconstruction reconstructionFromString(const std::string& name);

}  // namespace vdi
