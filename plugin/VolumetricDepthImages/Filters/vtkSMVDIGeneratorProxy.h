/**
 * @class vtkSMVDIGeneratorProxy
 * @brief gives VolumetricDepthImage the active view's viewpoint, size, colour map and opacity
 *
 * At the first update, the proxy takes unset properties from the active view, if that is a render view that
 * shows the input, or whose camera a user has placed: the camera if position and focal point are the same,
 * Resolution if it is 0 0, ScalarOpacityUnitDistance if it is 0, Shade, Diffuse and Ambient if the view shows
 * a shaded volume, Cropping and CroppingBox if it shows a cropped one, BlendMode and IsosurfaceValues if it
 * shows a volume, and Lights. It takes a group only if all its properties have their defaults.
 * If both camera and Resolution are set, other than by SetViewpoint, it takes nothing. Traces and state files
 * have the values. Proxies made by a state file, or by the undo of a deletion, take nothing.
 *
 * If LookupTable has never been set, the proxy takes ParaView's colour map for the chosen array: the one that
 * a representation of the input uses in the active view, or would use, with its opacity function. The proxy
 * doesn't replace a map that a user sets later, nor fill a property that a user empties. If a map or opacity
 * function is still as ParaView made it, or holds a preset on [0, 1], the proxy rescales it once to the
 * array's range at that time. Control points that a user has set stay.
 *
 * After the first update, another array, component or input takes its own map as soon as it is sent
 * (UpdateVTKObjects). So the next update finds it, whether it is a view's or a writer's. The proxy replaces
 * only the map of the previous array. Another input brings its unit distance, unless a user has set one.
 * Conversely, Component follows the map: if ParaView's toolbar or a script makes the map name another
 * component, the filter shows that one.
 *
 * If each rank has a client (pvbatch --symmetric, Catalyst), the next view that is drawn, or the next update
 * of the proxy or of a writer downstream, does all this: the ranks meet there, and each script may set other
 * properties.
 */
#ifndef vtkSMVDIGeneratorProxy_h
#define vtkSMVDIGeneratorProxy_h

#include <vtkSMSourceProxy.h>
#include <vtkWeakPointer.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vtkVolumetricDepthImagesModule.h"

namespace vdi {
struct Box;
struct VdiEstimate;
}  // namespace vdi
class vtkMultiProcessController;
class vtkPVArrayInformation;
class vtkPVDataInformation;
class vtkSMRenderViewProxy;
class vtkSMViewProxy;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIGeneratorProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIGeneratorProxy* New();
  vtkTypeMacro(vtkSMVDIGeneratorProxy, vtkSMSourceProxy);

  void UpdatePipeline() override;
  void UpdatePipeline(double time) override;

  /// Whether UpdatePipeline is for a view, which needn't wait for a VDI if views are deferred
  /// (vtkVDIGenerator::DeferViews). Off by default: then each update waits for its VDI.
  vtkSetMacro(UpdatesForView, bool);

  /// Whether a view's legend of the VDI is replaced once the view shows the new VDI
  /// (vtkSMVDIRepresentationProxy::FollowShown). Off by default: then the view's update replaces it.
  vtkSetMacro(LegendsWait, bool);
  bool GetLegendsWait() const { return this->LegendsWait; }

  void UpdateVTKObjects() override;
  int LoadXMLState(vtkPVXMLElement* element, vtkSMProxyLocator* locator) override;
  /// Loads a state of the undo stack.
  void LoadState(const vtkSMMessage* state, vtkSMProxyLocator* locator) override;

  /// Takes the array by which the active view colours the input, with its component. Call it when a user
  /// makes the proxy in the window: ParaView has given the property a default by then, and the proxy can't
  /// tell it from a script's choice.
  void TakeArrayFromView();

  /// The arrays of the input that SelectInputScalars may name, with their numbers of components. An array of
  /// points and one of cells with the same name count once.
  std::map<std::string, int> ArraysOfInput();

  /// Sets SelectInputScalars to the array of that name and association: that of points or cells, or
  /// vtkDataObject::FIELD for either, preferably the present one. Returns false if the input has none.
  bool ChooseArray(const std::string& name, int association);

  /// Sets CroppingBox to the input's bounds, for the panel to show, if Cropping is ticked, applied or not,
  /// and no box has been set. UpdateVTKObjects sends them.
  void BeginCropping();

  /// Makes the next update count as the first again. Call it when a user undoes the first Apply.
  void Forget();

  /// The input, as it is now or over all its time steps; null if there is none.
  vtkPVDataInformation* InputInformation(bool overTime = false);
  /// The array that is set, in that information of the input; null if it is missing.
  vtkPVArrayInformation* InputArray(bool overTime = false);
  /// The opacity function that is set, or else that of the map; null if there is none.
  vtkSMProxy* OpacityFunction();

  /// The view, or a comparative view's root view; null if that isn't a render view.
  static vtkSMRenderViewProxy* RenderViewOf(vtkSMProxy* view);
  /// Sets the camera properties of `proxy`, which has a viewpoint (VolumetricDepthImage, RenderVDI), to the
  /// camera of `view`. UpdateVTKObjects sends them.
  static void SetCamera(vtkSMProxy* proxy, vtkSMRenderViewProxy* view);
  /// The reason why the view gives no viewpoint; empty if it gives one.
  static std::string WhyNot(vtkSMViewProxy* view);
  /// The reason why the view gives no viewpoint of this filter's volume, which it must show; empty if it
  /// gives one.
  std::string WhyNotFrom(vtkSMViewProxy* view);
  /// Sets camera and Resolution to the view's, and records them in the trace. Returns "". If the view can't
  /// be used, sets nothing and returns the reason.
  std::string SetViewpoint(vtkSMViewProxy* view);
  /// The angle in degrees, at the middle of the input's shown part, between the view's camera and the camera
  /// that is set.
  double DegreesFrom(vtkSMRenderViewProxy* view);

  /// The estimate for the VDI that the panel's numbers describe, applied or not; nullopt with PictureOnly.
  /// Asks the server.
  std::optional<vdi::VdiEstimate> EstimateToCome();

  /// Whether views show an earlier output than the one they asked for. Asks the server.
  bool IsOutdated();
  /// Releases a held filter (vtkVDIGenerator::Hold), and stops it from giving views an earlier output. Call
  /// it before an update that needs the VDI of the current maps and properties.
  void ReleaseNow();
  /// Returns whether all ranks update that proxy now; true where updates aren't collective. Reports an error
  /// if another rank doesn't.
  static bool EnterUpdate(vtkSMProxy* proxy);
  /// For writers, extractors and RenderVDI, which update the filters upstream of them without the filters'
  /// proxies. Lets all generators upstream of `proxy` take what isn't set, and releases them. Collective if
  /// each rank has a client.
  static void PrepareUpstream(vtkSMProxy* proxy, std::optional<double> time);

 protected:
  vtkSMVDIGeneratorProxy();
  ~vtkSMVDIGeneratorProxy() override;

 private:
  vtkSMVDIGeneratorProxy(const vtkSMVDIGeneratorProxy&) = delete;
  void operator=(const vtkSMVDIGeneratorProxy&) = delete;

  /// Sets a flag for the lifetime of this object.
  class Raised {
   public:
    explicit Raised(bool& flag) : Flag(flag) { this->Flag = true; }
    ~Raised() { this->Flag = false; }
    Raised(const Raised&) = delete;
    Raised& operator=(const Raised&) = delete;

   private:
    bool& Flag;
  };
  /// The data that a map is chosen for.
  struct Subject {
    vtkSMProxy* Input = nullptr;  // compared, never followed
    unsigned int Port = 0;
    std::string Array;
    int Association = 0;
    int Component = -1;
    bool operator==(const Subject&) const = default;
  };

  /// The ranks if each has a client of its own (pvbatch --symmetric, Catalyst), which knows its own data
  /// only; null otherwise.
  static vtkMultiProcessController* RanksWithClients();
  /// Collective if each rank has a client.
  void TakeWhatIsNotSet(std::optional<double> time);
  /// Collective, called where each rank has a client. Returns whether all have the same array and component.
  /// Then `OfRanks` is set if any client needs it. Otherwise the filter executes on all ranks, and reports
  /// the difference.
  bool MeetRanks(vtkMultiProcessController* ranks, std::optional<double> time);
  /// Collective: updates the input, and sets `OfRanks`. Returns false if another rank doesn't take part.
  bool GatherInput(vtkMultiProcessController* ranks, const Subject& subject, std::optional<double> time);
  /// Calls TakeWhatIsNotSet when a view is drawn: views don't update the proxy. Called where each rank has a
  /// client.
  void WatchViews();
  void BeforeRender();
  void TakeFromView();
  vtkSMViewProxy* ActiveView();
  /// The active view if the proxy may take properties from it; null otherwise.
  vtkSMRenderViewProxy* ViewToTakeFrom();
  /// The bounds of a VDI of the input: those of its part in the cropping box, if there is one. A VDI that
  /// shows nothing has the input's.
  vdi::Box ShownBounds();
  /// The view's representation of the input; null if there is none.
  vtkSMProxy* RepresentationIn(vtkSMViewProxy* view);
  /// The number of components of the input's array; 0 if the array is missing.
  int ComponentsOf(const std::string& name, int association);
  /// `time` is that of the next update, if it has one. With `before`, the map that is set belongs to that
  /// other array, component or input.
  void ChooseLookupTable(std::optional<double> time, const Subject* before);
  void FollowArray();
  /// Observes the map that is set.
  void WatchMap();
  void MapUpdated();
  /// Sets Component to the one that the map names. Returns false if that changes nothing, or the array lacks
  /// it. Where each rank has a client, call it after GatherInput.
  bool TakeNamedComponent();
  /// Fits the map to the component that has been taken, and asks for its VDI. Where each rank has a client,
  /// call it after another GatherInput.
  void FitToComponent();
  /// Fits the legends of the map, and the range of the output that ParaView knows, to the component that is
  /// set, ahead of the next update.
  void AnnounceComponent(vtkSMProxy* map, const double range[2]);
  void TakeUnitDistance();
  /// Whether the map that is set belongs to the array, and isn't a user's choice.
  bool HasMapOf(const std::string& name);
  bool NameComponent(vtkSMProxy* map, const std::string& name, int association, const Subject* before);
  /// The map by which the active view colours the input by that array; null if it doesn't.
  vtkSMProxy* MapInView(const std::string& name, int association);
  /// Whether no map has been set or chosen.
  bool LacksLookupTable();
  /// The range of the input's array. Returns false if there is none.
  bool RangeOfScalars(const char* name, int association, std::optional<double> time, double range[2]);

  Subject CurrentSubject();

  bool UpdatesForView = false;
  bool LegendsWait = false;
  bool Taken = false;                       // whether the proxy has taken the view's properties
  bool HasViewpointOfView = false;          // set by SetViewpoint
  bool Choosing = false;                    // true within ChooseLookupTable and FollowArray
  std::string Chosen;                       // the array whose map this proxy has set
  vtkWeakPointer<vtkSMProxy> ChosenMap;     // the map that ChooseLookupTable has set
  std::optional<Subject> Shown;             // the subject of the last map
  std::optional<double> TakenUnitDistance;  // taken from a view
  struct InputOfRanks;
  std::unique_ptr<InputOfRanks> OfRanks;  // if each rank has a client, and the last update needed it
  std::vector<vtkWeakPointer<vtkSMProxy>> Watched;  // the views that BeforeRender observes
  vtkWeakPointer<vtkSMProxy> WatchedMap;            // the map that MapUpdated observes
  unsigned long MapObserver = 0;                    // its observer there
  int NamedComponent = -1;                          // the component that it named last
  bool FollowsMap = false;  // whether the ranks' next meeting calls TakeNamedComponent
};

#endif
