/**
 * @class vtkSMVDIInputDomain
 * @brief accepts what carries a Volumetric Depth Image (VDIImageData.h)
 *
 * XML element VDIInputDomain, of input properties. Nothing is known of a source before its first update; it
 * isn't accepted then, so that menus offer what can be used.
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
