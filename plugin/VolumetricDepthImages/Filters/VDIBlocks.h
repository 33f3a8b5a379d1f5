// VTK data sets as the library knows them.
#ifndef VDIBlocks_h
#define VDIBlocks_h

#include <cstdint>
#include <string>
#include <vector>

#include "vdi/core/Block.h"

class vtkDataObject;

namespace pv {

/// Which scalars of a data set.
struct ArrayChoice {
  std::string name;
  bool cells = false;  // of cells, else of points
  int component = 0;   // -1: magnitude
  bool operator==(const ArrayChoice&) const = default;
};

/// The blocks of an image, or of all images of a composite data set. Scalars are shared, not copied, where
/// VTK has them contiguous with one component and of a type that the library knows. Cells that vtkGhostType
/// calls duplicate, refined or hidden aren't owned, nor those with a hidden point; values of refined and
/// hidden ones are masked. Levels of AMR data come as they are: the finest owns what they share once the
/// blocks of all ranks meet. Throws vdi::Error{InvalidArgument}: a data set that isn't vtkImageData, a
/// rotated image, a missing array, one or a vtkGhostType that's shorter than the image.
std::vector<vdi::Block> blocksOf(vtkDataObject* data, const ArrayChoice& choice);

/// How many components the array of the choice has in the data set; 0 where there is no such array.
int componentsOf(vtkDataObject* data, const ArrayChoice& choice);

/// Numbers that are others whenever blocksOf would give other blocks, by VTK's rule that who changes an array
/// calls its Modified: places of all images, which arrays they have, and when these were modified.
std::vector<std::uint64_t> identityOf(vtkDataObject* data);

}  // namespace pv

#endif
