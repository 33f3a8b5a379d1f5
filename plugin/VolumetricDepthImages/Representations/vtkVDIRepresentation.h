/**
 * @class vtkVDIRepresentation
 * @brief shows a Volumetric Depth Image in render views
 *
 * Input: the output of vtkVDIGenerator or vtkVDIReader. The VDI goes to the process that shows pictures, the
 * client or the root, and is drawn there (vtkVDIProp): moving the camera moves no data. The view's other
 * objects are drawn there, too, because colours without depths can't be merged by depth. If another
 * representation must be drawn on all ranks, as ParaView's Volume must, a message replaces the VDI.
 */
#ifndef vtkVDIRepresentation_h
#define vtkVDIRepresentation_h

#include <vtkNew.h>
#include <vtkPVDataRepresentation.h>
#include <vtkWeakPointer.h>

#include <array>
#include <chrono>

#include "vtkVDIProp.h"
#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class vtkAbstractArray;
class vtkPVRenderView;
class vtkPolyData;
class vtkRenderWindow;
class vtkRenderWindowInteractor;

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIRepresentation : public vtkPVDataRepresentation {
 public:
  static vtkVDIRepresentation* New();
  vtkTypeMacro(vtkVDIRepresentation, vtkPVDataRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* in, vtkInformation* out) override;
  void SetVisibility(bool visible) override;

  /// Whether the next rendering is for a picture that is taken of the window, and not for one of its frames.
  static bool IsCaptured(vtkRenderWindow* window);
  /// Defers still frames of that view's window from now on (vtkVDIProp::FrameKind). The caller must render
  /// the view again as soon as there is more. Pictures that are taken of a window are whole.
  static void DeferStillFrames(vtkPVRenderView* view);
  /// Ends the deferral for all views.
  static void DeferNoStillFrames();

  /// Properties of vtkVDIProp.
  void SetReconstruction(int reconstruction);
  void AddClippingPlane(double originX, double originY, double originZ, double normalX, double normalY,
                        double normalZ);
  void RemoveAllClippingPlanes();
  void SetFrameRate(double rate);
  void SetOpacity(double opacity);
  /// Whether windows show how far the view is turned from the VDI's viewpoint. Default on. Pictures that are
  /// taken of a window don't show it.
  vtkSetMacro(SaysAngle, bool);

 protected:
  vtkVDIRepresentation();
  ~vtkVDIRepresentation() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  bool AddToView(vtkView* view) override;
  bool RemoveFromView(vtkView* view) override;

 private:
  vtkVDIRepresentation(const vtkVDIRepresentation&) = delete;
  void operator=(const vtkVDIRepresentation&) = delete;

  vtkVDIProp::FrameKind FrameKindOf(vtkPVRenderView* view);
  bool IsInteractive(vtkPVRenderView* view);
  void Drag();
  void Drop();
  void ForgetInteractor();

  vtkNew<vtkPolyData> Piece;                  // made by pv::packVdi
  bool HasPacked = false;                     // within the current update
  vtkWeakPointer<vtkAbstractArray> PackedOf;  // offsets of the VDI in the piece
  vtkNew<vtkVDIProp> Prop;

  vtkWeakPointer<vtkRenderWindowInteractor> Interactor;  // the view's interactor, which this observes
  std::array<unsigned long, 2> Observers{};
  unsigned long StartObserver = 0;  // observer of the view's renderer
  bool SaysAngle = true;
  bool IsDragged = false;  // the user drags the camera
  std::chrono::steady_clock::time_point LastInteractive;
};

#endif
