/**
 * @class vtkVDIImageRepresentation
 * @brief the representation of the outputs of VolumetricDepthImage and of the reader
 *
 * It shows a VDI, the box of its volume, or its flat picture. ParaView's other representations would show the
 * pixels of the flat picture, a unit apart, somewhere in the world.
 */
#ifndef vtkVDIImageRepresentation_h
#define vtkVDIImageRepresentation_h

#include <vtkNew.h>
#include <vtkPVCompositeRepresentation.h>

#include "vtkVDIForViews.h"

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIImageRepresentation
    : public vtkPVCompositeRepresentation {
 public:
  static vtkVDIImageRepresentation* New();
  vtkTypeMacro(vtkVDIImageRepresentation, vtkPVCompositeRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /// Takes only this module's representations. The XML also has those of its base.
  void AddRepresentation(const char* key, vtkPVDataRepresentation* representation) override;

  ///@{
  /// The representation's axes get their input through vtkVDIForViews.
  void SetInputConnection(int port, vtkAlgorithmOutput* input) override;
  void SetInputConnection(vtkAlgorithmOutput* input) override;
  void AddInputConnection(int port, vtkAlgorithmOutput* input) override;
  void AddInputConnection(vtkAlgorithmOutput* input) override;
  void RemoveInputConnection(int port, vtkAlgorithmOutput* input) override;
  void RemoveInputConnection(int port, int index) override;
  ///@}

 protected:
  vtkVDIImageRepresentation() = default;
  ~vtkVDIImageRepresentation() override = default;

 private:
  vtkVDIImageRepresentation(const vtkVDIImageRepresentation&) = delete;
  void operator=(const vtkVDIImageRepresentation&) = delete;

  vtkAlgorithmOutput* PassOn(vtkAlgorithmOutput* input);

  vtkNew<vtkVDIForViews> Passing;
};

#endif
