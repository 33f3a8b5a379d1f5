/**
 * @class vtkSMVDIGeneratorInitializationHelper
 * @brief lets a new VolumetricDepthImage begin with the array that the active view shows
 */
#ifndef vtkSMVDIGeneratorInitializationHelper_h
#define vtkSMVDIGeneratorInitializationHelper_h

#include <vtkSMProxyInitializationHelper.h>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIGeneratorInitializationHelper
    : public vtkSMProxyInitializationHelper {
 public:
  static vtkSMVDIGeneratorInitializationHelper* New();
  vtkTypeMacro(vtkSMVDIGeneratorInitializationHelper, vtkSMProxyInitializationHelper);

  void PostInitializeProxy(vtkSMProxy* proxy, vtkPVXMLElement* element, vtkMTimeType time) override;

 protected:
  vtkSMVDIGeneratorInitializationHelper() = default;
  ~vtkSMVDIGeneratorInitializationHelper() override = default;

 private:
  vtkSMVDIGeneratorInitializationHelper(const vtkSMVDIGeneratorInitializationHelper&) = delete;
  void operator=(const vtkSMVDIGeneratorInitializationHelper&) = delete;
};

#endif
