/**
 * @class vtkSMVDIStreamExtractWriterProxy
 * @brief the extractor VDIStream: writes no files, but hands each VDI to vtkVDIStreamWriter
 */
#ifndef vtkSMVDIStreamExtractWriterProxy_h
#define vtkSMVDIStreamExtractWriterProxy_h

#include <vtkSMDataExtractWriterProxy.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIStreamExtractWriterProxy : public vtkSMDataExtractWriterProxy {
 public:
  static vtkSMVDIStreamExtractWriterProxy* New();
  vtkTypeMacro(vtkSMVDIStreamExtractWriterProxy, vtkSMDataExtractWriterProxy);

  bool Write(vtkSMExtractsController* extractor) override;

 protected:
  vtkSMVDIStreamExtractWriterProxy() = default;
  ~vtkSMVDIStreamExtractWriterProxy() override = default;

 private:
  vtkSMVDIStreamExtractWriterProxy(const vtkSMVDIStreamExtractWriterProxy&) = delete;
  void operator=(const vtkSMVDIStreamExtractWriterProxy&) = delete;
};

#endif
