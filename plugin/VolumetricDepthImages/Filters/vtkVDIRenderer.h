/**
 * @class vtkVDIRenderer
 * @brief renders a Volumetric Depth Image from a viewpoint
 *
 * Input: the output of vtkVDIGenerator or vtkVDIReader. Output: a vtkImageData with point data RGBA and Depth
 * (view-space depth of the nearest visible material, infinity where there is none). It renders on rank 0,
 * which has the VDI; the output of other ranks is empty.
 */
#ifndef vtkVDIRenderer_h
#define vtkVDIRenderer_h

#include <vtkImageAlgorithm.h>

#include <array>
#include <memory>
#include <vector>

#include "vtkVolumetricDepthImagesModule.h"

namespace vdi {
struct Camera;
}

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIRenderer : public vtkImageAlgorithm {
 public:
  static vtkVDIRenderer* New();
  vtkTypeMacro(vtkVDIRenderer, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The viewpoint V_N, as vtkCamera has it. With UseOriginalCamera (default off), and while position and
   * focal point are the same, as they are by default, the filter uses the VDI's own viewpoint, turned by
   * Azimuth degrees as vtkCamera::Azimuth turns: about the focal point, around the view-up as set. The filter
   * warns of a viewpoint that can't show the VDI truly (vdi::ViewpointIssue), unless the previous picture had
   * the same issue.
   */
  vtkSetVector3Macro(CameraPosition, double);
  vtkSetVector3Macro(CameraFocalPoint, double);
  vtkSetVector3Macro(CameraViewUp, double);
  vtkSetMacro(CameraViewAngle, double);
  vtkSetMacro(CameraParallelProjection, bool);
  vtkSetMacro(CameraParallelScale, double);
  vtkSetMacro(UseOriginalCamera, bool);
  vtkSetMacro(Azimuth, double);
  ///@}

  /// Width and height of the picture; 0 0: those of the VDI.
  vtkSetVector2Macro(Resolution, int);

  /// vdi::Reconstruction: 2 (default) also leans the faces of supersegments, 1 blends neighbouring lists, 0
  /// takes the list that the ray crosses.
  vtkSetClampMacro(Reconstruction, int, 0, 2);

  ///@{
  /// The picture shows what lies on the sides of these planes to which their normals point; at most 6.
  void AddClippingPlane(double originX, double originY, double originZ, double normalX, double normalY,
                        double normalZ);
  void RemoveAllClippingPlanes();
  ///@}

 protected:
  vtkVDIRenderer();
  ~vtkVDIRenderer() override;

  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int FillInputPortInformation(int port, vtkInformation* info) override;

 private:
  vtkVDIRenderer(const vtkVDIRenderer&) = delete;
  void operator=(const vtkVDIRenderer&) = delete;

  struct Internals;
  bool IsOther(vtkDataObject* input);
  void Render(vtkDataObject* input, vtkImageData* output);
  vdi::Camera Viewpoint() const;
  void WarnOf(const vdi::Camera& camera, int width, int height);

  std::unique_ptr<Internals> Internal;
  double CameraPosition[3] = {0.0, 0.0, 0.0};
  double CameraFocalPoint[3] = {0.0, 0.0, 0.0};
  double CameraViewUp[3] = {0.0, 1.0, 0.0};
  double CameraViewAngle = 30.0;
  bool CameraParallelProjection = false;
  double CameraParallelScale = 1.0;
  bool UseOriginalCamera = false;
  double Azimuth = 0.0;
  int Resolution[2] = {0, 0};
  int Reconstruction = 2;
  std::vector<std::array<double, 6>> ClippingPlanes;
};

#endif
