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
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include "vtkVolumetricDepthImagesModule.h"

class vtkAbstractArray;
class vtkInformationVector;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIImageData : public vtkImageData {
 public:
  static vtkVDIImageData* New();
  vtkTypeMacro(vtkVDIImageData, vtkImageData);

  /// Those of vtkImageData where there's no VDI with a scene in it.
  void ComputeBounds() override;

  ///@{
  /**
   * The bytes of the .vdi file of what the image carries, made ahead for who sends it to another process.
   * Null where there are none, or once the image carries another VDI. Copies of the image share them.
   */
  void SetFile(vtkUnsignedCharArray* file);
  vtkUnsignedCharArray* GetFile();
  ///@}

  void ShallowCopy(vtkDataObject* source) override;
  void DeepCopy(vtkDataObject* source) override;

  /// For vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT: makes one the first output.
  static void MakeOutput(vtkInformationVector* outputs);

 protected:
  vtkVDIImageData() = default;
  ~vtkVDIImageData() override = default;

 private:
  vtkVDIImageData(const vtkVDIImageData&) = delete;
  void operator=(const vtkVDIImageData&) = delete;

  void TakeFile(vtkDataObject* source);
  vtkAbstractArray* Offsets();

  vtkSmartPointer<vtkUnsignedCharArray> File;
  vtkSmartPointer<vtkAbstractArray> FileIsOf;  // the VDI's offsets
};

#endif
