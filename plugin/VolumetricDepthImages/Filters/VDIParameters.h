// How parameters of a simulation come to who steers it, and changed values back.
//
// A simulation declares its parameters to catalyst_adaptor, which observes `event` on the global
// vtkMultiProcessController. Free of VTK and MPI, as VDICollective.h.
#ifndef VDIParameters_h
#define VDIParameters_h

#include <map>
#include <string>
#include <vector>

namespace pv {

/// Call data of the event. Not collective: who invokes it does so with the same changes on all ranks.
struct ParameterExchange {
  static constexpr unsigned long event = 1000 + 5643;  // vtkCommand::UserEvent and any number

  struct Parameter {
    std::string name;
    bool isWhole = false;
    double value = 0.0;  // in force from the simulation's next call on
    double low = 0.0;
    double high = 0.0;
  };

  std::map<std::string, double> changes;  // for the observer, by name; within bounds
  std::vector<Parameter> parameters;      // from the observer, after the changes, as they were declared
};

}  // namespace pv

#endif
