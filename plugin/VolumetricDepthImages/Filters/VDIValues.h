// Some of the values that a VDI shows, for ParaView's colour editor: its range buttons and its histogram ask
// the data that are shown, and a VDI has no scalars.
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

/// Finite values from all over the ranks' blocks, at most some thousands, evenly from all of them. On the
/// root (rank 0), with both ends of `range` at the end; empty on the other ranks, and where the range is.
/// Masked values aren't among them. Collective. Throws on all ranks.
std::vector<double> sampleOf(std::span<const vdi::Block> blocks, const vdi::ScalarRange& range,
                             const vdi::comm::Communicator& comm);

/// Adds them to the image's field data: a double array of the name and the components of the one that they
/// are of, in which the component that is shown has them and the others are 0. So its ranges, of that
/// component or of the magnitude, are those of what is shown. Without a name or values there is none.
void setShownValues(vtkImageData* image, const vdi::ScalarArray& array, std::span<const double> values);
/// The same of both ends of the coloring's range, where it has one: what a VDI says that was made elsewhere.
void setShownRange(vtkImageData* image, const vdi::Coloring& coloring);

}  // namespace pv

#endif
