#ifndef VDIUpdate_h
#define VDIUpdate_h

#include <array>

class vtkInformationRequestKey;
class vtkPVDataRepresentation;

namespace pv {

/// Brackets ParaView's own handling of a view's request. If the request updates the representation and the
/// input's update fails, this reports the end of the update (UpdateDataEvent), which ParaView leaves out.
/// Without the report, the representation's proxy would pass on no later change of the input, so the view
/// would never show it again.
class Update {
 public:
  Update(vtkPVDataRepresentation* representation, vtkInformationRequestKey* request);
  ~Update();
  Update(const Update&) = delete;
  Update& operator=(const Update&) = delete;

 private:
  void noteEnd();

  vtkPVDataRepresentation* updated_;  // null if the request updates nothing
  std::array<unsigned long, 2> observers_{};
  bool isReported_ = false;
};

}  // namespace pv

#endif
