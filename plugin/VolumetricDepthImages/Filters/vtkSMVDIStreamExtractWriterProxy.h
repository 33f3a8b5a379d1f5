/**
 * @class vtkSMVDIStreamExtractWriterProxy
 * @brief the extractor VDIStream, which hands each VDI to vtkVDIStreamWriter and writes no files
 *
 * If its writer's property Steer is on, it carries out the viewers' wishes after each step (VDISteering.h).
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
