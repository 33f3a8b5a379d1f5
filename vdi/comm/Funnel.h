// Lets a thread take part in what ranks do together although MPI was initialised for another one alone
// (MPI_THREAD_FUNNELED, or a program that asked for no threads at all, as ParaView's servers do).
#pragma once

#include <chrono>
#include <memory>

namespace vdi::comm {

/// Carries a thread's calls of MPI to the one that may make them: on each rank a thread works within an
/// Entry, and the program's own thread serves it now and then. Served operations never block: a rank that
/// isn't there yet keeps nobody in `serve`, so ranks may serve at different times, and do something else, MPI
/// too, in between. It needs an MPI that gets on with an operation while its rank is in other calls of MPI,
/// or serves.
class Funnel {
 public:
  Funnel();
  ~Funnel();  // no Entry may be left
  Funnel(const Funnel&) = delete;
  Funnel& operator=(const Funnel&) = delete;
  Funnel(Funnel&&) = delete;
  Funnel& operator=(Funnel&&) = delete;

  /// While it's there, operations of Communicators and Messages in this thread wait for somebody who serves.
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

  /// In the thread that may call MPI. Returns when `most` has passed, or before where the other thread has
  /// asked for nothing for some milliseconds. To be called again until that thread has ended, on all ranks.
  void serve(std::chrono::milliseconds most);

 private:
  friend struct Operation;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::comm
