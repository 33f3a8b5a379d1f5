// The ranks that make one VDI together. <mpi.h> stays inside vdi/comm: callers pass MPI_Comm_c2f(comm).
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vdi/core/FunctionRef.h"

namespace vdi::comm {

/// One byte array of each rank, concatenated in rank order: rank r's part is bytes[offsets[r] ..
/// offsets[r+1]).
struct Gathered {
  std::vector<std::byte> bytes;
  std::vector<std::uint64_t> offsets;  // size() + 1
  std::span<const std::byte> of(int rank) const {
    const auto r = static_cast<std::size_t>(rank);
    return std::span(bytes).subspan(offsets[r], offsets[r + 1] - offsets[r]);
  }
};

/// Owns a duplicate of an MPI communicator, or represents one rank without MPI. Movable, not copyable. Every
/// rank must call all functions marked collective in the same order, one thread at a time. MPI errors become
/// Error{Communication}. If a rank lacks memory, the ranks agree on it before they communicate: a collective
/// that throws on one rank throws on all. Callers must do the same between collectives: whatever allocates
/// memory belongs inside together().
class Communicator {
 public:
  /// One rank; never calls MPI.
  static Communicator serial();
  /// Duplicates the communicator (collective). `fortranHandle` = MPI_Comm_c2f(comm). Throws
  /// Error{Communication} if MPI is not initialised, Error{InvalidArgument} for MPI_COMM_NULL. For tests,
  /// VDI_RANKS_PER_HOST=K makes every K ranks of a host count as a host of their own.
  static Communicator fromMpi(int fortranHandle);
  /// MPI_COMM_WORLD if MPI is initialised and not finalised, else serial(). Only for this project's programs,
  /// never for a plugin.
  static Communicator world();

  ~Communicator();  // frees the duplicate unless MPI was finalised before
  Communicator(Communicator&&) noexcept;
  Communicator& operator=(Communicator&&) noexcept;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  int rank() const;
  int size() const;
  int localRank() const;  // rank among those of this host
  /// The lowest rank that shares memory with `rank`; equal for all ranks of one host.
  int hostLeader(int rank) const;
  /// Collective: rank 0's environment variable, empty if it is unset. Other ranks' values are ignored,
  /// because mpirun may not pass variables on to other hosts.
  std::string environment(const char* name) const;

  void barrier() const;  // collective

  // Collective reductions, element by element, over spans of equal size on all ranks.
  void allReduceMin(std::span<double> values) const;
  void allReduceMax(std::span<double> values) const;
  void allReduceSum(std::span<double> values) const;
  void allReduceSum(std::span<std::uint64_t> values) const;
  void allReduceMax(std::span<std::uint64_t> values) const;

  /// Collective: the root gets the largest values; other ranks' stay as they are.
  void reduceMax(std::span<std::uint64_t> values, int root) const;

  // Exchanges of bytes, all collective. Elements of `elementBytes` each travel as one MPI datatype, so more
  // than 2 GiB is fine, as long as no rank sends or receives 2^31 elements or more in one call. If that limit
  // is exceeded, or a rank lacks the memory, no bytes are sent and every rank throws: a failing rank its own
  // error, the others Error{RemoteRank}.

  /// Returns the root's bytes on every rank; other ranks' `bytes` are ignored.
  std::vector<std::byte> broadcast(std::vector<std::byte> bytes, int root) const;
  /// Returns the root's number on every rank.
  double broadcast(double number, int root) const;
  /// Returns, on every rank, the text that `work` makes on the root. Only the root calls `work`; if it throws
  /// there, all ranks throw as together's do.
  std::string broadcastText(FunctionRef<std::string()> work, int root) const;
  /// Returns every rank's bytes on every rank. Sizes may differ by rank.
  Gathered allGather(std::span<const std::byte> bytes, std::size_t elementBytes) const;
  /// Returns every rank's bytes on the root, and nothing elsewhere, `offsets` included. Sizes may differ by
  /// rank.
  Gathered gather(std::span<const std::byte> bytes, std::size_t elementBytes, int root) const;
  /// Sends `counts[r]` elements to rank r, taken from `bytes` in rank order, and returns the elements that
  /// every rank sent here.
  Gathered allToAll(std::span<const std::byte> bytes, std::span<const std::uint64_t> counts,
                    std::size_t elementBytes) const;

  /// Returns every rank's `words` on every rank: [size][words.size()]. All ranks pass the same number.
  std::vector<std::uint64_t> allGatherWords(std::span<const std::uint64_t> words) const;
  /// Sends the n words `to`[r] to each rank r, and stores the n words from rank r in `from`[r].
  void allToAllWords(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) const;

  /// Collective: returns if no rank has an error. Otherwise every rank throws: a rank with an error rethrows
  /// its own; the others throw Error{RemoteRank} with the lowest failing rank's number and text.
  void agree(const std::exception_ptr& mine) const;
  /// Runs `work`, then calls agree() with its exception. Collective; `work` itself must not communicate.
  void together(FunctionRef<void()> work) const;
  /// Like together, and returns whether `work` was true on any rank, in the same message.
  bool anyTogether(FunctionRef<bool()> work) const;
  /// Like together, and returns the result of `work` on each rank, in the same message.
  std::vector<std::uint64_t> gatherTogether(FunctionRef<std::uint64_t()> work) const;
  /// Collective: throws Error{InvalidArgument} on every rank if `fingerprint` differs between ranks; `what`
  /// names the compared value.
  void requireEqual(std::uint64_t fingerprint, const char* what) const;
  struct Fingerprint {
    std::uint64_t value;
    const char* what;
  };
  /// Compares several values at once. `work` returns them under the rules of together; the error names those
  /// that differ.
  void requireEqual(FunctionRef<std::vector<Fingerprint>()> work) const;

 private:
  friend class Messages;
  struct State;
  /// Returns every rank's bytes on the root, or on every rank if there is none.
  Gathered gatherTo(std::optional<int> root, std::span<const std::byte> bytes,
                    std::size_t elementBytes) const;
  /// Fills `bytes`, which has the root's size on every rank.
  void broadcastInto(std::span<std::byte> bytes, int root) const;
  [[noreturn]] void failTogether(const std::exception_ptr& mine, int firstFailing) const;
  explicit Communicator(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Point-to-point messages, all under way at once. The sent bytes and the receiving memory must stay until
/// `wait`, or until the destructor, which waits too. Messages between a pair of ranks arrive in the order in
/// which they were sent; both ranks must pass the same sizes. Empty messages are not sent.
class Messages {
 public:
  explicit Messages(const Communicator& comm);  // takes no memory
  ~Messages();
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
  Messages(Messages&&) = delete;
  Messages& operator=(Messages&&) = delete;

  /// Takes the memory for one more message, sent or received, of `bytes` bytes. Call it for each message
  /// within together(), before the first is sent: other ranks would wait for a rank without memory.
  void reserve(std::uint64_t bytes);
  void send(int to, std::span<const std::byte> bytes);
  void receive(int from, std::span<std::byte> bytes);
  void wait();

 private:
  struct State;
  const Communicator& comm_;
  std::unique_ptr<State> state_;  // null: nothing is reserved
};

}  // namespace vdi::comm
