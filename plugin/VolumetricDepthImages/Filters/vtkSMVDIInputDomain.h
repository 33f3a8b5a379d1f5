/**
 * @class vtkSMVDIInputDomain
 * @brief accepts inputs that carry a Volumetric Depth Image (VDIImageData.h)
 *
 * This is the XML element VDIInputDomain, for input properties. It rejects a source before its first update,
 * when nothing is known of its output, so that menus offer only usable filters.
 */
#ifndef vtkSMVDIInputDomain_h
#define vtkSMVDIInputDomain_h

#include <vtkSMDomain.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIInputDomain : public vtkSMDomain {
 public:
  static vtkSMVDIInputDomain* New();
  vtkTypeMacro(vtkSMVDIInputDomain, vtkSMDomain);

  int IsInDomain(vtkSMProperty* property) override;

 protected:
  vtkSMVDIInputDomain() = default;
  ~vtkSMVDIInputDomain() override = default;

 private:
  vtkSMVDIInputDomain(const vtkSMVDIInputDomain&) = delete;
  void operator=(const vtkSMVDIInputDomain&) = delete;
};

#endif
