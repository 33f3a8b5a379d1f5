/**
 * @class vtkVDIProp
 * @brief draws a Volumetric Depth Image among the objects of an OpenGL renderer
 *
 * The prop is drawn with the volumes: after all opaque geometry, which hides what lies behind it, and blended
 * over it. Where VTK peels volumes together with translucent geometry, the VDI comes after both.
 *
 * Interactive frames have as few pixels as it takes to draw the prop FrameRate times a second
 * (VDIFramePolicy). They go on showing the last VDI while the next one is loaded. The same holds for deferred
 * frames, beside which a thread makes the full picture (VDIStill). A VDI that is as in the frame before costs
 * no rendering: its picture is still in the texture (VDIPainter).
 *
 * The view shows what goes wrong (MessageActor), and the prop reports it once as an error. The rest of the
 * picture is drawn. The view also shows how far it is turned from the VDI's viewpoint (AngleActor).
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

  enum class Frame {
    Interactive,  // may be rough and show the last VDI
    Deferred,     // likewise, and the caller renders again once HasMore; whole where that is quick
    Whole,
  };
  /// Prepares for the frames to come. `piece` is what pv::packVdi made, or nullptr. For whole frames, its VDI
  /// is on the device when this returns; for others, that or the last one is shown. The same piece again
  /// costs nothing.
  void Prepare(vtkDataObject* piece, Frame frame);
  /// Whether the last frame was deferred and lacks something that is being made.
  bool IsBehind() const;
  /// Whether that has been made, so that another frame would show it.
  bool HasMore() const;
  /// Pauses what is made beside the frames for a moment, so that the window gets the processor.
  void Rest();
  /// Shows `text` in place of the VDI; an empty text shows the VDI again.
  void SetObstacle(const std::string& text);
  /// Says why there is nothing to see. Belongs to a renderer of the same size that draws after the prop's.
  vtkTextActor* GetMessageActor();
  /// Says by how many degrees the view is turned; in that renderer, too. Of several VDIs, the one whose view
  /// is turned farthest says it for all.
  vtkTextActor* GetAngleActor();
  /// Observes StartEvent of the renderer that has this prop: VTK doesn't draw props that it doesn't see.
  void LookAround(vtkObject* renderer, unsigned long event, void* data);

  /// Whether the VDI can be seen at all.
  bool IsShown();
  /// Why the view shows little or nothing of the VDI; nullopt where it isn't shown, too.
  std::optional<vdi::ViewpointIssue> IssueIn(const vdi::View& view);
  /// Degrees between the view and V_O, where the VDI is to say them and is seen from outside.
  std::optional<double> AngleIn(const vdi::View& view);

  /// Whether pixels of the background get a depth just short of the background's. IceT composites by depth
  /// and drops the background's pixels otherwise, with the VDI's colours. Default off.
  vtkSetMacro(MarksDepth, bool);

  /// vdi::Reconstruction: 2 (default) also leans the faces of supersegments, 1 blends neighbouring lists, 0
  /// shows each list as it is.
  vtkSetClampMacro(Reconstruction, int, 0, 2);
  vtkGetMacro(Reconstruction, int);
  /// Interactive frames a second that the VDI's part of a frame allows.
  vtkSetClampMacro(FrameRate, double, 1.0, 1000.0);
  vtkGetMacro(FrameRate, double);
  /// Multiplies the picture's opacity. Default 1.
  vtkSetClampMacro(Opacity, double, 0.0, 1.0);
  vtkGetMacro(Opacity, double);
  /// Whether the frames to come are saved as pictures, which have no notices, only faults. Default off.
  vtkSetMacro(IsCaptured, bool);
  /// Whether the frames to come say how far the view is turned. Default off.
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
