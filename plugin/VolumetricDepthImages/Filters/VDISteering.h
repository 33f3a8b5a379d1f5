// What viewers of a VDIStream ask for, done on all ranks at the same step.
#ifndef VDISteering_h
#define VDISteering_h

class vtkSMProxy;
class vtkSMSourceProxy;
class vtkSMExtractsController;
class vtkVDIStreamWriter;

namespace vdi::stream {
struct Wish;
}  // namespace vdi::stream

namespace pv {

/// Belongs to an extractor that steers. Each rank that has a client of its own (Catalyst, pvbatch
/// --symmetric) has one; elsewhere the only client has. The rank that serves is the first, and asks in vain
/// before it serves.
class Steering {
 public:
  /// Whether the VDI of a step is to be made, going by the period. To be called once for each step.
  bool IsDue();
  /// After a step's VDI has been published: takes what viewers have asked for and applies it on all ranks, to
  /// be in force from the next step on. While the simulation is to wait, it waits in here, and makes the
  /// step's VDI anew when a viewer changes it. Collective over the clients. Throws vdi::Error: RemoteRank
  /// where another rank doesn't come along, InvalidArgument where the server is in another process than the
  /// client, Io for the log.
  void Meet(vtkSMSourceProxy* writer, vtkSMExtractsController* extractor);

 private:
  void Apply(const vdi::stream::Wish& wish, vtkSMProxy* generator);
  void Tell(vtkVDIStreamWriter* server, vtkSMProxy* generator) const;

  int Period = 1;
  int SinceLast = 0;  // steps since a VDI was made
  bool IsPaused = false;
};

}  // namespace pv

#endif
