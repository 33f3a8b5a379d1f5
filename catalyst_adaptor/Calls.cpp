#include "catalyst_adaptor/Calls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <string_view>

namespace vdi::catalyst {

namespace {

/// The first line, or the first two if the first one only names the source.
std::string firstLine(const std::string& text) {
  std::size_t end = text.find('\n');
  std::string line = text.substr(0, end);
  while (!line.empty() && line.back() == ' ') line.pop_back();
  if (end == std::string::npos || line.empty() || line.back() != ':') return line;
  const std::size_t next = end + 1;
  end = text.find('\n', next);
  return line + " " + text.substr(next, end == std::string::npos ? end : end - next);
}

/// Prints the error. Prints a repeated one in one line, and only for a step, because its files are missing.
void print(Calls& self, std::optional<std::int64_t> step) {
  const bool again = self.error == self.printed;
  if (again && !step) return;
  self.printed = self.error;
  const std::string place = step ? "step " + std::to_string(*step) + ": " : "";
  const std::string text = again ? "again, " + firstLine(self.error) : self.error;
  std::fprintf(stderr, "vdi_catalyst: %s%s\n", place.c_str(), text.c_str());
}

/// Throws if VTK's counts would overflow. It counts points, because there are more of them than cells.
void requireCountable(const vdi_catalyst_block& block) {
  std::int64_t points = 1;
  constexpr std::int64_t maximum = std::int64_t{1} << 60;
  for (const int32_t cells : block.cells) {
    const std::int64_t more = std::int64_t{cells} + 1;
    require(more <= std::numeric_limits<int>::max() && points <= maximum / more,
            "a block has too many cells to count");
    points *= more;
  }
}

/// Throws std::invalid_argument with the reason if the block is invalid.
void checkBlock(const vdi_catalyst_block& block) {
  for (int axis = 0; axis < 3; ++axis) {
    require(block.cells[axis] >= 1, "a block needs at least one cell per axis");
    require(block.ghost_lo[axis] >= 0 && block.ghost_hi[axis] >= 0, "ghost layers can't be negative");
    require(std::int64_t{block.ghost_lo[axis]} + block.ghost_hi[axis] < block.cells[axis],
            "a block has only ghost cells");
    require(std::isfinite(block.spacing[axis]) && block.spacing[axis] > 0.0,
            "spacing must be finite and > 0");
    require(std::isfinite(block.origin[axis]), "the origin must be finite");
  }
  requireCountable(block);
}

std::string& lastErrorText() {
  thread_local std::string text;
  return text;
}

/// Collective: the speaker's text on all ranks. A rank without memory for all of it gets its
/// beginning, and doesn't leave other ranks waiting.
std::string shared(MPI_Comm comm, std::string_view text, int speaker) {
  auto length = static_cast<std::uint64_t>(text.size());
  MPI_Bcast(&length, 1, MPI_UINT64_T, speaker, comm);
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  std::string all;
  std::array<char, 1024> part{};
  for (std::uint64_t done = 0; done < length; done += part.size()) {
    const std::size_t count = std::min<std::uint64_t>(part.size(), length - done);
    if (rank == speaker) text.copy(part.data(), count, done);
    MPI_Bcast(part.data(), static_cast<int>(count), MPI_CHAR, speaker, comm);
    try {
      if (all.size() == done) all.append(part.data(), count);
    } catch (const std::bad_alloc&) {
    }
  }
  return all;
}

}  // namespace

int conclude(Calls& self, int code, std::string_view text, std::optional<std::int64_t> step) noexcept {
  int worst = code;
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, self.comm);
  if (worst == VDI_CATALYST_OK) return worst;
  int rank = 0;
  int size = 0;
  MPI_Comm_rank(self.comm, &rank);
  MPI_Comm_size(self.comm, &size);
  // Ranks with the code and a text come first, then those with the code only, then the others.
  int speaker = rank + size * (code != worst ? 2 : text.empty() ? 1 : 0);
  MPI_Allreduce(MPI_IN_PLACE, &speaker, 1, MPI_INT, MPI_MIN, self.comm);
  speaker %= size;
  const std::string message = shared(self.comm, text, speaker);
  try {
    self.error = "rank " + std::to_string(speaker) + ": " +
                 (message.empty() ? "a script failed without a message" : message);
    lastErrorText() = self.error;
    if (rank == 0) print(self, step);
  } catch (const std::bad_alloc&) {
    self.error = lastErrorText() = "out of memory";  // fits into a string without an allocation
    if (rank == 0) std::fputs("vdi_catalyst: out of memory\n", stderr);
  }
  return worst;
}

const char* lastError() noexcept {
  return lastErrorText().c_str();
}

void requireEqual(MPI_Comm comm, std::int64_t value, const char* what) {
  std::array<std::int64_t, 2> extremes{value, ~value};
  MPI_Allreduce(MPI_IN_PLACE, extremes.data(), 2, MPI_INT64_T, MPI_MAX, comm);
  require(extremes[0] == ~extremes[1], what);
}

void checkBlocks(std::int32_t count, const vdi_catalyst_block* blocks) {
  require(count >= 0 && (count == 0 || blocks != nullptr), "no blocks given");
  for (std::int32_t i = 0; i < count; ++i) checkBlock(blocks[i]);
}

std::unique_ptr<unsigned char[]> newMarks(const vdi_catalyst_block& block) {
  std::size_t cells = 1;
  bool any = false;
  for (int axis = 0; axis < 3; ++axis) {
    cells *= static_cast<std::size_t>(block.cells[axis]);
    any = any || block.ghost_lo[axis] > 0 || block.ghost_hi[axis] > 0;
  }
  if (!any) return nullptr;
  std::unique_ptr<unsigned char[]> marks(new (std::nothrow) unsigned char[cells]);
  if (!marks) {
    throw std::runtime_error("no memory for the marks of a block's ghost cells: " + std::to_string(cells) +
                             " bytes");
  }
  return marks;
}

void checkName(const char* name, std::int32_t association) {
  require(name != nullptr && *name != '\0', "an array needs a name");
  require(association == VDI_CATALYST_POINTS || association == VDI_CATALYST_CELLS, "unknown association");
}

void checkOffset(const char* name, std::int32_t association, const double* offset) {
  checkName(name, association);
  require(offset != nullptr, "no offset given");
  for (int axis = 0; axis < 3; ++axis)
    require(std::abs(offset[axis]) <= 0.5, "an array's offset must be at most half a cell");  // false for NaN
}

void requireTime(double time) {
  require(std::isfinite(time), "the time isn't a finite number");
}

bool isStep(std::int64_t step) {
  return step >= 0 && step <= std::numeric_limits<int>::max();
}

void requireStep(std::int64_t step) {
  if (isStep(step)) return;
  const std::int64_t maximum = std::numeric_limits<int>::max();
  throw std::invalid_argument("step " + std::to_string(step) +
                              " is refused: ParaView counts steps from 0 to " + std::to_string(maximum) +
                              ". Use smaller numbers, and continue them after a restart, or the new files "
                              "replace those of the earlier run");
}

}  // namespace vdi::catalyst
