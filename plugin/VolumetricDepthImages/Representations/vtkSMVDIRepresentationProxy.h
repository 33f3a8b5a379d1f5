/**
 * @class vtkSMVDIRepresentationProxy
 * @brief shows a VDI as it is, without a colour map
 *
 * ParaView colours what it shows first by an array: the flat picture's bytes, with a colour bar for them. A
 * VDI has its colours.
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

 private:
  vtkSMVDIRepresentationProxy(const vtkSMVDIRepresentationProxy&) = delete;
  void operator=(const vtkSMVDIRepresentationProxy&) = delete;
};

#endif
