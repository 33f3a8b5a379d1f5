/**
 * @class vtkSMVDIStreamSourceProxy
 * @brief the source VDIStream, which keeps the token of a link apart from its URL
 *
 * States, traces and settings have the property URL. So this proxy removes the token from a pasted link at
 * once, and sends it to the source by itself. The token isn't a property, because a trace would write it
 * down. The proxy keeps the tokens of earlier links, because undo and redo bring back their addresses alone.
 */
#ifndef vtkSMVDIStreamSourceProxy_h
#define vtkSMVDIStreamSourceProxy_h

#include <vtkSMSourceProxy.h>

#include <map>
#include <string>

#include "vtkVolumetricDepthImagesModule.h"

class VTKVOLUMETRICDEPTHIMAGES_EXPORT vtkSMVDIStreamSourceProxy : public vtkSMSourceProxy {
 public:
  static vtkSMVDIStreamSourceProxy* New();
  vtkTypeMacro(vtkSMVDIStreamSourceProxy, vtkSMSourceProxy);

  void UpdateVTKObjects() override;

 protected:
  vtkSMVDIStreamSourceProxy() = default;
  ~vtkSMVDIStreamSourceProxy() override = default;

  void SetPropertyModifiedFlag(const char* name, int flag) override;

 private:
  vtkSMVDIStreamSourceProxy(const vtkSMVDIStreamSourceProxy&) = delete;
  void operator=(const vtkSMVDIStreamSourceProxy&) = delete;

  void TakeToken();

  std::string Address;                        // the last URL, without its token
  std::map<std::string, std::string> Tokens;  // by address
  bool IsTokenSent = true;                    // whether the source has the token of Address
};

#endif
