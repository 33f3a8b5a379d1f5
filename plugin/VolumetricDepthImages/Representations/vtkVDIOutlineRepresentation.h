/**
 * @class vtkVDIOutlineRepresentation
 * @brief shows the box of the volume that a Volumetric Depth Image was made from
 *
 * ParaView's own outline of the image that carries a VDI would frame the flat picture's pixels.
 */
#ifndef vtkVDIOutlineRepresentation_h
#define vtkVDIOutlineRepresentation_h

#include <vtkNew.h>
#include <vtkOutlineRepresentation.h>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class vtkPolyData;
class vtkTrivialProducer;

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIOutlineRepresentation
    : public vtkOutlineRepresentation {
 public:
  static vtkVDIOutlineRepresentation* New();
  vtkTypeMacro(vtkVDIOutlineRepresentation, vtkOutlineRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;
  int ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* in, vtkInformation* out) override;

  using vtkOutlineRepresentation::GetInternalOutputPort;
  /// The output with the box's corners, in place of the input's copy.
  vtkAlgorithmOutput* GetInternalOutputPort(int port, int connection) override;

 protected:
  vtkVDIOutlineRepresentation();
  ~vtkVDIOutlineRepresentation() override;

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

 private:
  vtkVDIOutlineRepresentation(const vtkVDIOutlineRepresentation&) = delete;
  void operator=(const vtkVDIOutlineRepresentation&) = delete;

  vtkNew<vtkPolyData> Corners;  // the box's lowest and highest corner, or none
  vtkNew<vtkTrivialProducer> Producer;
};

#endif
