// How a filter that fails says so: once. Views and pipelines ask again and again for what they don't get, and
// each time VTK's executive adds that the algorithm has returned failure.
#ifndef VDIFailure_h
#define VDIFailure_h

#include <vtkWeakPointer.h>

#include <string>

class vtkAlgorithm;
class vtkExecutive;

namespace pv {

class Failure {
 public:
  /// Whether `text` hasn't been said yet of `filter` since it was right last. From then on its executive
  /// keeps quiet of failures; all else it says as before.
  bool isNew(vtkAlgorithm* filter, const std::string& text);
  void isOver() { text_.clear(); }

 private:
  std::string text_;
  vtkWeakPointer<vtkExecutive> quiet_;
};

}  // namespace pv

#endif
