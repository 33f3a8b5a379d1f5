// Conversion of ParaView's colour maps and opacity functions to the library's transfer functions.
#ifndef VDITransferFunctions_h
#define VDITransferFunctions_h

#include <vector>

#include "vdi/core/TransferFunction.h"

class vtkPiecewiseFunction;
class vtkScalarsToColors;

namespace pv {

/// The transfer function that ParaView's representation Volume shows. That is the function through the
/// control points, in the map's colour space. Volume ignores discrete values (NumberOfTableValues) and
/// categories (InterpretValuesAsCategories), which are for surfaces. Colours and opacities are within 1/1000
/// of VTK's; steps stay steps. Beyond the control points, and for infinite values, the result has VTK's
/// values, such as the colours above and below the range.
///
/// Without a colour map, it is "Cool to Warm" over [low, high]. Without an opacity function, it is the colour
/// map's own if it has one, else a ramp from 0 to 1. `unitDistance` is in world units.
vdi::TransferFunction transferFunctionOf(vtkScalarsToColors* colors, vtkPiecewiseFunction* opacity,
                                         double low, double high, double unitDistance);

/// The function's opacities from `low` to `high`, moved and stretched to [0, top].
std::vector<vdi::OpacityNode> stretched(const vdi::TransferFunction& function, double low, double high,
                                        double top);

}  // namespace pv

#endif
