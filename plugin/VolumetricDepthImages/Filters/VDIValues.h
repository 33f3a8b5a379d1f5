// A sample of the values that a VDI shows, for ParaView's colour editor. Its range buttons and its histogram
// ask the shown data, and a VDI has no scalars.
#ifndef VDIValues_h
#define VDIValues_h

#include <span>
#include <vector>

#include "vdi/core/Block.h"
#include "vdi/core/Coloring.h"

class vtkImageData;
namespace vdi::comm {
class Communicator;
}

namespace pv {

/// Returns up to some thousands of finite values, evenly from all ranks' blocks. The root (rank 0) gets them,
/// followed by both ends of `range`; they are empty on the other ranks, and if `range` is empty. Masked
/// values are left out. Collective. Throws on all ranks.
std::vector<double> sampleOf(std::span<const vdi::Block> blocks, const vdi::ScalarRange& range,
                             const vdi::comm::Communicator& comm);

/// Adds the values to the image's field data, as a double array with the name and the number of components of
/// the original array. The shown component holds the values; the others are 0. So the array's ranges, of that
/// component or of the magnitude, are those of the shown values. Phases are an array of one component.
/// Without a name or values it adds nothing.
void setShownValues(vtkImageData* image, const vdi::ScalarArray& array, std::span<const double> values);
/// Adds both ends of the coloring's range, if it has one, as setShownValues adds values. A VDI that was made
/// elsewhere has only these.
void setShownRange(vtkImageData* image, const vdi::Coloring& coloring);

}  // namespace pv

#endif
