// The code that all engines' calls share: it checks arguments, and gives all ranks the same result.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/core/Error.h"

namespace vdi::catalyst {

/// The maximum number of components of an array.
inline constexpr int maxComponents = 16;
/// The maximum number of numbers that stand for an array's missing values.
inline constexpr int maxMissing = 64;

/// The part of a handle that these functions use.
struct Calls {
  MPI_Comm comm = MPI_COMM_NULL;  // a duplicate of the simulation's
  std::string error;
  std::string printed;  // the last printed text, so that a repeated failure is printed in full only once
};

/// Collective: returns the highest code of any rank. On failure it stores the text of the lowest rank with
/// that code and a text, on all ranks, and rank 0 prints it. Only execute gives `step`. Never throws: without
/// memory, the text is shorter.
int conclude(Calls& self, int code, std::string_view text, std::optional<std::int64_t> step) noexcept;

/// The text of this thread's last failure, of whatever handle, for calls that leave no handle behind; "" if
/// there was none. Valid until the next failure.
const char* lastError() noexcept;

/// Runs `work`, which returns nothing or the text of a failure. A failure or an exception becomes `code`.
/// Never throws, even if there is no memory for the failure's text.
template <typename Work>
int guarded(Calls& self, int code, Work work, std::optional<std::int64_t> step = std::nullopt) {
  std::optional<std::string> failure;
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
      work();
    } else {
      failure = work();
    }
  } catch (const std::bad_alloc&) {
    return conclude(self, code, "out of memory on this host", step);
  } catch (const std::exception& error) {
    return conclude(self, code, error.what(), step);
  } catch (...) {
    return conclude(self, code, "an unknown exception", step);
  }
  return conclude(self, failure ? code : VDI_CATALYST_OK, failure ? std::string_view(*failure) : "", step);
}

/// Like `guarded`, for work that fails on all ranks together. Ranks that fail because of another rank report
/// nothing.
template <typename Work>
int guardedTogether(Calls& self, int code, Work work, std::optional<std::int64_t> step = std::nullopt) {
  return guarded(
      self, code,
      [&]() -> std::optional<std::string> {
        try {
          work();
          return std::nullopt;
        } catch (const Error& error) {
          return error.code() == ErrorCode::RemoteRank ? "" : error.what();
        }
      },
      step);
}

/// Collective: makes a handle on a duplicate of the communicator, which the caller frees. On failure, no rank
/// has either.
template <typename Handle>
int makeHandle(std::int32_t fortranCommunicator, std::unique_ptr<Handle>& handle) {
  Calls calls;  // reports that there is no memory for the handle
  if (MPI_Comm_dup(MPI_Comm_f2c(fortranCommunicator), &calls.comm) != MPI_SUCCESS)
    return VDI_CATALYST_BAD_ARGUMENT;
  MPI_Comm_set_errhandler(calls.comm, MPI_ERRORS_RETURN);
  const int code = guarded(calls, VDI_CATALYST_ENGINE, [&] { handle = std::make_unique<Handle>(); });
  if (code == VDI_CATALYST_OK) {
    handle->comm = calls.comm;
  } else {
    handle.reset();
    MPI_Comm_free(&calls.comm);
  }
  return code;
}

/// Throws std::invalid_argument with the text `what` unless `good`.
inline void require(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}
/// Collective: throws std::invalid_argument with the text `what` on all ranks if the ranks' values differ.
void requireEqual(MPI_Comm comm, std::int64_t value, const char* what);
/// Throws std::invalid_argument with the reason if the blocks are missing, or one is invalid.
void checkBlocks(std::int32_t count, const vdi_catalyst_block* blocks);
/// Memory for a mark of each of the block's cells, which ParaView needs if some are ghost cells; null if none
/// are. Throws std::runtime_error if there is too little memory.
std::unique_ptr<unsigned char[]> newMarks(const vdi_catalyst_block& block);
/// Throws std::invalid_argument with the reason if an array can't have the name or association.
void checkName(const char* name, std::int32_t association);
/// Throws std::invalid_argument with the reason if an array can't have the name, association or offset.
void checkOffset(const char* name, std::int32_t association, const double* offset);
/// Throws std::invalid_argument with the reason unless the time of a step is finite: files hold no others.
void requireTime(double time);
/// Whether ParaView can count this step.
bool isStep(std::int64_t step);
/// Throws std::invalid_argument with the reason unless the step fits ParaView's int, by which it counts steps
/// and names files. Another step would be lost, or replace another step's files.
void requireStep(std::int64_t step);

}  // namespace vdi::catalyst
