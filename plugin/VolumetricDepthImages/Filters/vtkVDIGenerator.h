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

#include <vtkSmartPointer.h>

#include <exception>
#include <memory>
#include <string>

#include "vtkVDIProperties.h"
#include "vtkVolumetricDepthImagesModule.h"

namespace pv {
struct FrameInputs;
struct Origin;
struct Shown;
}  // namespace pv
class vtkMultiProcessController;

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkVDIGenerator : public vtkVDIProperties {
 public:
  static vtkVDIGenerator* New();
  vtkTypeMacro(vtkVDIGenerator, vtkVDIProperties);

  void SetController(vtkMultiProcessController* controller);

  /// Time and memory of the last frame, one line per rank; empty on ranks other than 0.
  const char* GetReport() const { return this->Report.c_str(); }
  /// The last VDI's properties and costs, as pv::numbersOf gives them; all 0 without one, and on ranks other
  /// than 0.
  double* GetLastVdi() VTK_SIZEHINT(18);

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
  /// Invoked when an update in the middle of another one, which a timer has requested, has given the last
  /// VDI. After the other update and Release, the next one gives the requested VDI.
  static constexpr unsigned long PutOffEvent = 1000 + 5646;  // vtkCommand::UserEvent and any number
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
  bool ServesView() const;
  bool Defer(vtkDataObject* input, const pv::Origin& origin, bool hasFailed, vtkImageData* output);
  bool Ask(vtkDataObject* input, const pv::Origin& origin);
  void GiveEarlier(vtkImageData* output);
  void Generate(vtkDataObject* input, const pv::Origin& origin, vtkImageData* output);
  bool IsRoot() const;
  void Enter();
  void ShowBlocks(vtkDataObject* input, const pv::Origin& origin);
  pv::FrameInputs AskedFrame();
  pv::FrameInputs ShownFrame(const pv::Shown& shown);
  pv::FrameInputs Announced(pv::FrameInputs frame);
  void SayCrowded(const pv::Origin& origin);
  pv::Origin OriginOf(vtkDataObject* input);
  bool TakePreparation(const pv::Origin& origin, vtkImageData* output);
  int GiveMade(const pv::Origin& origin, vtkImageData* output);
  int PutOff(vtkImageData* output);
  int EndWithout(const std::exception_ptr& failure, vtkImageData* output);
  void SayFailure(const std::string& what);
  void TakeReport();
  void KeepEarlier(vtkImageData* output);
  bool DropLostDevice();

  std::unique_ptr<Internals> Internal;
  vtkSmartPointer<vtkMultiProcessController> Controller;
  std::string Report;
};

#endif
