// The event by which a collective operation asks for permission to start. An observer that watches over the
// ranks' scripts grants it.
//
// A script that ends on one rank while the others continue leaves them in a collective operation that it
// never enters. catalyst_adaptor detects such scripts, and observes `event` on the global
// vtkMultiProcessController. Without an observer, every entry is granted. This header is free of VTK and MPI,
// because catalyst_adaptor shares it and doesn't link the plugin.
#ifndef VDICollective_h
#define VDICollective_h

#include <string>

namespace pv {

/// Call data of the event, invoked on each rank before the operation.
struct CollectiveEntry {
  static constexpr unsigned long event = 1000 + 5642;  // vtkCommand::UserEvent and any number

  std::string operation;  // its name, the same on all ranks; if names differ, no rank may enter
  std::string refusal;    // the observer's reason against entering; "": enter
};

}  // namespace pv

#endif
