// How a VDI is seen between its lists.
#pragma once

#include <cstdint>
#include <string>

namespace vdi {

enum class Reconstruction : std::uint32_t {
  Constant = 0,  // a list fills the frustum of its pixel, as in the paper (section 2.4)
  /// Rays blend two lists at each column of V_O's picture that they cross (or row, whichever they cross more
  /// of), by how far they are from the lists' centres. V_O's own picture is the same. Truer, and reads more.
  Smooth = 1,
};

const char* toString(Reconstruction reconstruction);  // "constant", "smooth"
/// Throws Error{InvalidArgument} that lists the names there are.
Reconstruction reconstructionFromString(const std::string& name);

}  // namespace vdi
