// Lets a second thread take part in collective work although MPI was initialised for one thread only
// (MPI_THREAD_FUNNELED, or MPI_THREAD_SINGLE, as ParaView's servers do).
#pragma once

#include <chrono>
#include <memory>

namespace vdi::comm {

/// Carries a thread's MPI calls to the one thread that may make them. On each rank, a thread works within an
/// Entry, and the program's main thread serves it from time to time. Served operations never block: `serve`
/// returns although another rank is late, so ranks may serve at different times, and do other work, including
/// MPI calls, in between. The MPI library must make progress on an operation while its rank is in other MPI
/// calls or serves.
class Funnel {
 public:
  Funnel();
  ~Funnel();  // requires that no Entry is left
  Funnel(const Funnel&) = delete;
  Funnel& operator=(const Funnel&) = delete;
  Funnel(Funnel&&) = delete;
  Funnel& operator=(Funnel&&) = delete;

  /// While an Entry exists, operations of Communicators and Messages in its thread wait for another thread to
  /// serve them.
  class Entry {
   public:
    explicit Entry(Funnel& funnel);
    ~Entry();
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    Entry(Entry&&) = delete;
    Entry& operator=(Entry&&) = delete;

   private:
    Funnel* before_;
  };

  /// Call in the thread that may call MPI, repeatedly until the other thread has ended, on all ranks. Returns
  /// after `most`, or earlier if the other thread has requested nothing for some milliseconds.
  void serve(std::chrono::milliseconds most);

 private:
  friend struct Operation;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::comm
