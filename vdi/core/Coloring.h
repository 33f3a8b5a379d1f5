// What the colours of a VDI mean: the array that it shows and the transfer function that it was made with.
// Viewers draw a legend from this. Nothing else depends on it.
#pragma once

#include <string>

#include "vdi/core/ScalarRange.h"
#include "vdi/core/TransferFunction.h"

namespace vdi {

/// An array of a data set, as its owner names it.
struct ScalarArray {
  std::string name;    // UTF-8; empty when unknown
  bool cells = false;  // of cells, else of points
  int components = 1;  // that the array has, >= 1
  int component = 0;   // that is shown, < components; -1: the magnitude
  bool operator==(const ScalarArray&) const = default;
};

struct Coloring {
  ScalarArray array;
  ScalarRange range;          // of the shown values, over all ranks; min > max when there are none
  TransferFunction function;  // sound: validate(TransferFunction)
  bool operator==(const Coloring&) const = default;
};

/// Throws Error{Format} unless components, component and function are as said above and the range is finite
/// or empty.
void validate(const Coloring& coloring);

/// The same function with fewer nodes, for legends: colours differ by at most 1/512 and are rounded to 5
/// decimals, opacities differ by at most 1e-6. Steps stay steps. It never has more than 4096 nodes of a kind,
/// for which it may differ more.
TransferFunction simplified(const TransferFunction& function);

}  // namespace vdi
