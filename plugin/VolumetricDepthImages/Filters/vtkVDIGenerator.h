/**
 * @class vtkVDIGenerator
 * @brief makes a Volumetric Depth Image (VDI) of a distributed volume
 *
 * The input is vtkImageData, or images in vtkPartitionedDataSet(Collection), vtkMultiBlockDataSet,
 * vtkOverlappingAMR or vtkNonOverlappingAMR. Each rank brings the blocks that it has, in any arrangement. On
 * rank 0, the output is a vtkImageData of size Resolution with the picture from the camera, and with the VDI
 * in its field data (VDIImageData.h describes the arrays). On other ranks it is empty. Updates are
 * collective: all ranks of the controller update together. When one fails, all return 0, and all try again at
 * the next request.
 *
 * Filters of one process with the same input, array, component and ghost layers share the volume on the
 * device, and the memory in which VDIs are made (VDIVolume.h). They make their VDIs one after the other: an
 * update in place waits for the other filters' preparations.
 */
#ifndef vtkVDIGenerator_h
#define vtkVDIGenerator_h

#include <vtkImageAlgorithm.h>
#include <vtkSmartPointer.h>

#include <array>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vtkVolumetricDepthImagesModule.h"

namespace vdi {
struct Blending;
struct Box;
struct Camera;
struct GenerateSettings;
struct Region;
struct ScalarRange;
struct Shading;
}  // namespace vdi
namespace pv {
struct Origin;
struct Shown;
class Volume;
}  // namespace pv
class vtkMultiProcessController;
class vtkPiecewiseFunction;
class vtkScalarsToColors;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIGenerator : public vtkImageAlgorithm {
 public:
  static vtkVDIGenerator* New();
  vtkTypeMacro(vtkVDIGenerator, vtkImageAlgorithm);
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
  /// The columns and rows of lists in the VDI's picture. 0 0 (default): 1280 x 720.
  vtkSetVector2Macro(Resolution, int);
  ///@{
  /**
   * The settings of vdi/core/SettingsTable.h, which has their ranges and defaults. Algorithm, Budget and
   * Precision are the enumerators of vdi::Algorithm, vdi::Budget and vdi::Precision. With a value out of
   * range, the next update fails.
   */
  void SetMargin(double share) { this->SetSetting("Margin", share); }
  void SetSupersegments(int most) { this->SetSetting("Supersegments", most); }
  void SetSamplingRate(double samples) { this->SetSetting("SamplingRate", samples); }
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

  void SetController(vtkMultiProcessController* controller);

  /// Time and memory of the last frame, one line per rank; empty on ranks other than 0.
  vtkGetStringMacro(Report);
  /// The last VDI's properties and costs, as pv::numbersOf gives them; all 0 without one, and on ranks other
  /// than 0.
  vtkGetVectorMacro(LastVdi, double, 17);

  /// Gives the output the range of another component of its array, ahead of the VDI that will show it.
  /// ParaView fits a map to the output's range as soon as a user has chosen a component.
  void AnnounceRange(const char* array, int components, int component, double low, double high);

  ///@{
  /**
   * These functions give a window a new VDI without waiting. After Hold, changed maps and properties don't
   * make the output out of date until Release; another input still does. Hold also gives up a running
   * preparation: once GetPreparation reports its end, another Prepare needn't wait. Prepare starts a
   * thread that makes the VDI of the current properties and maps, and of the input that a view has asked for
   * last; it does nothing if that is the output already. On several ranks, the preparation makes progress
   * while all of them call ServePreparation again and again, which takes some milliseconds each. The update
   * after Release takes the prepared VDI, or waits for it, if nothing has changed since, and makes one
   * otherwise. All functions but Hold and Release are collective.
   */
  void Hold();
  void Prepare();
  void ServePreparation();
  void Release();
  int GetHeld();
  ///@}
  ///@{
  /**
   * With these functions, a window's views don't wait for a VDI. Between BeginView and EndView, an update is
   * for a view. After DeferViews such an update makes nothing: it gives the last VDI, or an empty picture
   * that is marked as being made (pv::isBeingMade), and GetOutdated is true until the output is the requested
   * one. A call of Prepare then makes the requested one, new blocks included. All other updates make the
   * output in place or wait for the preparation. A view's update does so, too, if Prepare can't make the
   * output: with PictureOnly, without a colour map, and after a failure. DeferNoViews ends the deferral
   * (default). Call these functions on all ranks.
   */
  void DeferViews();
  void DeferNoViews();
  void BeginView();
  void EndView();
  int GetOutdated();
  ///@}
  /// The preparation's progress in percent, 100 once its output is ready. -1 if there is no preparation: none
  /// was begun, it was given up, it failed, or it is impossible (before the first update, and with
  /// PictureOnly).
  int GetPreparation();

  vtkMTimeType GetMTime() override;

 protected:
  vtkVDIGenerator();
  ~vtkVDIGenerator() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  vtkTypeBool ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                             vtkInformationVector* outputs) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestUpdateExtent(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

 private:
  vtkVDIGenerator(const vtkVDIGenerator&) = delete;
  void operator=(const vtkVDIGenerator&) = delete;

  struct Internals;
  struct FrameInputs;
  bool ServesView() const;
  bool Defer(vtkDataObject* input, const pv::Origin& origin, bool hasFailed, vtkImageData* output);
  bool Ask(vtkDataObject* input, const pv::Origin& origin);
  void GiveEarlier(vtkImageData* output);
  void Generate(vtkDataObject* input, const pv::Origin& origin, vtkImageData* output);
  bool IsRoot() const;
  void Enter();
  void UseVolume(const std::shared_ptr<pv::Volume>& volume);
  void ChooseVolume(const pv::Origin& origin);
  void ShowBlocks(vtkDataObject* input, const pv::Origin& origin);
  vdi::ScalarRange StandInRange(const pv::Shown& shown);
  vdi::Camera Viewpoint(const vdi::Box& bounds) const;
  FrameInputs CurrentFrame(const vdi::Box& bounds, double voxelVolume, const vdi::ScalarRange& range);
  FrameInputs AskedFrame();
  FrameInputs ShownFrame(const pv::Shown& shown);
  vdi::Region CurrentRegion() const;
  vdi::Blending CurrentBlending() const;
  vtkMTimeType CurrentMTime();
  pv::Origin OriginOf(vtkDataObject* input);
  bool TakePreparation(const pv::Origin& origin, vtkImageData* output);
  int EndWithout(const std::exception_ptr& failure, vtkImageData* output);
  void SayFailure(const std::string& what);
  void TakeReport();
  vdi::GenerateSettings CurrentSettings() const;
  void KeepEarlier(vtkImageData* output);
  bool DropLostDevice();
  std::array<int, 2> PictureSize() const;
  void SetReport(const char* text);

  std::unique_ptr<Internals> Internal;
  vtkSmartPointer<vtkMultiProcessController> Controller;
  vtkSmartPointer<vtkScalarsToColors> LookupTable;
  vtkSmartPointer<vtkPiecewiseFunction> ScalarOpacityFunction;
  double ScalarOpacityUnitDistance = 0.0;
  int Component = -1;
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
  char* Report = nullptr;
  double LastVdi[17] = {};
};

#endif
