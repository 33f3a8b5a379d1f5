/**
 * @class vtkSMVDIGeneratorProxy
 * @brief gives VolumetricDepthImage what the active view shows: viewpoint, size, colour map and opacity
 *
 * What isn't set at the first update is taken from the active view, if that is a render view that shows its
 * input or whose camera somebody has placed: the camera where position and focal point are the same,
 * Resolution where it is 0 0, ScalarOpacityUnitDistance where it is 0, Shade, Diffuse and Ambient where the
 * view shows it as a shaded volume, Cropping and CroppingBox where it shows it as a cropped one, BlendMode
 * and IsosurfaceValues where it shows it as a volume, Lights.
 * Traces and state files have these values. Proxies that a state file makes take nothing.
 *
 * When nobody has set LookupTable, the proxy takes ParaView's colour map for the chosen array, the one that a
 * representation of the input uses in the active view, or would use, with its opacity function. A user who
 * sets another one, or none after that, is left alone. A map or opacity function that is still as ParaView
 * made it, or holds a preset on [0, 1], gets the range that the array has then, once; control points that
 * somebody has set stay where they are.
 *
 * After the first update, another array, component or input takes its own map as soon as it is sent
 * (UpdateVTKObjects), so that whatever updates the filter next, a view or a writer, finds it. The map of the
 * array before is replaced, and no other one. Another input brings its unit distance, unless somebody has
 * set one.
 */
#ifndef vtkSMVDIGeneratorProxy_h
#define vtkSMVDIGeneratorProxy_h

#include <vtkSMSourceProxy.h>
#include <vtkWeakPointer.h>

#include <optional>
#include <string>

#include "vtkVolumetricDepthImagesModule.h"

namespace vdi {
struct Box;
struct VdiEstimate;
}  // namespace vdi
class vtkPVDataInformation;
class vtkSMRenderViewProxy;
class vtkSMViewProxy;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIGeneratorProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIGeneratorProxy* New();
  vtkTypeMacro(vtkSMVDIGeneratorProxy, vtkSMSourceProxy);

  void UpdatePipeline() override;
  void UpdatePipeline(double time) override;

  /// Whether UpdatePipeline is for a view, which needn't wait for a VDI where views are deferred
  /// (vtkVDIGenerator::DeferViews). Default off: who updates the filter gets its VDI.
  vtkSetMacro(UpdatesForView, bool);

  void UpdateVTKObjects() override;
  int LoadXMLState(vtkPVXMLElement* element, vtkSMProxyLocator* locator) override;

  /// The array by which the active view colours the input, with its component. For who makes the proxy by
  /// hand: ParaView has given it a default by then, which can't be told from what a script has set.
  void TakeArrayFromView();

  /// Lets the next update be the first once more, for whoever takes that back.
  void Forget();

  /// The view, or a comparative view's root view; null if that is no render view.
  static vtkSMRenderViewProxy* RenderViewOf(vtkSMProxy* view);
  /// Sets the camera properties of `proxy`, one with a viewpoint (VolumetricDepthImage, RenderVDI), to the
  /// camera of `view`, for UpdateVTKObjects to send.
  static void SetCamera(vtkSMProxy* proxy, vtkSMRenderViewProxy* view);
  /// Why no viewpoint can be had from the view; empty where one can.
  static std::string WhyNot(vtkSMViewProxy* view);
  /// Likewise of a viewpoint for this filter's volume, which the view has to see.
  std::string WhyNotFrom(vtkSMViewProxy* view);
  /// Sets camera and Resolution to the view's, and traces it. The result is empty, or why the view can't be
  /// used; nothing is set then.
  std::string SetViewpoint(vtkSMViewProxy* view);
  /// By how many degrees the view sees the middle of the input from elsewhere than the camera that's set.
  double DegreesFrom(vtkSMRenderViewProxy* view);

  /// Of the VDI that the panel's numbers ask for, applied or not; none with PictureOnly. Asks the server.
  std::optional<vdi::VdiEstimate> EstimateToCome();

  /// Whether views show something earlier than what they have asked for. Asks the server.
  bool IsOutdated();
  /// Ends that the filter is held (vtkVDIGenerator::Hold), and that it shows something earlier, for whoever
  /// needs the VDI of the maps and properties as they are.
  void ReleaseNow();
  /// For proxies behind it that are updated without it: writers, extractors, RenderVDI. Lets all generators
  /// upstream of `proxy` take what isn't set, and releases them. Collective where each rank has a client.
  static void PrepareUpstream(vtkSMProxy* proxy, std::optional<double> time);

 protected:
  vtkSMVDIGeneratorProxy() = default;
  ~vtkSMVDIGeneratorProxy() override = default;

 private:
  vtkSMVDIGeneratorProxy(const vtkSMVDIGeneratorProxy&) = delete;
  void operator=(const vtkSMVDIGeneratorProxy&) = delete;

  void TakeWhatIsNotSet(std::optional<double> time);
  void TakeFromView();
  vtkSMViewProxy* ActiveView();
  /// The active view, if it's one to take from; null otherwise.
  vtkSMRenderViewProxy* ViewToTakeFrom();
  /// Null: there is no input.
  vtkPVDataInformation* InputInformation();
  vdi::Box InputBounds();
  /// How the view shows the input; null if it never has.
  vtkSMProxy* RepresentationIn(vtkSMViewProxy* view);
  /// Of the input's array; 0 if it isn't there.
  int ComponentsOf(const std::string& name, int association);
  /// `time`: that of the update which is to come, if it has one. `anew`: the map that is set was for
  /// something else.
  void ChooseLookupTable(std::optional<double> time, bool anew);
  void FollowArray();
  void TakeUnitDistance();
  /// Whether the map that is set is that of the array, and nobody's choice.
  bool HasMapOf(const std::string& name);
  bool NameComponent(vtkSMProxy* map, const std::string& name, int association);
  /// By which the active view colours the input by that array; null if it doesn't.
  vtkSMProxy* MapInView(const std::string& name, int association);
  /// Of the input's array, over all ranks; false if there's none.
  bool RangeOfScalars(const char* name, int association, std::optional<double> time, double range[2]);

  /// What a map is chosen for.
  struct Subject {
    vtkSMProxy* Input = nullptr;  // compared only
    unsigned int Port = 0;
    std::string Array;
    int Association = 0;
    int Component = -1;
    bool operator==(const Subject&) const = default;
  };
  Subject CurrentSubject();

  bool UpdatesForView = false;
  bool Taken = false;                       // what the view has
  bool Choosing = false;                    // in ChooseLookupTable or FollowArray
  std::string Chosen;                       // the array whose map this proxy has set
  vtkWeakPointer<vtkSMProxy> ChosenMap;     // that map
  std::optional<Subject> Shown;             // that the last map was for
  std::optional<double> TakenUnitDistance;  // from a view
};

#endif
