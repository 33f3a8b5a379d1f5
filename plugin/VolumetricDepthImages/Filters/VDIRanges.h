// Fast computation of the ranges of a VDI's arrays.
#ifndef VDIRanges_h
#define VDIRanges_h

class vtkDataArray;

namespace pv {

/// Finds the ranges of an array of unsigned char, unsigned int or float, and stores them with the array as
/// VTK would. ParaView asks for them after each update, and VTK takes 30 times as long on one core. All
/// values must be finite. Call it again when values change.
void rememberRanges(vtkDataArray* array);

}  // namespace pv

#endif
