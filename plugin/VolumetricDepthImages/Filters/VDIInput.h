// The request that a filter makes of its input, and the origin that identifies the input's blocks.
#ifndef VDIInput_h
#define VDIInput_h

#include "VDILoad.h"

class vtkAlgorithm;
class vtkDataObject;
class vtkInformation;
class vtkMultiProcessController;

namespace pv {

/// For RequestUpdateExtent: requests this rank's piece of the input that `info` describes, with the ghost
/// layers that the filter's array needs.
void requestPiece(vtkInformation* info, vtkAlgorithm* filter, vtkMultiProcessController* controller);

/// The origin of the blocks in `input`, null or the filter's input, with the filter's array.
Origin originOf(vtkDataObject* input, vtkAlgorithm* filter, int component, bool fillGhosts);

}  // namespace pv

#endif
