/**
 * @class vtkVDIImageData
 * @brief the image that carries a VDI: its bounds are those of the scene
 *
 * VDIImageData.h says what the image holds. Its points are a flat picture, a unit apart. Where it is in the
 * world, for views, axes and the information panel, is where the VDI's scene is.
 */
#ifndef vtkVDIImageData_h
#define vtkVDIImageData_h

#include <vtkImageData.h>

#include "vtkVolumetricDepthImagesModule.h"

class vtkInformationVector;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIImageData : public vtkImageData {
 public:
  static vtkVDIImageData* New();
  vtkTypeMacro(vtkVDIImageData, vtkImageData);

  /// Those of vtkImageData where there's no VDI with a scene in it.
  void ComputeBounds() override;

  /// For vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT: makes one the first output.
  static void MakeOutput(vtkInformationVector* outputs);

 protected:
  vtkVDIImageData() = default;
  ~vtkVDIImageData() override = default;

 private:
  vtkVDIImageData(const vtkVDIImageData&) = delete;
  void operator=(const vtkVDIImageData&) = delete;
};

#endif
