/**
 * @class vtkSMVDIWriterProxy
 * @brief lets the generators upstream of a .vdi file's writer choose their colour maps before it writes
 *
 * A writer updates the filters upstream of it without their proxies (vtkSMVDIGeneratorProxy).
 */
#ifndef vtkSMVDIWriterProxy_h
#define vtkSMVDIWriterProxy_h

#include <vtkSMPWriterProxy.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIWriterProxy : public vtkSMPWriterProxy {
 public:
  static vtkSMVDIWriterProxy* New();
  vtkTypeMacro(vtkSMVDIWriterProxy, vtkSMPWriterProxy);

  void UpdatePipeline() override;
  void UpdatePipeline(double time) override;

 protected:
  vtkSMVDIWriterProxy() = default;
  ~vtkSMVDIWriterProxy() override = default;

 private:
  vtkSMVDIWriterProxy(const vtkSMVDIWriterProxy&) = delete;
  void operator=(const vtkSMVDIWriterProxy&) = delete;
};

#endif
