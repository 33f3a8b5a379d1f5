/**
 * @class vtkSMVDIRendererProxy
 * @brief lets the generators upstream of a RenderVDI choose their colour maps before it is updated
 *
 * A filter updates the filters upstream of it without their proxies (vtkSMVDIGeneratorProxy).
 */
#ifndef vtkSMVDIRendererProxy_h
#define vtkSMVDIRendererProxy_h

#include <vtkSMSourceProxy.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIRendererProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIRendererProxy* New();
  vtkTypeMacro(vtkSMVDIRendererProxy, vtkSMSourceProxy);

  void UpdatePipeline() override;
  void UpdatePipeline(double time) override;

 protected:
  vtkSMVDIRendererProxy() = default;
  ~vtkSMVDIRendererProxy() override = default;

 private:
  vtkSMVDIRendererProxy(const vtkSMVDIRendererProxy&) = delete;
  void operator=(const vtkSMVDIRendererProxy&) = delete;
};

#endif
