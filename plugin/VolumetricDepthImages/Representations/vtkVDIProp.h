/**
 * @class vtkVDIProp
 * @brief draws a Volumetric Depth Image among the objects of an OpenGL renderer
 *
 * The prop is drawn with the volumes: after all opaque geometry, which hides what lies behind it, and blended
 * over it. Where VTK peels volumes together with translucent geometry, the VDI comes after both.
 *
 * Interactive frames have as few pixels as it takes to draw the prop FrameRate times a second
 * (VDIFramePolicy). They show the last VDI while the next one is being loaded. Deferred frames do both, too,
 * while a thread makes the full picture (VDIStill). If neither the VDI nor the view has changed
 * since the previous frame, the prop renders nothing: the picture is still in the texture (VDIPainter).
 *
 * The view shows errors (MessageActor), and the prop reports each once. The rest of the picture is drawn. The
 * view also shows how far it is turned from the VDI's viewpoint (AngleActor).
 */
#ifndef vtkVDIProp_h
#define vtkVDIProp_h

#include <vtkProp.h>

#include <chrono>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class vtkDataObject;
class vtkOpenGLRenderWindow;
class vtkRenderer;
class vtkTextActor;

namespace vdi {
class Error;
class View;
enum class ViewpointIssue;
}  // namespace vdi
namespace pv {
struct PictureForm;
struct StillView;
}  // namespace pv

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIProp : public vtkProp {
 public:
  static vtkVDIProp* New();
  vtkTypeMacro(vtkVDIProp, vtkProp);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum class FrameKind {
    Interactive,  // may be rough and show the last VDI
    Deferred,     // as Interactive, and the caller renders again once HasMore; whole if that is quick
    Whole,
  };
  /// Prepares for the frames to come. `piece` is what pv::packVdi made, or nullptr. For whole frames, its VDI
  /// is on the device when this returns; other frames show it or the last one. The same piece again costs
  /// nothing.
  void Prepare(vtkDataObject* piece, FrameKind frame);
  /// Whether the last frame was deferred and lacks something that is being made.
  bool IsBehind() const;
  /// Whether the last frame showed the last VDI, because the next one is being loaded.
  bool IsLoading() const;
  /// Whether the missing part is ready, so that another frame would show it.
  bool HasMore() const;
  /// Pauses the threads in the background for a moment, so that the window gets the processor.
  void Rest();
  /// Shows `text` in place of the VDI; an empty text shows the VDI again.
  void SetObstacle(const std::string& text);
  /// The actor with the reason why there is nothing to see. Add it to a renderer of the same size that draws
  /// after the prop's.
  vtkTextActor* GetMessageActor();
  /// The actor with the angle in degrees by which the view is turned. Add it to that renderer, too. Among
  /// several VDIs, the one with the largest angle shows it for all.
  vtkTextActor* GetAngleActor();
  /// Observes StartEvent of the prop's renderer, because VTK doesn't draw props outside the view.
  void LookAround(vtkObject* renderer, unsigned long event, void* data);

  /// Whether the VDI can be seen at all.
  bool IsShown();
  /// The reason why the view shows little or nothing of the VDI; nullopt if it shows enough, or the VDI isn't
  /// shown.
  std::optional<vdi::ViewpointIssue> IssueIn(const vdi::View& view);
  /// The angle in degrees between the view and V_O; nullopt if the VDI isn't to show it, or isn't seen from
  /// outside.
  std::optional<double> AngleIn(const vdi::View& view);

  /// Whether pixels of the background get a depth just short of the background's. IceT composites by depth
  /// and drops the background's pixels otherwise, with the VDI's colours. Default off.
  vtkSetMacro(MarksDepth, bool);

  /// vdi::Reconstruction: 2 (default) also leans the faces of supersegments, 1 blends neighbouring lists, 0
  /// takes the list that the ray crosses.
  vtkSetClampMacro(Reconstruction, int, 0, 2);
  vtkGetMacro(Reconstruction, int);
  /// Adds a plane: the prop shows the side to which its normal points. Reports and ignores a plane without a
  /// normal, and a seventh one.
  void AddClippingPlane(double originX, double originY, double originZ, double normalX, double normalY,
                        double normalZ);
  void RemoveAllClippingPlanes();
  /// The rate of interactive frames, in frames a second, for which the prop chooses its pixels.
  vtkSetClampMacro(FrameRate, double, 1.0, 1000.0);
  vtkGetMacro(FrameRate, double);
  /// Multiplies the picture's opacity. Default 1.
  vtkSetClampMacro(Opacity, double, 0.0, 1.0);
  vtkGetMacro(Opacity, double);
  /// Whether the frames to come are saved as pictures, which show faults but no notices. Default off.
  vtkSetMacro(IsCaptured, bool);
  /// Whether the frames to come show how far the view is turned. Default off.
  vtkSetMacro(SaysAngle, bool);

  void SetVisibility(vtkTypeBool visible) override;
  double* GetBounds() override;
  int RenderOpaqueGeometry(vtkViewport* viewport) override;
  int RenderVolumetricGeometry(vtkViewport* viewport) override;
  int RenderOverlay(vtkViewport* viewport) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;

 protected:
  vtkVDIProp();
  ~vtkVDIProp() override;

 private:
  vtkVDIProp(const vtkVDIProp&) = delete;
  void operator=(const vtkVDIProp&) = delete;

  struct Internals;
  int DrawIn(vtkViewport* viewport);
  bool Draw(vtkRenderer* renderer, vtkOpenGLRenderWindow* window);
  bool DrawDeferred(vtkOpenGLRenderWindow* window, pv::StillView view);
  void StayRough(vtkOpenGLRenderWindow* window, const pv::StillView& view, const vdi::Error& error);
  void DrawRough(vtkOpenGLRenderWindow* window, const pv::StillView& view);
  void DrawNow(vtkOpenGLRenderWindow* window, const pv::StillView& view, const pv::PictureForm& form);
  void Take(std::chrono::steady_clock::duration wait);
  bool Recover(const vdi::Error& error);
  void Fail(const std::exception& error);
  void SmoothAgain(vtkRenderer* renderer);
  void Say(const std::string& text);

  std::unique_ptr<Internals> Internal;
  bool MarksDepth = false;
  int Reconstruction = 2;
  double FrameRate = 30.0;
  double Opacity = 1.0;
  bool IsCaptured = false;
  bool SaysAngle = false;
};

#endif
