#include "vtkSMVDIGeneratorInitializationHelper.h"

#include <vtkObjectFactory.h>
#include <vtkSMProperty.h>

#include "vtkSMVDIGeneratorProxy.h"

vtkStandardNewMacro(vtkSMVDIGeneratorInitializationHelper);

void vtkSMVDIGeneratorInitializationHelper::PostInitializeProxy(vtkSMProxy* proxy, vtkPVXMLElement*,
                                                                vtkMTimeType time) {
  // What was set while the proxy was made, by a script, stays.
  if (proxy->GetProperty("SelectInputScalars")->GetMTime() > time) return;
  if (auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(proxy)) generator->TakeArrayFromView();
}
