/**
 * @class vtkVDIProperties
 * @brief the properties of a filter that makes Volumetric Depth Images
 *
 * The viewpoint, the colours and the settings of a frame, as properties of the filter, and the frame's inputs
 * that follow from them.
 */
#ifndef vtkVDIProperties_h
#define vtkVDIProperties_h

#include <vtkImageAlgorithm.h>
#include <vtkSmartPointer.h>

#include <array>
#include <vector>

#include "vtkVolumetricDepthImagesModule.h"

namespace vdi {
struct Blending;
struct Box;
struct Camera;
struct GenerateSettings;
struct Region;
struct ScalarRange;
}  // namespace vdi
namespace pv {
struct FrameInputs;
struct OpacityStretch;
}  // namespace pv
class vtkPiecewiseFunction;
class vtkScalarsToColors;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIProperties : public vtkImageAlgorithm {
 public:
  vtkTypeMacro(vtkVDIProperties, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The colour map. Its scalar opacity function is used unless SetScalarOpacityFunction gave another one.
   * Without a map, the filter uses "Cool to Warm" over the range of the scalars in the array's first frame.
   */
  void SetLookupTable(vtkScalarsToColors* table);
  void SetScalarOpacityFunction(vtkPiecewiseFunction* function);
  ///@}

  /// The distance over which the opacity function holds, in world units. 0 (default) means the scene's
  /// diagonal divided by the cube root of the number of its voxels, the initial value of ParaView's volume
  /// representation.
  vtkSetClampMacro(ScalarOpacityUnitDistance, double, 0.0, VTK_DOUBLE_MAX);

  /// The component of a multi-component array; -1 (default): the magnitude.
  vtkSetMacro(Component, int);
  ///@{
  /// Numbers that stand for missing values (vdi::ComponentArray::missing).
  void AddMissingValue(double value);
  void RemoveAllMissingValues();
  ///@}
  /// The columns and rows of lists in the VDI's picture. 0 0 (default): 1280 x 720.
  vtkSetVector2Macro(Resolution, int);
  ///@{
  /**
   * The settings of vdi/core/SettingsTable.h, which has their ranges and defaults. Interpolation
   * Type, Algorithm, Budget and Precision are the enumerators of vdi::Interpolation, vdi::Algorithm,
   * vdi::Budget and vdi::Precision. With a value out of range, the next update fails.
   */
  void SetMargin(double share) { this->SetSetting("Margin", share); }
  void SetSupersegments(int most) { this->SetSetting("Supersegments", most); }
  void SetSamplingRate(double samples) { this->SetSetting("SamplingRate", samples); }
  void SetInterpolationType(int type) { this->SetSetting("InterpolationType", type); }
  void SetAlgorithm(int algorithm) { this->SetSetting("Algorithm", algorithm); }
  void SetBudget(int budget) { this->SetSetting("Budget", budget); }
  void SetFill(double share) { this->SetSetting("Fill", share); }
  void SetPrecision(int precision) { this->SetSetting("Precision", precision); }
  void SetTerminationOpacity(double opacity) { this->SetSetting("TerminationOpacity", opacity); }
  void SetShade(bool shade) { this->SetSetting("Shade", shade ? 1.0 : 0.0); }
  void SetAmbient(double share) { this->SetSetting("Ambient", share); }
  void SetDiffuse(double share) { this->SetSetting("Diffuse", share); }
  /// Sets a setting by its name, which must be in the table.
  void SetSetting(const char* property, double value);
  ///@}
  ///@{
  /**
   * The lights of Shade, at most 8, which move with the viewpoint. Without any, the filter uses the light kit
   * of ParaView's new views.
   */
  /// Adds a light by its direction in the camera's axes and its colour (vdi::Light).
  void AddLight(double right, double up, double back, double red, double green, double blue);
  void RemoveAllLights();
  ///@}
  ///@{
  /**
   * The shown part of the volume (vdi::Region): with Cropping (default off), the part in the box, given by
   * the lowest and highest x, y and z in world coordinates; all 0 (the default) mean the whole scene. Of a
   * clipping plane's two sides, the one to which its normal points is shown.
   */
  vtkSetMacro(Cropping, bool);
  vtkSetVector6Macro(CroppingBox, double);
  void AddClippingPlane(double originX, double originY, double originZ, double normalX, double normalY,
                        double normalZ);
  void RemoveAllClippingPlanes();
  ///@}
  ///@{
  /**
   * The rule by which the scalars along a ray become a pixel, an enumerator of vdi::BlendMode: 0 (default)
   * composite, 1 maximum intensity, 2 minimum intensity, 3 isosurfaces of the IsosurfaceValues. A VDI holds
   * only composite blending: with another mode, an update fails unless PictureOnly is on.
   */
  vtkSetClampMacro(BlendMode, int, 0, 3);
  void AddIsosurfaceValue(double value);
  void RemoveAllIsosurfaceValues();
  ///@}
  /// Whether ranks exchange ghost layers that blocks lack.
  vtkSetMacro(FillGhosts, bool);

  /// Whether the filter makes a picture by plain volume rendering, correct for any arrangement of blocks and
  /// in any blend mode, but no VDI; default off.
  vtkSetMacro(PictureOnly, bool);
  /// The simulation's step, kept in the VDI.
  vtkSetMacro(TimeStep, int);

  ///@{
  /**
   * The viewpoint V_O, as vtkCamera has it. While position and focal point are the same, as they are by
   * default, the camera looks along -z at the whole scene, as vtkRenderer::ResetCamera places it. In that
   * case view-up, angle and projection still apply, but the parallel scale doesn't.
   */
  vtkSetVector3Macro(CameraPosition, double);
  vtkSetVector3Macro(CameraFocalPoint, double);
  vtkSetVector3Macro(CameraViewUp, double);
  vtkSetMacro(CameraViewAngle, double);
  vtkSetMacro(CameraParallelProjection, bool);
  vtkSetMacro(CameraParallelScale, double);
  ///@}

 protected:
  vtkVDIProperties();
  ~vtkVDIProperties() override;

  /// The modification time of the properties and maps.
  vtkMTimeType CurrentMTime();
  /// The columns and rows of the picture.
  std::array<int, 2> PictureSize() const;
  vdi::Camera Viewpoint(const vdi::Box& bounds) const;
  /// Throws vdi::Error if a VDI can't hold this blending.
  vdi::Blending CurrentBlending() const;
  vdi::GenerateSettings CurrentSettings() const;
  /// The frame for blocks in these bounds, with the current properties and maps. `range` is that of the
  /// default map.
  pv::FrameInputs CurrentFrame(const vdi::Box& bounds, double voxelVolume, const vdi::ScalarRange& range,
                               const pv::OpacityStretch& stretch);

  vtkSmartPointer<vtkScalarsToColors> LookupTable;
  vtkSmartPointer<vtkPiecewiseFunction> ScalarOpacityFunction;
  double ScalarOpacityUnitDistance = 0.0;
  int Component = -1;
  std::vector<double> MissingValues;
  int Resolution[2] = {0, 0};
  std::vector<double> Settings;  // [vdi::settingsTable().size()]
  std::vector<std::array<double, 6>> Lights;
  bool Cropping = false;
  double CroppingBox[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  std::vector<std::array<double, 6>> ClippingPlanes;
  int BlendMode = 0;
  std::vector<double> IsosurfaceValues;
  bool FillGhosts = true;
  bool PictureOnly = false;
  int TimeStep = 0;
  double CameraPosition[3] = {0.0, 0.0, 0.0};
  double CameraFocalPoint[3] = {0.0, 0.0, 0.0};
  double CameraViewUp[3] = {0.0, 1.0, 0.0};
  double CameraViewAngle = 30.0;
  bool CameraParallelProjection = false;
  double CameraParallelScale = 1.0;

 private:
  vtkVDIProperties(const vtkVDIProperties&) = delete;
  void operator=(const vtkVDIProperties&) = delete;

  vdi::Region CurrentRegion() const;
};

#endif
