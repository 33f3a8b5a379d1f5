// Whether a data set has the array that was asked for.
#ifndef VDIArrays_h
#define VDIArrays_h

#include "VDIBlocks.h"

class vtkAlgorithm;
class vtkDataObject;

namespace pv {

/// Throws vdi::Error{InvalidArgument}, with the arrays that there are, unless all images of `data` have the
/// array of the choice where it's asked for. `producer` is what made `data`: ParaView puts a filter behind
/// each source that makes cell arrays of point arrays and the other way round when asked for them, by
/// averaging; such an array isn't accepted. Other data than images is left to blocksOf.
void requireArray(vtkDataObject* data, vtkAlgorithm* producer, const ArrayChoice& choice);

}  // namespace pv

#endif
