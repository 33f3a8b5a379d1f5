/**
 * @class vtkSMVDIExtractWriterProxy
 * @brief the extractor of .vdi files: it passes on the number of the step
 */
#ifndef vtkSMVDIExtractWriterProxy_h
#define vtkSMVDIExtractWriterProxy_h

#include <vtkSMDataExtractWriterProxy.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIExtractWriterProxy : public vtkSMDataExtractWriterProxy {
 public:
  static vtkSMVDIExtractWriterProxy* New();
  vtkTypeMacro(vtkSMVDIExtractWriterProxy, vtkSMDataExtractWriterProxy);

  bool Write(vtkSMExtractsController* extractor) override;

 protected:
  vtkSMVDIExtractWriterProxy() = default;
  ~vtkSMVDIExtractWriterProxy() override = default;

 private:
  vtkSMVDIExtractWriterProxy(const vtkSMVDIExtractWriterProxy&) = delete;
  void operator=(const vtkSMVDIExtractWriterProxy&) = delete;
};

#endif
