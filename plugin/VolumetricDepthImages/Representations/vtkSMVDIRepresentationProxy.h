/**
 * @class vtkSMVDIRepresentationProxy
 * @brief shows a VDI as it is, without a colour map and a selection
 *
 * ParaView colours what it shows first by an array: the flat picture's bytes, with a colour bar for them. A
 * VDI has its colours.
 *
 * ParaView sends to the client what is selected of the data, with all field data even where that's nothing:
 * the VDI's arrays as they are, which takes longer than all else of a new VDI. A VDI has nothing to select.
 */
#ifndef vtkSMVDIRepresentationProxy_h
#define vtkSMVDIRepresentationProxy_h

#include <vtkSMPVRepresentationProxy.h>

#include "vtkVolumetricDepthImagesRepresentationsModule.h"

class VTKVOLUMETRICDEPTHIMAGESREPRESENTATIONS_EXPORT vtkSMVDIRepresentationProxy
    : public vtkSMPVRepresentationProxy {
 public:
  static vtkSMVDIRepresentationProxy* New();
  vtkTypeMacro(vtkSMVDIRepresentationProxy, vtkSMPVRepresentationProxy);

  bool SetRepresentationType(const char* type) override;

 protected:
  vtkSMVDIRepresentationProxy() = default;
  ~vtkSMVDIRepresentationProxy() override = default;

  void SetPropertyModifiedFlag(const char* name, int flag) override;

 private:
  vtkSMVDIRepresentationProxy(const vtkSMVDIRepresentationProxy&) = delete;
  void operator=(const vtkSMVDIRepresentationProxy&) = delete;
};

#endif
