// The meaning of a VDI's colours: the array that it shows and the transfer function that it was made with.
// Viewers draw a legend from this. Nothing else depends on it.
#pragma once

#include <string>

#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

/// An array of a data set, as the data set names it.
struct ScalarArray {
  std::string name;    // UTF-8; empty when unknown
  bool cells = false;  // cell data; else point data
  int components = 1;  // number in the array, >= 1
  /// The one shown, from 0 to below `components`; or -1: the magnitude of all; or, of two components, real
  /// and imaginary, -2: the phase, from -pi to pi.
  int component = 0;
  bool operator==(const ScalarArray&) const = default;
};

struct Coloring {
  ScalarArray array;
  ScalarRange range;          // range of the shown values, over all ranks; min > max without values
  TransferFunction function;  // valid as validate(TransferFunction) defines it
  bool operator==(const Coloring&) const = default;
};

/// Throws Error{Format} unless components, component and function meet the conditions above and the range is
/// finite or empty.
void validate(const Coloring& coloring);

/// The same function with fewer nodes, for legends. Colours differ by at most 1/512 and are rounded to 5
/// decimals, opacities differ by at most 1e-6. Steps stay steps. The result has at most 4096 nodes of a kind;
/// a function that needs more may differ more.
TransferFunction simplified(const TransferFunction& function);

}  // namespace vdi
