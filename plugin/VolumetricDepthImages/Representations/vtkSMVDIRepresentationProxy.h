/**
 * @class vtkSMVDIRepresentationProxy
 * @brief shows a VDI, with the legend of its colours and without a selection
 *
 * While the representation is VDI, ParaView takes the VDI as coloured by the array that it was made from,
 * with the filter's maps. Toolbar, colour editor and scalar bars then act on these maps. They don't colour
 * anything here, because a VDI has its colours already. The data have values with the array's name
 * (VDIValues.h), which give ranges and histograms. An opened file brings maps of its own; editing them
 * changes the legend alone.
 *
 * The toolbar also offers the other arrays of the filter's input. If a user chooses one, or a script colours
 * the VDI by it, the filter gets it as SelectInputScalars. The legend stays that of the shown VDI until the
 * next one is there.
 *
 * ParaView sends the selected part of the data to the client, with all field data even if the selection is
 * empty. These are the VDI's arrays as they are, and sending them takes longer than the rest of a new VDI. So
 * this proxy offers no selection: a VDI has nothing to select.
 */
#ifndef vtkSMVDIRepresentationProxy_h
#define vtkSMVDIRepresentationProxy_h

#include <vtkNew.h>
#include <vtkSMPVRepresentationProxy.h>
#include <vtkWeakPointer.h>

#include <string>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class vtkPVDataInformation;
class vtkSMVDIGeneratorProxy;

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkSMVDIRepresentationProxy
    : public vtkSMPVRepresentationProxy {
 public:
  static vtkSMVDIRepresentationProxy* New();
  vtkTypeMacro(vtkSMVDIRepresentationProxy, vtkSMPVRepresentationProxy);

  bool SetRepresentationType(const char* type) override;
  void ViewUpdated(vtkSMProxy* view) override;
  void UpdateVTKObjects() override;
  int LoadXMLState(vtkPVXMLElement* element, vtkSMProxyLocator* locator) override;
  void LoadState(const vtkSMMessage* state, vtkSMProxyLocator* locator) override;

  /// Gives the representation of a filter whose legends wait (vtkSMVDIGeneratorProxy) the legend of the VDI
  /// that the view shows, unless the next one is being made. Returns whether that has changed the legend.
  bool FollowShown(vtkSMProxy* view);

  /// While a filter's VDI is shown, this names the arrays of the filter's input, and says nothing else.
  /// ParaView offers these arrays in addition to those of the VDI itself.
  vtkPVDataInformation* GetRepresentedDataInformation() override;

  using vtkSMPVRepresentationProxy::RescaleTransferFunctionToDataRangeOverTime;
  /// Takes the range over time from the filter's input, so that time steps needn't become VDIs for it. From
  /// ParaView 5.12 on, toolbar and editor don't call it: their helper makes the VDI of each step.
  bool RescaleTransferFunctionToDataRangeOverTime(const char* arrayname, int attribute_type) override;

 protected:
  vtkSMVDIRepresentationProxy();
  ~vtkSMVDIRepresentationProxy() override;

  void SetPropertyModifiedFlag(const char* name, int flag) override;

 private:
  vtkSMVDIRepresentationProxy(const vtkSMVDIRepresentationProxy&) = delete;
  void operator=(const vtkSMVDIRepresentationProxy&) = delete;

  /// The array and the maps by which ParaView takes the VDI as coloured.
  struct Legend {
    std::string Array;
    vtkSMProxy* Colors = nullptr;
    vtkSMProxy* Opacities = nullptr;
  };
  vtkSMVDIGeneratorProxy* ShownGenerator();
  Legend LegendOfInput();
  Legend LegendOfFile(vtkSMProxy* reader);
  bool TakeLegend(vtkSMProxy* view);
  void DropLegend();
  void SetMaps(vtkSMProxy* colors, vtkSMProxy* opacities);
  void TakeChoice();
  void NameComponent(vtkSMProxy* colors);
  bool HasLegend();

  std::string Named;  // the array by which it was coloured last; "" if a state or nothing tells
  vtkWeakPointer<vtkSMProxy> Colors;  // its maps
  vtkWeakPointer<vtkSMProxy> Opacities;
  vtkNew<vtkPVDataInformation> ArraysOfInput;
  bool TypeIsLinked = false;  // whether the type is linked with the copies in a comparative view
  std::string FileColoring;   // the text from which the maps of an opened file were last made
};

#endif
