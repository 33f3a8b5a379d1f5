/**
 * @class vtkSMVDIStreamExtractWriterProxy
 * @brief the extractor VDIStream: writes no files, but hands each VDI to vtkVDIStreamWriter
 *
 * With the property Steer of its writer, what viewers ask for is done after each step (VDISteering.h).
 */
#ifndef vtkSMVDIStreamExtractWriterProxy_h
#define vtkSMVDIStreamExtractWriterProxy_h

#include <vtkSMDataExtractWriterProxy.h>

#include <memory>

#include "vtkVolumetricDepthImagesModule.h"

namespace pv {
class Steering;
}

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIStreamExtractWriterProxy : public vtkSMDataExtractWriterProxy {
 public:
  static vtkSMVDIStreamExtractWriterProxy* New();
  vtkTypeMacro(vtkSMVDIStreamExtractWriterProxy, vtkSMDataExtractWriterProxy);

  bool Write(vtkSMExtractsController* extractor) override;

 protected:
  vtkSMVDIStreamExtractWriterProxy();
  ~vtkSMVDIStreamExtractWriterProxy() override;

 private:
  vtkSMVDIStreamExtractWriterProxy(const vtkSMVDIStreamExtractWriterProxy&) = delete;
  void operator=(const vtkSMVDIStreamExtractWriterProxy&) = delete;

  std::unique_ptr<pv::Steering> Steering;
};

#endif
