// The blocks that a filter brings to a volume on the device.
#ifndef VDILoad_h
#define VDILoad_h

#include <vtkType.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "VDIBlocks.h"
#include "vdi/core/Block.h"
#include "vdi/core/Box.h"
#include "vdi/core/Coloring.h"
#include "vdi/core/ScalarRange.h"

class vtkAlgorithm;
class vtkDataObject;
class vtkMultiProcessController;

namespace pv {

/// The identity of a set of blocks. Two filters with the same origin show the same blocks.
struct Origin {
  std::vector<std::uint64_t> input;  // identityOf
  /// Modification time of the pipeline above the filter: in situ, arrays are overwritten in place.
  vtkMTimeType upstream = 0;
  std::optional<double> time;  // none: the data have no time
  ArrayChoice choice;
  bool fillGhosts = true;
  bool operator==(const Origin&) const = default;
};

/// How Volume takes four components together (VTK's vtkVolumeTexture and vtkVolumeInputHelper): for types of
/// up to 16 bits and f32, the opacity of a value is that of the opacity function at low + (high - low) *
/// value / top, where low and high are the ends of the component's range. Other types' opacities are the
/// function's, but the ends of their ranges are the darkest and brightest red, green and blue.
struct OpacityStretch {
  vdi::ScalarRange range;  // of the opacities' component on all ranks
  double top = 0.0;        // 0: none
};

/// This rank's blocks of an origin, and the meaning of their values. The blocks share the values with the
/// input.
struct Load {
  Origin of;
  std::vector<vdi::Block> blocks;
  vdi::ScalarArray array;    // the same on all ranks
  double voxelVolume = 0.0;  // volume of the smallest voxel on any rank; 0 without voxels
  OpacityStretch stretch{};  // the same on all ranks
  std::string lack;          // the reason why none of this rank's blocks has the array
};

/// Throws vdi::Error if there is no input. In situ, a misspelt channel in a script has that effect.
void requireInput(vtkDataObject* input);
/// Returns this rank's blocks. `upstream` makes the input. Throws vdi::Error for an input without such
/// blocks.
Load loadOf(vtkDataObject* input, vtkAlgorithm* upstream, const Origin& origin);
/// Collective: fills in the load's array, voxel volume and stretch, and returns the bounds of all ranks'
/// blocks. Throws vdi::Error on all ranks if there are blocks, but none with the array.
vdi::Box complete(Load& load, vtkDataObject* input, vtkMultiProcessController* controller);

}  // namespace pv

#endif
