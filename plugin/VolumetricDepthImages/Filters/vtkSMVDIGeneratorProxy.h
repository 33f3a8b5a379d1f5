/**
 * @class vtkSMVDIGeneratorProxy
 * @brief gives VolumetricDepthImage the colour map of its array
 *
 * When nobody has set LookupTable, the proxy takes ParaView's colour map for the chosen array, the one that a
 * representation would use, with its opacity function. A user who sets another one, or none after that, is
 * left alone.
 */
#ifndef vtkSMVDIGeneratorProxy_h
#define vtkSMVDIGeneratorProxy_h

#include <vtkSMSourceProxy.h>

#include <string>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIGeneratorProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIGeneratorProxy* New();
  vtkTypeMacro(vtkSMVDIGeneratorProxy, vtkSMSourceProxy);

  void UpdatePipeline() override;
  void UpdatePipeline(double time) override;

 protected:
  vtkSMVDIGeneratorProxy() = default;
  ~vtkSMVDIGeneratorProxy() override = default;

 private:
  vtkSMVDIGeneratorProxy(const vtkSMVDIGeneratorProxy&) = delete;
  void operator=(const vtkSMVDIGeneratorProxy&) = delete;

  void ChooseLookupTable();

  std::string Chosen;  // the array whose map this proxy has set
};

#endif
