#include "catalyst_adaptor/scripts/Agreement.h"

#include <array>
#include <functional>
#include <stdexcept>

namespace vdi::catalyst {

Agreement::Agreement(MPI_Comm comm) {
  if (MPI_Comm_dup(comm, &comm_) != MPI_SUCCESS) throw std::runtime_error("MPI_Comm_dup failed");
  MPI_Comm_set_errhandler(comm_, MPI_ERRORS_RETURN);
}

Agreement::~Agreement() {
  int over = 0;
  MPI_Finalized(&over);
  if (over == 0) MPI_Comm_free(&comm_);
}

Agreement::Meeting Agreement::meet(Place place, bool failed, std::int64_t operation) const {
  const auto at = static_cast<std::int64_t>(place);
  // The maxima of x and -x, or of x and ~x, give both extremes of x.
  std::array<std::int64_t, 5> extremes{at, -at, failed ? 1 : 0, operation, ~operation};
  const int result = MPI_Allreduce(MPI_IN_PLACE, extremes.data(), static_cast<int>(extremes.size()),
                                   MPI_INT64_T, MPI_MAX, comm_);
  // MPI has failed, so there is no rank to wait for
  if (result != MPI_SUCCESS) return {Place::StepOver, Place::StepOver, true, false};
  return {static_cast<Place>(-extremes[1]), static_cast<Place>(extremes[0]), extremes[2] != 0,
          extremes[3] == ~extremes[4]};
}

std::string Agreement::enter(const std::string& operation) {
  const auto hash = static_cast<std::int64_t>(std::hash<std::string>()(operation) >> 1U);
  const Meeting meeting = meet(Place::Entering, false, hash);
  if (meeting.last == Place::Entering && meeting.same) return {};
  if (meeting.failed) return otherFailed;
  return "the ranks' scripts differ: this rank updates " + operation.substr(0, operation.find(',')) +
         ", but " +
         (meeting.last == Place::Entering ? "another rank updates something else"
                                          : "another rank's script has ended") +
         "; updates are collective, so all ranks must do them in the same order";
}

bool Agreement::leavePart(bool failed) {
  Meeting meeting{};
  do {
    meeting = meet(Place::PartOver, failed, 0);
  } while (meeting.first == Place::Entering);
  return meeting.failed || meeting.last == Place::StepOver;
}

void Agreement::leaveStep() {
  while (meet(Place::StepOver, false, 0).first != Place::StepOver) {
  }
}

}  // namespace vdi::catalyst
