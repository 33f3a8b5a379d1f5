/**
 * @class vtkSMVDIStreamSourceProxy
 * @brief the source VDIStream: keeps the token of a link apart from its URL
 *
 * States, traces and settings have the property URL, so the token that a pasted link brings goes to the
 * property Token at once, which they leave out. Another URL without a token forgets the earlier one's.
 */
#ifndef vtkSMVDIStreamSourceProxy_h
#define vtkSMVDIStreamSourceProxy_h

#include <vtkSMSourceProxy.h>

#include <string>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIStreamSourceProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIStreamSourceProxy* New();
  vtkTypeMacro(vtkSMVDIStreamSourceProxy, vtkSMSourceProxy);

 protected:
  vtkSMVDIStreamSourceProxy() = default;
  ~vtkSMVDIStreamSourceProxy() override = default;

  void SetPropertyModifiedFlag(const char* name, int flag) override;

 private:
  vtkSMVDIStreamSourceProxy(const vtkSMVDIStreamSourceProxy&) = delete;
  void operator=(const vtkSMVDIStreamSourceProxy&) = delete;

  void TakeToken();

  std::string Address;  // URL as it was last
};

#endif
