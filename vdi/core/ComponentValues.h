// Scalars of arrays that a Block can't hold as they are: vectors, complex numbers, 64-bit integers, and
// arrays in which some numbers mean that a value is missing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/Block.h"

namespace vdi {

/// The types of an array's components: those of ScalarType, with the same numbers, and two more.
enum class ComponentType : std::uint32_t {
  U8 = 0,
  I8 = 1,
  U16 = 2,
  I16 = 3,
  U32 = 4,
  I32 = 5,
  F32 = 6,
  F64 = 7,
  I64 = 8,
  U64 = 9
};

/// Special values of a component's number, as in ScalarArray::component.
constexpr int magnitude = -1;  // magnitude of all components
constexpr int phase = -2;      // phase of two, real and imaginary: from -pi to pi, 0 for the number 0
constexpr int together = -3;   // two: colour and opacity; four: red, green, blue and opacity (Block::colors)

/// An array of vectors. Component c of value (x, y, z) lies at `first` + x * strides.x + y * strides.y + z *
/// strides.z + c * componentStride, in bytes.
struct ComponentArray {
  const std::byte* first = nullptr;
  ByteStrides strides{0};
  ComponentType type = ComponentType::F64;
  int components = 1;
  std::int64_t componentStride = 0;
  /// Numbers that stand for missing values, as fill values do. A component is missing if it equals one of
  /// them once that is rounded to the component's type; 64-bit integers are compared as doubles.
  std::vector<double> missing{};
};

/// The size of a component.
std::size_t sizeOf(ComponentType type);

/// Makes the block show `component` of the array, which has a value at each of the block's places. Values are
/// read in place, so the array must outlive the block. One component of a ScalarType is read unchanged; all
/// else is computed as f64 at each read. `component` is a number below array.components, `magnitude`, or
/// `phase` with two components, or `together` with two or four; of a single component, `magnitude` is the
/// component itself. Together, red, green and blue are shares of an integer type's largest value, or floats
/// from 0 to 1.
///
/// Missing values become NaN, which is transparent and counts in no range. So if the type has one of the
/// array's missing numbers, one component is computed too: as f32 where floats hold all values of its type,
/// else as f64. Magnitudes and phases are missing where a component is.
void showComponent(Block& block, const ComponentArray& array, int component);

/// Makes a block with an array of stored values show NaN where they equal one of the numbers, by the rules of
/// showComponent. The block isn't `computed`.
void leaveOutMissing(Block& block, std::span<const double> missing);

/// Empty if an array of so many components can show `component`; else the reason, to follow the array's name.
std::string componentIssue(int component, int components);

/// The component that a legend names: the coloured one of `together`.
int legendComponent(int component, int components);

}  // namespace vdi
