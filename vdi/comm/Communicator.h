// The ranks that make one VDI together. <mpi.h> stays inside vdi/comm: callers pass MPI_Comm_c2f(comm).
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace vdi::comm {

/// Byte blocks of every rank, concatenated in rank order: rank r's part is bytes[offsets[r] .. offsets[r+1]).
struct Gathered {
  std::vector<std::byte> bytes;
  std::vector<std::uint64_t> offsets;  // size() + 1
  std::span<const std::byte> of(int rank) const {
    const auto r = static_cast<std::size_t>(rank);
    return std::span(bytes).subspan(offsets[r], offsets[r + 1] - offsets[r]);
  }
};

/// RAII over a duplicate of an MPI communicator, or over no MPI at all (one rank). Movable, not copyable. All
/// functions marked collective must be called by every rank in the same order. MPI errors become
/// Error{Communication}.
class Communicator {
 public:
  /// One rank, never touches MPI.
  static Communicator serial();
  /// Duplicates the communicator (collective). `fortranHandle` = MPI_Comm_c2f(comm). Throws
  /// Error{Communication} when MPI isn't initialised, Error{InvalidArgument} for MPI_COMM_NULL. With
  /// VDI_RANKS_PER_HOST=K, for tests, each K ranks of a host count as a host of their own.
  static Communicator fromMpi(int fortranHandle);
  /// MPI_COMM_WORLD if MPI is initialised and not finalised, else serial(). For programs of ours; never for a
  /// plugin.
  static Communicator world();

  ~Communicator();  // frees the duplicate unless MPI was finalised before
  Communicator(Communicator&&) noexcept;
  Communicator& operator=(Communicator&&) noexcept;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  int rank() const;
  int size() const;
  int localRank() const;  // rank among those that share this node's memory
  /// The lowest rank of those that share memory with `rank`: ranks of one host have the same.
  int hostLeader(int rank) const;
  /// Collective: rank 0's environment variable, empty where that isn't set. What other ranks have doesn't
  /// count: mpirun may not pass variables on to other hosts.
  std::string environment(const char* name) const;

  void barrier() const;  // collective

  // Collective reductions, element by element, over spans of equal size on all ranks.
  void allReduceMin(std::span<double> values) const;
  void allReduceMax(std::span<double> values) const;
  void allReduceSum(std::span<double> values) const;
  void allReduceSum(std::span<std::uint64_t> values) const;
  void allReduceMax(std::span<std::uint64_t> values) const;

  // Exchanges of bytes, all collective. Elements of `elementBytes` each travel as one MPI datatype, so more
  // than 2 GiB is fine, as long as no rank sends or receives 2^31 elements or more in one call. Where that
  // fails, or a rank lacks the memory, nothing is sent and every rank throws: the one in trouble its own
  // error, the others Error{RemoteRank}.

  /// Every rank gets the root's bytes; what the others pass in is dropped.
  std::vector<std::byte> broadcast(std::vector<std::byte> bytes, int root) const;
  /// Every rank's bytes, on every rank. Sizes may differ by rank.
  Gathered allGather(std::span<const std::byte> bytes, std::size_t elementBytes) const;
  /// Every rank's bytes, on the root; elsewhere the result is empty, `offsets` too. Sizes may differ by rank.
  Gathered gather(std::span<const std::byte> bytes, std::size_t elementBytes, int root) const;
  /// `counts[r]` elements go to rank r, taken from `bytes` in rank order; the result has what every rank sent
  /// here.
  Gathered allToAll(std::span<const std::byte> bytes, std::span<const std::uint64_t> counts,
                    std::size_t elementBytes) const;

  /// `words` of each rank, on every rank: [size][words.size()], the same number on all of them.
  std::vector<std::uint64_t> allGatherWords(std::span<const std::uint64_t> words) const;
  /// wordsTo: [size][n], n words for each rank; the result has [size][n], n from each.
  std::vector<std::uint64_t> allToAllWords(std::span<const std::uint64_t> wordsTo) const;

  /// Collective: nobody leaves alone. With no error on any rank it returns. Otherwise every rank throws: a
  /// rank with an error rethrows its own, the others throw Error{RemoteRank} with the lowest failing rank's
  /// number and text.
  void agree(const std::exception_ptr& mine) const;
  /// Runs `work`, then agree() with what it threw. Collective; `work` itself must not communicate.
  void together(const std::function<void()>& work) const;
  /// The same, in the same message: whether `work` was true on any rank.
  bool anyTogether(const std::function<bool()>& work) const;
  /// The same, in the same message: what `work` gave on each rank.
  std::vector<std::uint64_t> gatherTogether(const std::function<std::uint64_t()>& work) const;
  /// Collective: throws Error{InvalidArgument} on every rank if `fingerprint` differs between ranks; `what`
  /// says what was compared.
  void requireEqual(std::uint64_t fingerprint, const std::string& what) const;
  struct Fingerprint {
    std::uint64_t value;
    const char* what;
  };
  /// The same of several at once: the error names all that differ.
  void requireEqual(std::span<const Fingerprint> fingerprints) const;

 private:
  friend class Messages;
  struct State;
  [[noreturn]] void failTogether(const std::exception_ptr& mine, int firstFailing) const;
  explicit Communicator(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Messages from rank to rank, all at once. What's sent and where it's received must stay until `wait`, or
/// until this object goes, which waits too. Messages of a pair of ranks arrive in the order in which they
/// were sent; both must name the same sizes. Nothing is sent for none.
class Messages {
 public:
  explicit Messages(const Communicator& comm);
  ~Messages();
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
  Messages(Messages&&) = delete;
  Messages& operator=(Messages&&) = delete;

  void send(int to, std::span<const std::byte> bytes);
  void receive(int from, std::span<std::byte> bytes);
  void wait();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace vdi::comm
