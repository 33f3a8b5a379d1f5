#pragma once
// The interface through which a VTK array tells the filter where its values lie in memory.

#include <glm/glm.hpp>

#include "vdi/core/ComponentValues.h"

namespace pv {

/// A base class of VTK arrays whose values are in the simulation's own order in memory, belong to places
/// offset from points or cell centres, or are missing where they equal some numbers. The adaptor makes such
/// arrays, and a dynamic_cast finds them.
class StridedSource {
 public:
  StridedSource() = default;
  virtual ~StridedSource() = default;
  StridedSource(const StridedSource&) = delete;
  StridedSource& operator=(const StridedSource&) = delete;
  StridedSource(StridedSource&&) = delete;
  StridedSource& operator=(StridedSource&&) = delete;
  /// The values in place, valid while this object exists, with the numbers that stand for missing ones.
  virtual vdi::ComponentArray memory() const = 0;
  /// The number of values along each axis.
  virtual glm::ivec3 counts() const = 0;
  virtual glm::dvec3 offset() const = 0;  // in cells
};

}  // namespace pv
