// How a collective operation asks before it starts, where somebody watches over the ranks' scripts.
//
// A script that ends on one rank while the others go on leaves them in a collective that it never enters. Who
// can tell (catalyst_adaptor) observes `event` on the global vtkMultiProcessController; where nobody does,
// entries are granted. Free of VTK and MPI: shared with catalyst_adaptor, which doesn't link the plugin.
#ifndef VDICollective_h
#define VDICollective_h

#include <string>

namespace pv {

/// Call data of the event, invoked on each rank before the operation.
struct CollectiveEntry {
  static constexpr unsigned long event = 1000 + 5642;  // vtkCommand::UserEvent and any number

  std::string operation;  // the same on all ranks, or none may enter
  std::string refusal;    // why not to enter, from the observer; "": enter
};

}  // namespace pv

#endif
