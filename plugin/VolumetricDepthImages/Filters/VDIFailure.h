// A filter's failure, and its report, once. Views and pipelines repeat their requests to a filter that fails,
// and VTK's executive adds each time that the algorithm has returned failure.
#ifndef VDIFailure_h
#define VDIFailure_h

#include <vtkWeakPointer.h>

#include <exception>
#include <string>

class vtkAlgorithm;
class vtkExecutive;

namespace pv {

std::string whatOf(const std::exception_ptr& failure);
/// Whether the failure is a vdi::Error{Cancelled}.
bool isCancellation(const std::exception_ptr& failure);

class Failure {
 public:
  /// Whether `text` is new: the filter hasn't reported it since it last succeeded. From the first call on,
  /// the filter's executive no longer reports that a request failed. It reports all other errors as before.
  bool isNew(vtkAlgorithm* filter, const std::string& text);
  void isOver() { text_.clear(); }

 private:
  std::string text_;
  vtkWeakPointer<vtkExecutive> quiet_;
};

}  // namespace pv

#endif
