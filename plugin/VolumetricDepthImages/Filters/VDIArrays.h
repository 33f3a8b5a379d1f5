// A check that a data set has the requested array.
#ifndef VDIArrays_h
#define VDIArrays_h

#include <string>

#include "VDIBlocks.h"

class vtkAlgorithm;
class vtkDataObject;

namespace pv {

/// A message, with the existing arrays, if `data` has images and none of them has the chosen array on the
/// chosen points or cells; else "". `producer` has made `data`. Downstream of each source, ParaView puts a
/// filter that averages cell arrays from point arrays, and point arrays from cell arrays, on request; such an
/// array doesn't count. The function ignores data that aren't images; blocksOf rejects them.
std::string lackOf(vtkDataObject* data, vtkAlgorithm* producer, const ArrayChoice& choice);

}  // namespace pv

#endif
