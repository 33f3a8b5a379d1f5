#include "VDIFailure.h"

#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkExecutive.h>
#include <vtkNew.h>
#include <vtkOutputWindow.h>

#include <string_view>

#include "vdi/core/Error.h"

namespace pv {

namespace {

void sayOthers(vtkObject*, unsigned long, void*, void* said) {
  const auto* text = static_cast<const char*>(said);
  if (text == nullptr ||
      std::string_view(text).find("returned failure for request") != std::string_view::npos)
    return;
  vtkOutputWindowDisplayErrorText(text);
}

}  // namespace

std::string whatOf(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return error.what();
  }
}

bool isCancellation(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const vdi::Error& error) {
    return error.code() == vdi::ErrorCode::Cancelled;
  } catch (const std::exception&) {
    return false;
  }
}

bool Failure::isNew(vtkAlgorithm* filter, const std::string& text) {
  if (vtkExecutive* executive = filter->GetExecutive(); executive != quiet_) {
    quiet_ = executive;
    vtkNew<vtkCallbackCommand> command;
    command->SetCallback(sayOthers);
    executive->AddObserver(vtkCommand::ErrorEvent, command);
  }
  if (text_ == text) return false;
  text_ = text;
  return true;
}

}  // namespace pv
