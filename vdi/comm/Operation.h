// Calls MPI directly, or through the thread's Funnel. Private to vdi/comm.
#pragma once

#include <mpi.h>

#include <vector>

#include "vdi/core/FunctionRef.h"

namespace vdi::comm {

/// Throws Error{Communication} for a result other than MPI_SUCCESS.
void check(int result, const char* call);

/// An MPI operation that a thread within a Funnel requests.
struct Operation {
  /// Begins the operation, by calls that do not wait for other ranks, and adds the requests that complete it.
  /// The vector always has room for one request.
  FunctionRef<int(std::vector<MPI_Request>&)> begin;

  /// Whether this thread is within a Funnel.
  static bool isCarried();
  /// Waits until the operation has ended; the thread must be within a Funnel. Throws as check does.
  void carry(const char* name) const;
};

/// Calls a collective with `arguments`: `blocking`, or in a Funnel `starting`, which also takes a request.
template <typename Blocking, typename Starting, typename... Arguments>
void call(const char* name, Blocking blocking, Starting starting, Arguments... arguments) {
  if (!Operation::isCarried()) return check(blocking(arguments...), name);
  const auto begin = [&](std::vector<MPI_Request>& requests) {
    return starting(arguments..., &requests.emplace_back(MPI_REQUEST_NULL));
  };
  Operation{begin}.carry(name);
}

/// Calls an operation that waits for no other rank; `function` returns MPI's result.
template <typename Function>
void callHere(const char* name, const Function& function) {
  if (!Operation::isCarried()) return check(function(), name);
  const auto begin = [&](std::vector<MPI_Request>&) { return function(); };
  Operation{begin}.carry(name);
}

/// Waits until all requests are complete, and clears them. A vector of up to eight requests keeps its memory.
void waitForAll(std::vector<MPI_Request>& requests);

}  // namespace vdi::comm
