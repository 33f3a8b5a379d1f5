/**
 * @class vtkSMVDIRepresentationProxy
 * @brief shows a VDI, with the legend of its colours and without a selection
 *
 * While the representation is VDI, ParaView takes it for coloured by the array that the VDI was made of, with
 * the filter's maps: toolbar, colour editor and scalar bars then act on these. Nothing is coloured by them
 * here, for a VDI has its colours. The data have values of that name (VDIValues.h), which ranges and
 * histograms are of. An opened file brings maps of its own, whose editing changes the legend alone.
 *
 * ParaView sends to the client what is selected of the data, with all field data even where that's nothing:
 * the VDI's arrays as they are, which takes longer than all else of a new VDI. A VDI has nothing to select.
 */
#ifndef vtkSMVDIRepresentationProxy_h
#define vtkSMVDIRepresentationProxy_h

#include <vtkSMPVRepresentationProxy.h>

#include <string>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkSMVDIRepresentationProxy
    : public vtkSMPVRepresentationProxy {
 public:
  static vtkSMVDIRepresentationProxy* New();
  vtkTypeMacro(vtkSMVDIRepresentationProxy, vtkSMPVRepresentationProxy);

  bool SetRepresentationType(const char* type) override;
  void ViewUpdated(vtkSMProxy* view) override;

  using vtkSMPVRepresentationProxy::RescaleTransferFunctionToDataRangeOverTime;
  /// Of the filter's input, whose time steps needn't become VDIs for that.
  bool RescaleTransferFunctionToDataRangeOverTime(const char* arrayname, int attribute_type) override;

 protected:
  vtkSMVDIRepresentationProxy() = default;
  ~vtkSMVDIRepresentationProxy() override = default;

  void SetPropertyModifiedFlag(const char* name, int flag) override;

 private:
  vtkSMVDIRepresentationProxy(const vtkSMVDIRepresentationProxy&) = delete;
  void operator=(const vtkSMVDIRepresentationProxy&) = delete;

  /// What ParaView takes the VDI for coloured by.
  struct Legend {
    std::string Array;
    vtkSMProxy* Colors = nullptr;
    vtkSMProxy* Opacities = nullptr;
  };
  Legend LegendOfInput();
  Legend LegendOfFile(vtkSMProxy* reader);
  void TakeLegend(vtkSMProxy* view);
  void DropLegend();
  bool HasLegend();

  bool TypeIsLinked = false;  // with the copies of a comparative view
  std::string FileColoring;   // that the maps of an opened file were last made of
};

#endif
