// How vdi/comm calls MPI: at once, or through the thread's Funnel. Private to vdi/comm.
#pragma once

#include <mpi.h>

#include <functional>
#include <vector>

namespace vdi::comm {

/// Throws Error{Communication} for a result other than MPI_SUCCESS.
void check(int result, const char* call);

/// What a thread within a Funnel asks for.
struct Operation {
  /// Begins it, by calls that don't wait for other ranks; gives the requests that tell of its end.
  std::function<int(std::vector<MPI_Request>&)> begin;

  /// Whether this thread is within a Funnel.
  static bool isCarried();
  /// Waits until it has ended, in a thread that's within a Funnel. Throws as check does.
  void carry(const char* name) const;
};

/// A collective: `blocking` with `arguments`, or where the thread has a Funnel `starting`, which takes a
/// request, too.
template <typename Blocking, typename Starting, typename... Arguments>
void call(const char* name, Blocking blocking, Starting starting, Arguments... arguments) {
  if (!Operation::isCarried()) return check(blocking(arguments...), name);
  Operation{[&](std::vector<MPI_Request>& requests) {
    return starting(arguments..., &requests.emplace_back(MPI_REQUEST_NULL));
  }}.carry(name);
}

/// What waits for nobody: `function` gives MPI's result.
template <typename Function>
void callHere(const char* name, const Function& function) {
  if (!Operation::isCarried()) return check(function(), name);
  Operation{[&](std::vector<MPI_Request>&) { return function(); }}.carry(name);
}

/// Waits for the end of requests.
void waitForAll(std::vector<MPI_Request>& requests);

}  // namespace vdi::comm
