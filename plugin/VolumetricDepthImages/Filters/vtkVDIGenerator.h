/**
 * @class vtkVDIGenerator
 * @brief makes a Volumetric Depth Image (VDI) of a distributed volume
 *
 * Input: vtkImageData, or images in vtkPartitionedDataSet(Collection), vtkMultiBlockDataSet,
 * vtkOverlappingAMR or vtkNonOverlappingAMR. Each rank brings the blocks it has, in any arrangement. Output
 * on rank 0: a vtkImageData of Resolution with the picture seen from the camera, and the VDI in its field
 * data (VDIImageData.h has the arrays); empty on other ranks. Collective: all ranks of the controller update
 * together; when one fails, all return 0, and all try again when asked again.
 *
 * Filters of one process whose input, array, component and ghost layers are the same share the volume on the
 * device, and the memory in which VDIs are made (VDIVolume.h). They make their VDIs one after the other: an
 * update in place waits for what others prepare.
 */
#ifndef vtkVDIGenerator_h
#define vtkVDIGenerator_h

#include <vtkImageAlgorithm.h>
#include <vtkSmartPointer.h>

#include <array>
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
   * Colour map; its scalar opacity function is used unless SetScalarOpacityFunction gave another one. None:
   * "Cool to Warm" over the range that the scalars have at the first frame of that array.
   */
  void SetLookupTable(vtkScalarsToColors* table);
  void SetScalarOpacityFunction(vtkPiecewiseFunction* function);
  ///@}

  ///@{
  /**
   * Distance over which the opacity function holds, in world units; 0 (default): the scene's diagonal by the
   * cube root of the number of voxels in it, as ParaView's volume representation starts with.
   */
  vtkSetClampMacro(ScalarOpacityUnitDistance, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(ScalarOpacityUnitDistance, double);
  ///@}

  /// Component of a multi-component array; -1 (default): magnitude.
  vtkSetMacro(Component, int);
  /// Lists of the VDI's picture: columns and rows. 0 0 (default): 1280 x 720.
  vtkSetVector2Macro(Resolution, int);
  ///@{
  /**
   * The settings of vdi/core/SettingsTable.h, which has their ranges and defaults. Names are enumerators:
   * vdi::Algorithm, vdi::Budget and vdi::Precision. A value out of range fails the next update.
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
  /// By one of these names, which must be in the table.
  void SetSetting(const char* property, double value);
  double GetSetting(const char* property) const;
  ///@}
  ///@{
  /**
   * The lights of Shade, at most 8, which move with the viewpoint; none: ParaView's light kit as a new view
   * has it.
   */
  /// Its direction in the camera's axes and its colour: vdi::Light.
  void AddLight(double right, double up, double back, double red, double green, double blue);
  void RemoveAllLights();
  ///@}
  ///@{
  /**
   * What is shown of the volume: vdi::Region. With Cropping (default off) what is in the box, in world
   * coordinates, lowest and highest x, y and z. And the sides of the planes to which their normals point.
   */
  vtkSetMacro(Cropping, bool);
  vtkGetMacro(Cropping, bool);
  vtkSetVector6Macro(CroppingBox, double);
  vtkGetVector6Macro(CroppingBox, double);
  void AddClippingPlane(double originX, double originY, double originZ, double normalX, double normalY,
                        double normalZ);
  void RemoveAllClippingPlanes();
  ///@}
  ///@{
  /**
   * How the scalars along a ray become a pixel, an enumerator of vdi::BlendMode: 0 (default) composite, 1
   * maximum intensity, 2 minimum intensity, 3 isosurfaces of the IsosurfaceValues. A VDI holds composite
   * blending alone: an update with another mode fails unless PictureOnly is on.
   */
  vtkSetClampMacro(BlendMode, int, 0, 3);
  vtkGetMacro(BlendMode, int);
  void AddIsosurfaceValue(double value);
  void RemoveAllIsosurfaceValues();
  ///@}
  /// Exchange ghost layers where blocks lack them.
  vtkSetMacro(FillGhosts, bool);

  /// Plain volume rendering of the blocks, right for any arrangement and in any blend mode, without a VDI
  /// beside the picture; default off.
  vtkSetMacro(PictureOnly, bool);
  /// The simulation's step, kept in the VDI.
  vtkSetMacro(TimeStep, int);

  ///@{
  /**
   * The viewpoint V_O, as vtkCamera has it. Where position and focal point are the same, as they are unless
   * set, the camera looks along -z at the whole scene, as vtkRenderer::ResetCamera places it; view-up, angle
   * and projection are used then too, the parallel scale isn't.
   */
  vtkSetVector3Macro(CameraPosition, double);
  vtkSetVector3Macro(CameraFocalPoint, double);
  vtkSetVector3Macro(CameraViewUp, double);
  vtkSetMacro(CameraViewAngle, double);
  vtkSetMacro(CameraParallelProjection, bool);
  vtkSetMacro(CameraParallelScale, double);
  ///@}

  void SetController(vtkMultiProcessController* controller);

  /// Time and memory of the last frame, a line per rank; empty on ranks other than 0.
  vtkGetStringMacro(Report);
  /// What the last VDI was and took, as pv::numbersOf gives it; all 0 without one, and on ranks other than 0.
  vtkGetVectorMacro(LastVdi, double, 17);

  ///@{
  /**
   * How a window gets a new VDI without waiting for it. After Hold, changed maps and properties don't make
   * the output out of date, until Release; another input still does. What Prepare has begun is given up: once
   * GetPreparation says that it has ended, another Prepare waits for nothing. Prepare starts to make the VDI
   * of the properties and maps as they are now, in a thread of its own, unless the output is that already,
   * and of the input that a view has asked for last. On several ranks it gets on while somebody calls
   * ServePreparation again and again, which takes some milliseconds, on all of them. The update after Release
   * takes that VDI, or waits for it, if nothing has changed since, and makes one otherwise. Collective, but
   * for Hold and Release.
   */
  void Hold();
  void Prepare();
  void ServePreparation();
  void Release();
  int GetHeld();
  ///@}
  ///@{
  /**
   * How a window's views do without waiting for what isn't made yet. Between BeginView and EndView the output
   * is updated for a view. After DeferViews such an update makes nothing: it gives the VDI that was made
   * last, or a picture of nothing that says so (pv::isBeingMade), and GetOutdated is true until the output is
   * what was asked for. Prepare then makes that, new blocks included. All other updates make it in place or
   * wait for the preparation, and so do a view's where Prepare can't make it, with PictureOnly, without a
   * colour map, and after a failure. DeferNoViews ends it (default). To be called on all ranks.
   */
  void DeferViews();
  void DeferNoViews();
  void BeginView();
  void EndView();
  int GetOutdated();
  ///@}
  /// Of what Prepare has begun, in percent; 100 when it's there. -1: nothing is prepared, because nothing was
  /// begun, it was given up or went wrong, or it can't be: before the first update, and with PictureOnly.
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
  struct Frame;
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
  Frame CurrentFrame(const vdi::Box& bounds, double voxelVolume, const vdi::ScalarRange& range);
  Frame AskedFrame();
  Frame ShownFrame(const pv::Shown& shown);
  vdi::Region CurrentRegion() const;
  vdi::Blending CurrentBlending() const;
  vtkMTimeType CurrentMTime();
  pv::Origin OriginOf(vtkDataObject* input);
  bool TakePreparation(const pv::Origin& origin, vtkImageData* output);
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
  double CroppingBox[6] = {0.0, 1.0, 0.0, 1.0, 0.0, 1.0};
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
