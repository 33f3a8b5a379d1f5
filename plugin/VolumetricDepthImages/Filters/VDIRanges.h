// Fast computation of the ranges of a VDI's arrays.
#ifndef VDIRanges_h
#define VDIRanges_h

#include <vtkAbstractArray.h>
#include <vtkDataArray.h>
#include <vtkObjectFactory.h>
#include <vtkSetGet.h>

class vtkInformationDoubleVectorKey;
class vtkInformationInformationVectorKey;

namespace pv {

/// Finds the ranges of an array of unsigned char, unsigned int or float, and stores them with the array as
/// VTK would. ParaView asks for them after each update, and VTK takes 30 times as long on one core. All
/// values must be finite. Call it again when values change.
void rememberRanges(vtkDataArray* array);

/// Copies the ranges of all components, or that of the tuples' lengths, which are stored with the array.
/// Returns false if there are none.
bool recallRanges(vtkDataArray* array, vtkInformationInformationVectorKey* components, double* ranges);
bool recallRange(vtkDataArray* array, vtkInformationDoubleVectorKey* length, double range[2]);

/// An array of VTK's class `Array` that gives a vtkFieldData the ranges stored with it. From ParaView 5.13
/// on, the server asks the field data for ranges, which would otherwise compute them while the client waits.
template <typename Array>
class Ranged : public Array {
 public:
  vtkTemplateTypeMacro(Ranged<Array>, Array);
  static Ranged* New() { VTK_STANDARD_NEW_BODY(Ranged<Array>); }

 protected:
  Ranged() = default;
  ~Ranged() override = default;

  using Array::ComputeFiniteScalarRange;
  using Array::ComputeFiniteVectorRange;
  using Array::ComputeScalarRange;
  using Array::ComputeVectorRange;
  bool ComputeScalarRange(double* ranges, const unsigned char* ghosts, unsigned char skipped) override {
    return (ghosts == nullptr && recallRanges(this, vtkAbstractArray::PER_COMPONENT(), ranges)) ||
           Array::ComputeScalarRange(ranges, ghosts, skipped);
  }
  bool ComputeFiniteScalarRange(double* ranges, const unsigned char* ghosts, unsigned char skipped) override {
    return (ghosts == nullptr && recallRanges(this, vtkAbstractArray::PER_FINITE_COMPONENT(), ranges)) ||
           Array::ComputeFiniteScalarRange(ranges, ghosts, skipped);
  }
  bool ComputeVectorRange(double range[2], const unsigned char* ghosts, unsigned char skipped) override {
    return (ghosts == nullptr && recallRange(this, vtkDataArray::L2_NORM_RANGE(), range)) ||
           Array::ComputeVectorRange(range, ghosts, skipped);
  }
  bool ComputeFiniteVectorRange(double range[2], const unsigned char* ghosts,
                                unsigned char skipped) override {
    return (ghosts == nullptr && recallRange(this, vtkDataArray::L2_NORM_FINITE_RANGE(), range)) ||
           Array::ComputeFiniteVectorRange(range, ghosts, skipped);
  }

 private:
  Ranged(const Ranged&) = delete;
  void operator=(const Ranged&) = delete;
};

}  // namespace pv

#endif
