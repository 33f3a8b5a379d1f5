// The five functions that Catalyst calls. No exception leaves them.
#include <catalyst.h>
#include <catalyst_stub.h>
#include <mpi.h>

#include <atomic>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>

#include "catalyst_adaptor/catalyst2/Node.h"
#include "catalyst_adaptor/catalyst2/Session.h"
#include "catalyst_adaptor/vdi_catalyst.h"
#include "catalyst_impl_vdi.h"

namespace {

using vdi::catalyst::Node;
using vdi::catalyst::Session;

/// The process's only session: Catalyst passes no handle.
std::unique_ptr<Session>& session() {
  static std::unique_ptr<Session> one;
  return one;
}

/// Whether a thread is in a call that uses the session.
constinit std::atomic_flag entered;

/// 100 for invalid input, as in ParaView's implementation; 102, 103 and 104 for VDI_CATALYST_ENGINE, _SCRIPT
/// and _BUSY.
/// Catalyst's own codes are lower.
catalyst_status statusOf(int code) {
  if (code == VDI_CATALYST_OK) return catalyst_status_ok;
  constexpr int first = 100;
  return static_cast<catalyst_status>(code == VDI_CATALYST_BAD_ARGUMENT ? first : first + code);
}

/// `work` returns a code of vdi_catalyst.h.
template <typename Work>
catalyst_status run(const conduit_node* params, Work work) {
  try {
    if (params == nullptr) throw std::invalid_argument("a node is null");
    return statusOf(work(Node(params, "")));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vdi_catalyst: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "vdi_catalyst: an unknown exception\n");
  }
  return statusOf(VDI_CATALYST_BAD_ARGUMENT);
}

/// Does the work unless another call does its own.
template <typename Work>
catalyst_status alone(Work work) {
  if (entered.test_and_set(std::memory_order_acquire)) {
    std::fprintf(stderr, "vdi_catalyst: another thread is in a call of Catalyst, so this call was refused\n");
    return statusOf(VDI_CATALYST_BUSY);
  }
  const catalyst_status status = work();
  entered.clear(std::memory_order_release);
  return status;
}

/// The communicator, as ParaView's implementation takes it: a Fortran handle, or all ranks of the simulation.
MPI_Comm communicatorOf(const Node& params) {
  int running = 0;
  int over = 0;
  MPI_Initialized(&running);
  MPI_Finalized(&over);
  if (running == 0 || over != 0) throw std::runtime_error("MPI isn't running");
  const auto handle = params.find("catalyst/mpi_comm");
  if (!handle) return MPI_COMM_WORLD;
  MPI_Comm comm = MPI_Comm_f2c(static_cast<MPI_Fint>(handle->whole()));
  // OpenMPI's answer to a wrong handle is a null pointer.
  if (comm == MPI_Comm{} || comm == MPI_COMM_NULL) handle->refuse("is no communicator's Fortran handle");
  return comm;
}

}  // namespace

catalyst_status catalyst_initialize_vdi(const conduit_node* params) {
  return alone([&] {
    return run(params, [](const Node& node) {
      if (session()) throw std::runtime_error("catalyst_initialize was called before; finalize first");
      auto own = std::make_unique<Session>(communicatorOf(node));
      const int code = own->initialize(node);
      if (code == VDI_CATALYST_OK) session() = std::move(own);
      return code;
    });
  });
}

catalyst_status catalyst_execute_vdi(const conduit_node* params) {
  return alone([&] {
    // catalyst_initialize has reported why there is no session.
    if (!session()) return statusOf(VDI_CATALYST_BAD_ARGUMENT);
    return run(params, [](const Node& node) { return session()->execute(node); });
  });
}

catalyst_status catalyst_results_vdi(conduit_node* params) {
  return alone([&] {
    if (!session()) return statusOf(VDI_CATALYST_BAD_ARGUMENT);
    return run(params, [&](const Node&) { return session()->results(params); });
  });
}

catalyst_status catalyst_finalize_vdi(const conduit_node*) {
  return alone([] {
    if (!session()) return statusOf(VDI_CATALYST_BAD_ARGUMENT);
    const int code = session()->finalize();
    session().reset();
    return statusOf(code);
  });
}

catalyst_status catalyst_about_vdi(conduit_node* params) {
  return run(params, [&](const Node&) {
    if (catalyst_stub_about(params) != catalyst_status_ok) return VDI_CATALYST_BAD_ARGUMENT;
    conduit_node_set_path_char8_str(params, "catalyst/implementation", "vdi");
    conduit_node_set_path_int32(params, "catalyst/use_mpi", 1);
    conduit_node_set_path_char8_str(params, "catalyst/vdi/version", VDI_VERSION);
    return VDI_CATALYST_OK;
  });
}
