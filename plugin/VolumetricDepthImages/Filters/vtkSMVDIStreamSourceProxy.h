/**
 * @class vtkSMVDIStreamSourceProxy
 * @brief the source VDIStream: keeps the token of a link apart from its URL
 *
 * States, traces and settings have the property URL, so this takes the token that a pasted link brings out
 * of it at once, and sends it to the source by itself. No property has it, for a trace would write it down.
 * The tokens of earlier links are kept: undo and redo bring back their addresses alone.
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

  std::string Address;                        // URL as it was last
  std::map<std::string, std::string> Tokens;  // of addresses
  bool IsTokenSent = true;                    // that of Address
};

#endif
