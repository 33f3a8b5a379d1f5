/**
 * @class vtkVDIProp
 * @brief draws a Volumetric Depth Image among the objects of an OpenGL renderer
 *
 * Drawn with the volumes: after all opaque geometry, which hides what lies behind it, and blended over it.
 * Where volumes are peeled together with translucent geometry, after that, too.
 * While it's interactive, it has as few pixels as it takes to be drawn FrameRate times a second, but one for
 * each 64 of the window's at least; and a VDI
 * that comes is loaded beside the frames, which go on showing the one before. The same holds for deferred
 * frames, beside which the picture in full is made.
 *
 * What goes wrong is said in the view (MessageActor) and, once, as an error; the rest of the picture is
 * drawn. How far the view is turned from the VDI's viewpoint is said, too (AngleActor).
 */
#ifndef vtkVDIProp_h
#define vtkVDIProp_h

#include <vtkProp.h>

#include <chrono>
#include <exception>
#include <glm/fwd.hpp>
#include <memory>
#include <optional>
#include <span>
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
class ViewMatrices;
struct StillView;
}  // namespace pv

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkVDIProp : public vtkProp {
 public:
  static vtkVDIProp* New();
  vtkTypeMacro(vtkVDIProp, vtkProp);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum class Frame {
    Interactive,  // may be rough and show the VDI before
    Deferred,     // likewise, and another one is asked for as soon as HasMore; where it's quick, it's whole
    Whole,
  };
  /// For the frames to come: `piece` is what pv::packVdi made, or nullptr. If they're to be whole, its VDI is
  /// on the device when this returns; else that or the last one before is shown. The same again costs
  /// nothing.
  void Prepare(vtkDataObject* piece, Frame frame);
  /// Whether the last frame was deferred and lacks something that is being made, and whether that is there.
  bool IsBehind() const;
  bool HasMore() const;
  /// Lets what is made beside the frames leave the processor to the window for a moment.
  void Rest();
  /// Says `text` in place of the VDI, which isn't drawn while there's a text.
  void SetObstacle(const std::string& text);
  /// Says why there's nothing to see; in a renderer of the same size that draws after this prop's.
  vtkTextActor* GetMessageActor();
  /// Says by how many degrees the view is turned; there, too. Of several VDIs, the one that is turned
  /// farthest says it for all.
  vtkTextActor* GetAngleActor();
  /// For an observer of StartEvent of the renderer that has this prop: props that it doesn't see aren't
  /// drawn.
  void LookAround(vtkObject* renderer, unsigned long event, void* data);

  /// Whether pixels in front of which nothing opaque was drawn get a depth just short of the background's.
  /// IceT, compositing by depth, drops them otherwise, colour and all. Default off.
  vtkSetMacro(MarksDepth, bool);

  /// vdi::Reconstruction: 2 (default) also leans the faces of supersegments, 1 blends neighbouring lists, 0
  /// shows each as it is.
  vtkSetClampMacro(Reconstruction, int, 0, 2);
  vtkGetMacro(Reconstruction, int);
  /// Of the VDI's part in interactive frames, per second.
  vtkSetClampMacro(FrameRate, double, 1.0, 1000.0);
  vtkGetMacro(FrameRate, double);
  /// Of its picture as a whole, beside that of the VDI. Default 1.
  vtkSetClampMacro(Opacity, double, 0.0, 1.0);
  vtkGetMacro(Opacity, double);
  /// Whether the frames to come are for a picture that is taken. Where nothing is wrong but the viewpoint, of
  /// the VDI or of the view, others alone say so. Default off.
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

  class Pace;
  struct Form;
  struct Internals;
  bool IsShown();
  std::optional<vdi::ViewpointIssue> IssueIn(const vdi::View& view);
  bool IsBlank(vtkRenderer* renderer, const vdi::View& view);
  bool IsFirst(vtkRenderer* renderer, const vdi::View& view, vdi::ViewpointIssue issue);
  std::optional<double> AngleIn(const vdi::View& view);
  std::optional<vdi::View> ViewOf(vtkRenderer* renderer);
  void NoteViewpoint(vtkRenderer* renderer);
  void NoteAngle(vtkRenderer* renderer);
  int DrawIn(vtkViewport* viewport);
  bool Draw(vtkRenderer* renderer, vtkOpenGLRenderWindow* window);
  bool DrawDeferred(vtkOpenGLRenderWindow* window, pv::StillView view);
  void StayRough(vtkOpenGLRenderWindow* window, const pv::StillView& view, const vdi::Error& error);
  void DrawRough(vtkOpenGLRenderWindow* window, const pv::StillView& view);
  void DrawNow(vtkOpenGLRenderWindow* window, const pv::ViewMatrices& matrices, const glm::ivec2& portSize,
               const Form& form);
  void ShowPicture(vtkOpenGLRenderWindow* window, const glm::ivec2& size,
                   std::span<const glm::u8vec4> picture);
  void ShowTexture(vtkOpenGLRenderWindow* window);
  void MarkDepth(vtkOpenGLRenderWindow* window);
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
