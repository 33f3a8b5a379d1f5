#include "vtkSMVDIStreamSourceProxy.h"

#include <vtkClientServerStream.h>
#include <vtkObjectFactory.h>
#include <vtkSMPropertyHelper.h>

#include <string_view>
#include <utility>

#include "vdi/core/Error.h"
#include "vdi/stream/Url.h"

vtkStandardNewMacro(vtkSMVDIStreamSourceProxy);

void vtkSMVDIStreamSourceProxy::SetPropertyModifiedFlag(const char* name, int flag) {
  this->Superclass::SetPropertyModifiedFlag(name, flag);
  if (flag != 0 && name != nullptr && std::string_view(name) == "URL") this->TakeToken();
}

void vtkSMVDIStreamSourceProxy::TakeToken() {
  const vtkSMPropertyHelper property(this, "URL");
  if (property.GetNumberOfElements() == 0) return;  // the proxy is being made
  const char* text = property.GetAsString();
  const std::string url = text != nullptr ? text : "";
  if (url == this->Address) return;
  const std::size_t hash = url.find('#');
  this->Address = url.substr(0, hash);
  std::string token;
  try {
    if (hash != std::string::npos) token = vdi::stream::parseUrl(url).token;
  } catch (const vdi::Error&) {  // the source reports what is wrong with the URL
  }
  if (hash != std::string::npos) this->Tokens[this->Address] = token;
  this->IsTokenSent = false;
  if (hash != std::string::npos) vtkSMPropertyHelper(this, "URL").Set(this->Address.c_str());
}

void vtkSMVDIStreamSourceProxy::UpdateVTKObjects() {
  this->CreateVTKObjects();
  if (this->ObjectsCreated && !std::exchange(this->IsTokenSent, true)) {
    vtkClientServerStream stream;
    stream << vtkClientServerStream::Invoke << VTKOBJECT(this) << "SetToken"
           << this->Tokens[this->Address].c_str() << vtkClientServerStream::End;
    this->ExecuteStream(stream);
  }
  this->Superclass::UpdateVTKObjects();
}
