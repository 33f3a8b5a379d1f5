// The exchange of a simulation's parameters with the code that steers it.
//
// A simulation declares its parameters to catalyst_adaptor, which observes `event` on the global
// vtkMultiProcessController. This header is free of VTK and MPI, as VDICollective.h is.
#ifndef VDIParameters_h
#define VDIParameters_h

#include <map>
#include <string>
#include <vector>

namespace pv {

/// Call data of the event. Invoking it isn't collective, but all ranks invoke it with the same changes.
struct ParameterExchange {
  static constexpr unsigned long event = 1000 + 5643;  // vtkCommand::UserEvent and any number

  struct Parameter {
    std::string name;
    bool isWhole = false;
    double value = 0.0;  // in force from the simulation's next call on
    double low = 0.0;
    double high = 0.0;
  };

  std::map<std::string, double> changes;  // for the observer: new values by name, within bounds
  // from the observer: the parameters after the changes, in the order of declaration
  std::vector<Parameter> parameters;
};

}  // namespace pv

#endif
