/**
 * @class vtkVDIRepresentation
 * @brief shows a Volumetric Depth Image in render views
 *
 * Input: the output of vtkVDIGenerator or vtkVDIReader. The VDI goes to where pictures are shown, the client
 * or the root, and is drawn there (vtkVDIProp): moving the camera moves no data. Other objects of the view
 * are drawn there, too, for colours alone can't be merged by depth. Where another representation insists on
 * being drawn on all ranks (ParaView's Volume does), there's a message instead of the VDI.
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

  /// Whether what is rendered next is for a picture that somebody takes of the window, and no frame of it.
  static bool IsCaptured(vtkRenderWindow* window);
  /// From now on still frames of that view's window are deferred (vtkVDIProp::Frame), for somebody renders it
  /// again as soon as there's more. Pictures that are taken of a window are whole.
  static void DeferStillFrames(vtkPVRenderView* view);
  /// Of no view any more.
  static void DeferNoStillFrames();

  /// As vtkVDIProp has them.
  void SetReconstruction(int reconstruction);
  void SetFrameRate(double rate);
  void SetOpacity(double opacity);
  /// Whether windows say how far the view is turned from the VDI's viewpoint. Default on. Pictures that are
  /// taken don't.
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

  vtkVDIProp::Frame FrameOf(vtkPVRenderView* view);
  bool IsInteractive(vtkPVRenderView* view);
  void Drag();
  void Drop();
  void ForgetInteractor();

  vtkNew<vtkPolyData> Piece;                  // pv::packVdi
  bool HasPacked = false;                     // in the update that's going on
  vtkWeakPointer<vtkAbstractArray> PackedOf;  // offsets of the VDI in the piece
  vtkNew<vtkVDIProp> Prop;

  vtkWeakPointer<vtkRenderWindowInteractor> Interactor;  // the view's, observed
  std::array<unsigned long, 2> Observers{};
  unsigned long StartObserver = 0;  // of the view's renderer
  bool SaysAngle = true;
  bool IsDragged = false;  // the camera is, by mouse
  std::chrono::steady_clock::time_point LastInteractive;
};

#endif
