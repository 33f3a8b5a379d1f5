// The simulation's blocks and arrays as the data set that scripts see.
#pragma once

#include <vtkPartitionedDataSet.h>
#include <vtkSmartPointer.h>

#include <cstdint>
#include <optional>
#include <span>

#include "catalyst_adaptor/Fields.h"
#include "catalyst_adaptor/vdi_catalyst.h"

namespace vdi::catalyst {

/// A vtkPartitionedDataSet with a vtkImageData for each of this rank's blocks.
class VtkGrid {
 public:
  /// Makes the images, with marks of their ghost cells and no other arrays. Throws std::runtime_error if
  /// there is no memory for the marks.
  explicit VtkGrid(std::span<const vdi_catalyst_block> blocks);

  /// Gives the images the arrays of `fields`, which has the same blocks, and marks all values as
  /// changed for VTK. The arrays use the simulation's memory. After an exception the images lack
  /// some arrays until the next call.
  void update(const Fields& fields);

  vtkPartitionedDataSet& data() { return *data_; }

 private:
  vtkSmartPointer<vtkPartitionedDataSet> data_;
  std::optional<std::uint64_t> shown_;  // the fields' `changes` whose arrays the images have
};

}  // namespace vdi::catalyst
