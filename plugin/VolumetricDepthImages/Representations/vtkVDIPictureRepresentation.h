/**
 * @class vtkVDIPictureRepresentation
 * @brief shows the flat picture of a Volumetric Depth Image at its place in the world
 *
 * Input: the output of vtkVDIGenerator, with or without a VDI, or of vtkVDIReader. The picture is a rectangle
 * in the middle of the scene (pv::cornersOf), perpendicular to the viewing direction of the VDI's viewpoint,
 * with the picture's own colours and opacity. Seen from the viewpoint, it is the VDI's picture.
 */
#ifndef vtkVDIPictureRepresentation_h
#define vtkVDIPictureRepresentation_h

#include <vtkNew.h>
#include <vtkPVDataRepresentation.h>

#include <array>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class vtkActor;
class vtkDataObject;
class vtkImageData;
class vtkPolyData;
class vtkPolyDataMapper;
class vtkTexture;

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIPictureRepresentation
    : public vtkPVDataRepresentation {
 public:
  static vtkVDIPictureRepresentation* New();
  vtkTypeMacro(vtkVDIPictureRepresentation, vtkPVDataRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* in, vtkInformation* out) override;
  void SetVisibility(bool visible) override;
  /// Multiplies the picture's own opacity. Default 1.
  void SetOpacity(double opacity);

 protected:
  vtkVDIPictureRepresentation();
  ~vtkVDIPictureRepresentation() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  bool AddToView(vtkView* view) override;
  bool RemoveFromView(vtkView* view) override;

 private:
  vtkVDIPictureRepresentation(const vtkVDIPictureRepresentation&) = delete;
  void operator=(const vtkVDIPictureRepresentation&) = delete;

  void Pack(vtkDataObject* input);
  void Draw(vtkDataObject* piece);

  vtkNew<vtkPolyData> Piece;  // the rectangle, and the picture in its field data; travels to views
  std::array<double, 6> PieceBounds{};
  vtkNew<vtkImageData> Image;
  vtkNew<vtkTexture> Texture;
  vtkNew<vtkPolyDataMapper> Mapper;
  vtkNew<vtkActor> Actor;
};

#endif
