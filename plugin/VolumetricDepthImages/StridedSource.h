#pragma once
// What an array of VTK may tell the filter about its memory.

#include <glm/glm.hpp>

#include "vdi/core/ComponentValues.h"

namespace pv {

/// A base class of those arrays of VTK whose values lie in an order of the simulation's, or beside the points
/// or the middles of cells. Such arrays come from the adaptor; a dynamic_cast finds them.
class StridedSource {
 public:
  StridedSource() = default;
  virtual ~StridedSource() = default;
  StridedSource(const StridedSource&) = delete;
  StridedSource& operator=(const StridedSource&) = delete;
  StridedSource(StridedSource&&) = delete;
  StridedSource& operator=(StridedSource&&) = delete;
  /// The values where they lie, which they do as long as this object exists.
  virtual vdi::ComponentArray memory() const = 0;
  /// The number of values along each axis.
  virtual glm::ivec3 counts() const = 0;
  virtual glm::dvec3 offset() const = 0;  // in cells
};

}  // namespace pv
