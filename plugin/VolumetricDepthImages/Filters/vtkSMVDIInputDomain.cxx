#include "vtkSMVDIInputDomain.h"

#include <vtkDataObject.h>
#include <vtkObjectFactory.h>
#include <vtkPVDataInformation.h>
#include <vtkSMInputProperty.h>
#include <vtkSMSourceProxy.h>

vtkStandardNewMacro(vtkSMVDIInputDomain);

int vtkSMVDIInputDomain::IsInDomain(vtkSMProperty* property) {
  auto* input = vtkSMInputProperty::SafeDownCast(property);
  if (input == nullptr) return vtkSMDomain::NOT_IN_DOMAIN;
  for (unsigned int i = 0; i < input->GetNumberOfUncheckedProxies(); ++i) {
    auto* source = vtkSMSourceProxy::SafeDownCast(input->GetUncheckedProxy(i));
    if (source == nullptr) return vtkSMDomain::NOT_IN_DOMAIN;
    vtkPVDataInformation* data = source->GetDataInformation(input->GetUncheckedOutputPortForConnection(i));
    if (data == nullptr || data->GetArrayInformation("VDI.offsets", vtkDataObject::FIELD) == nullptr)
      return vtkSMDomain::NOT_IN_DOMAIN;
  }
  return vtkSMDomain::IN_DOMAIN;
}
