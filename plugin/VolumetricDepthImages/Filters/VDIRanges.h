// Ranges of the arrays of a VDI, found fast.
#ifndef VDIRanges_h
#define VDIRanges_h

class vtkDataArray;

namespace pv {

/// Finds the ranges of an array of unsigned char, unsigned int or float and leaves them with it, as if VTK
/// had found them: ParaView asks for them after each update, and VTK takes 30 times as long, on one core. All
/// values must be finite. To be called again when values change.
void rememberRanges(vtkDataArray* array);

}  // namespace pv

#endif
