// Execution of the wishes of a VDIStream's viewers, on all ranks at the same step.
#ifndef VDISteering_h
#define VDISteering_h

#include <string>

class vtkSMProxy;
class vtkSMSourceProxy;
class vtkSMExtractsController;
class vtkVDIStreamWriter;

namespace vdi::stream {
struct Wish;
}  // namespace vdi::stream

namespace pv {

/// Part of an extractor that steers. Each rank with a client of its own (Catalyst, pvbatch --symmetric) has
/// one; otherwise only the single client has. The first rank serves. Before it serves, its requests for
/// wishes return nothing.
class Steering {
 public:
  /// Whether the period requires a VDI for this step. Call it once for each step.
  bool isDue();
  /// Call it after a step's VDI has been published. It takes the viewers' wishes and applies them on all
  /// ranks; they are in force from the next step on. While viewers pause the simulation, it waits here, and
  /// makes the step's VDI again when a viewer changes it. Collective over the clients. Throws vdi::Error:
  /// RemoteRank if another rank doesn't take part, InvalidArgument if server and client are different
  /// processes, Io for the log.
  void meet(vtkSMSourceProxy* writer, vtkSMExtractsController* extractor);

 private:
  void apply(const vdi::stream::Wish& wish, vtkSMProxy* generator);
  void tell(vtkVDIStreamWriter* server, vtkSMProxy* generator) const;

  int period_ = 1;
  int sinceLast_ = 0;  // number of steps since the last VDI
  bool isPaused_ = false;
  std::string preset_;  // the viewers' last colour map; empty: none so far
};

}  // namespace pv

#endif
