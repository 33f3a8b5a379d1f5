#include "VDIUpdate.h"

#include <vtkCommand.h>
#include <vtkPVDataRepresentation.h>
#include <vtkPVView.h>

namespace pv {

Update::Update(vtkPVDataRepresentation* representation, vtkInformationRequestKey* request)
    : updated_(request == vtkPVView::REQUEST_UPDATE() && representation->GetNeedsUpdate() ? representation
                                                                                          : nullptr) {
  if (updated_ == nullptr) return;
  observers_ = {
      updated_->AddObserver(vtkCommand::UpdateDataEvent, this, &Update::noteEnd),
      updated_->AddObserver(vtkPVDataRepresentation::SkippedUpdateDataEvent, this, &Update::noteEnd)};
}

Update::~Update() {
  if (updated_ == nullptr) return;
  for (const unsigned long observer : observers_) updated_->RemoveObserver(observer);
  if (!isReported_) updated_->InvokeEvent(vtkCommand::UpdateDataEvent);
}

void Update::noteEnd() {
  isReported_ = true;
}

}  // namespace pv
