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
  bool cells = false;             // an array of cells, else of points
  int component = 0;              // or vdi::magnitude, or vdi::phase
  bool nearest = false;           // vdi::Block::nearest
  std::vector<double> missing{};  // numbers that stand for missing values, beside those of a StridedSource
  bool operator==(const ArrayChoice&) const = default;
};

/// The blocks of an image, or of all images of a composite data set that have the array. Blocks read the
/// values where VTK, or the simulation, has them. Only VTK arrays of bits, and those without the standard
/// memory layout, are copied. A block doesn't own cells that vtkGhostType marks as duplicate, refined or
/// hidden, nor cells with a hidden point. It masks the values of refined and hidden cells and of hidden
/// points. Levels of AMR data stay unchanged: once the blocks of all ranks meet, the finest level owns the
/// overlap. Direction matrices may permute and mirror the axes: values are read in the world's order. Throws
/// vdi::Error{InvalidArgument} for a data set other than vtkImageData, an image rotated otherwise, a
/// component that the array lacks, and an array or a vtkGhostType that is shorter than the image.
std::vector<vdi::Block> blocksOf(vtkDataObject* data, const ArrayChoice& choice);

/// The number of components of the chosen array in the data set; 0 if there is no such array.
int componentsOf(vtkDataObject* data, const ArrayChoice& choice);

/// Numbers that change whenever blocksOf would give other blocks: the places of all images, their arrays, and
/// the arrays' times of modification. They rely on VTK's rule that code which changes an array calls its
/// Modified.
std::vector<std::uint64_t> identityOf(vtkDataObject* data);

}  // namespace pv

#endif
