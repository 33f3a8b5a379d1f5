// Conversion of VTK data sets to the library's blocks.
#ifndef VDIBlocks_h
#define VDIBlocks_h

#include <cstdint>
#include <string>
#include <vector>

#include "vdi/core/Block.h"

class vtkDataObject;

namespace pv {

/// The scalars of a data set that a VDI shows.
struct ArrayChoice {
  std::string name;
  bool cells = false;  // an array of cells, else of points
  int component = 0;   // -1: magnitude
  bool operator==(const ArrayChoice&) const = default;
};

/// The blocks of an image, or of all images of a composite data set. A block shares its scalars with VTK
/// where they are contiguous, have one component and a type that the library knows; otherwise it has a copy.
/// A block doesn't own cells that vtkGhostType marks as duplicate, refined or hidden, nor cells with a hidden
/// point. It masks the values of refined and hidden ones. Levels of AMR data stay as they are: once the
/// blocks of all ranks meet, the finest level owns the overlap. Throws vdi::Error{InvalidArgument} for a data
/// set other than vtkImageData, a rotated image, a missing array, and an array or a vtkGhostType that is
/// shorter than the image.
std::vector<vdi::Block> blocksOf(vtkDataObject* data, const ArrayChoice& choice);

/// The number of components of the chosen array in the data set; 0 if there is no such array.
int componentsOf(vtkDataObject* data, const ArrayChoice& choice);

/// Numbers that change whenever blocksOf would give other blocks: the places of all images, their arrays, and
/// the arrays' times of modification. They rely on VTK's rule that code which changes an array calls its
/// Modified.
std::vector<std::uint64_t> identityOf(vtkDataObject* data);

}  // namespace pv

#endif
