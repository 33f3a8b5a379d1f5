// Checks that a data set has the requested array.
#ifndef VDIArrays_h
#define VDIArrays_h

#include "VDIBlocks.h"

class vtkAlgorithm;
class vtkDataObject;

namespace pv {

/// Throws vdi::Error{InvalidArgument}, which lists the existing arrays, unless all images of `data` have the
/// chosen array on the chosen points or cells. `producer` has made `data`. Downstream of each source,
/// ParaView puts a filter that averages cell arrays from point arrays, and point arrays from cell arrays, on
/// request; such an array isn't accepted. The function ignores data that are no images; blocksOf rejects
/// them.
void requireArray(vtkDataObject* data, vtkAlgorithm* producer, const ArrayChoice& choice);

}  // namespace pv

#endif
