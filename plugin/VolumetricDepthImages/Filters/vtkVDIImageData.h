/**
 * @class vtkVDIImageData
 * @brief the image that carries a VDI, with the bounds of the VDI's scene
 *
 * VDIImageData.h describes the image's contents. Its points are a flat picture, a unit apart. Its bounds,
 * which views, axes and the information panel use, are those of the VDI's scene.
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

  /// Computes vtkImageData's bounds if the image has no VDI with a scene.
  void ComputeBounds() override;

  ///@{
  /**
   * The bytes of the .vdi file with the image's VDI, encoded ahead for sending to another process. Null if
   * there are none, or once the image carries another VDI. Copies of the image share them.
   */
  void SetFile(vtkUnsignedCharArray* file);
  vtkUnsignedCharArray* GetFile();
  ///@}

  void ShallowCopy(vtkDataObject* source) override;
  void DeepCopy(vtkDataObject* source) override;

  /// For vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT: makes a vtkVDIImageData the first output.
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
  vtkSmartPointer<vtkAbstractArray> FileIsOf;  // the offsets of the VDI that File encodes
};

#endif
