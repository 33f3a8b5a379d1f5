#include "vdi/comm/Communicator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <numeric>
#include <string_view>
#include <utility>

#include "vdi/comm/Operation.h"
#include "vdi/core/Environment.h"
#include "vdi/core/Error.h"

namespace vdi::comm {

namespace {

/// Elements of `bytes` bytes as one MPI datatype, so that counts stay below 2^31 even if byte counts do not.
class ElementType {
 public:
  explicit ElementType(std::size_t bytes) {
    callHere("MPI_Type_contiguous",
             [&] { return MPI_Type_contiguous(static_cast<int>(bytes), MPI_BYTE, &type_); });
    callHere("MPI_Type_commit", [&] { return MPI_Type_commit(&type_); });
  }
  ~ElementType() {
    callHere("MPI_Type_free", [&] {
      MPI_Type_free(&type_);
      return MPI_SUCCESS;
    });
  }
  ElementType(const ElementType&) = delete;
  ElementType& operator=(const ElementType&) = delete;
  MPI_Datatype handle() const { return type_; }

 private:
  MPI_Datatype type_ = MPI_DATATYPE_NULL;
};

constexpr std::uint64_t maxElements = std::numeric_limits<int>::max();

/// Counts and displacements in MPI's form, by rank.
struct Layout {
  std::vector<int> counts;
  std::vector<int> starts;
  std::uint64_t total = 0;

  explicit Layout(std::size_t ranks) : counts(ranks), starts(ranks) {}

  /// Allocates no memory.
  void set(std::span<const std::uint64_t> sizes) {
    total = 0;
    for (std::size_t r = 0; r < sizes.size(); ++r) {
      starts[r] = static_cast<int>(std::min(total, maxElements));
      counts[r] = static_cast<int>(std::min(sizes[r], maxElements));
      total += sizes[r];
    }
  }
  void requireFits() const {
    if (total <= maxElements) return;
    throw Error(
        ErrorCode::Communication,
        fmt::format("one rank would get {} elements in one exchange; MPI allows {}", total, maxElements));
  }
};

Gathered emptyGathered(const Layout& layout, std::size_t elementBytes) {
  Gathered result;
  result.offsets.reserve(layout.counts.size() + 1);
  result.bytes.resize(layout.total * elementBytes);
  result.offsets.push_back(0);
  for (const int count : layout.counts) {
    result.offsets.push_back(result.offsets.back() + static_cast<std::uint64_t>(count) * elementBytes);
  }
  return result;
}

/// An exception's text, of fixed size, because no memory may be left for the report.
using Text = std::array<char, 1024>;

Text describe(const std::exception_ptr& error) {
  Text text{};
  const auto put = [&text](const char* what) { std::string_view(what).copy(text.data(), text.size() - 1); };
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& e) {
    put(e.what());
  } catch (...) {
    put("an unknown exception");
  }
  return text;
}

/// The number of a rank's simulated host.
int hostOf(int localRank) {
  const std::uint32_t each = environmentCount("VDI_RANKS_PER_HOST", 0).value_or(0);
  return each > 0 ? static_cast<int>(static_cast<std::uint32_t>(localRank) / each) : 0;
}

/// Frees a communicator, unless MPI has been finalised.
class OwnedComm {
 public:
  OwnedComm() = default;
  OwnedComm(const OwnedComm&) = delete;
  OwnedComm& operator=(const OwnedComm&) = delete;
  ~OwnedComm() {
    if (comm_ == MPI_COMM_NULL) return;
    int finalized = 0;
    MPI_Finalized(&finalized);
    if (finalized != 0) return;
    try {
      callHere("MPI_Comm_free", [this] { return MPI_Comm_free(&comm_); });
    } catch (...) {  // the communicator stays, as nothing is left that could free it
    }
  }
  MPI_Comm handle() const { return comm_; }
  MPI_Comm* out() { return &comm_; }

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
};

/// The exception of `work`; null if there is none.
template <typename Work>
std::exception_ptr errorOf(Work&& work) {
  try {
    std::forward<Work>(work)();
  } catch (...) {
    return std::current_exception();
  }
  return nullptr;
}

}  // namespace

struct Communicator::State {
  OwnedComm owned;  // null: serial
  int rank = 0;
  int size = 1;
  int localRank = 0;
  std::vector<int> hostLeaders{0};  // [size]
  // Memory for collectives, which are called one at a time.
  std::vector<std::uint64_t> sizes{0};  // [size]
  Layout in{1};
  Layout out{1};
  std::vector<std::uint64_t> results{0, 0};  // [size][2]: of gatherTogether

  /// Collective: takes the communicator over. If a rank lacks the memory, all throw.
  static std::unique_ptr<State> on(OwnedComm& comm) {
    std::unique_ptr<State> state;
    const std::exception_ptr error = errorOf([&] {
      state = std::make_unique<State>();
      check(MPI_Comm_rank(comm.handle(), &state->rank), "MPI_Comm_rank");
      check(MPI_Comm_size(comm.handle(), &state->size), "MPI_Comm_size");
      const auto ranks = static_cast<std::size_t>(state->size);
      state->hostLeaders.resize(ranks);
      state->sizes.resize(ranks);
      state->in = Layout(ranks);
      state->out = Layout(ranks);
      state->results.resize(2 * ranks);
    });
    int failed = error ? 1 : 0;
    check(MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, comm.handle()), "MPI_Allreduce");
    if (error) std::rethrow_exception(error);
    if (failed != 0) throw Error(ErrorCode::RemoteRank, "another rank can't make a communicator");
    std::swap(*state->owned.out(), *comm.out());
    return state;
  }

  MPI_Comm comm() const { return owned.handle(); }
  bool serial() const { return comm() == MPI_COMM_NULL; }

  template <typename T>
  void allReduce(std::span<T> values, MPI_Datatype type, MPI_Op operation) const {
    assert(values.size() <= maxElements);
    if (serial()) return;
    call("MPI_Allreduce", MPI_Allreduce, MPI_Iallreduce, MPI_IN_PLACE, values.data(),
         static_cast<int>(values.size()), type, operation, comm());
  }

  void allGather(std::span<const std::uint64_t> words, std::span<std::uint64_t> all) const {
    const auto count = static_cast<int>(words.size());
    call("MPI_Allgather", MPI_Allgather, MPI_Iallgather, words.data(), count, MPI_UINT64_T, all.data(), count,
         MPI_UINT64_T, comm());
  }
  void allToAll(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) const {
    const auto count = static_cast<int>(to.size() / static_cast<std::size_t>(size));
    call("MPI_Alltoall", MPI_Alltoall, MPI_Ialltoall, to.data(), count, MPI_UINT64_T, from.data(), count,
         MPI_UINT64_T, comm());
  }
  /// Lays out `in` by the numbers of elements that the ranks send.
  void layOut(std::uint64_t mine) {
    allGather(std::span(&mine, 1), sizes);
    in.set(sizes);
  }
};

Communicator::Communicator(std::unique_ptr<State> state) : state_(std::move(state)) {}
Communicator::~Communicator() = default;
Communicator::Communicator(Communicator&&) noexcept = default;
Communicator& Communicator::operator=(Communicator&&) noexcept = default;

Communicator Communicator::serial() {
  return Communicator(std::make_unique<State>());
}

Communicator Communicator::fromMpi(int fortranHandle) {
  int initialized = 0;
  MPI_Initialized(&initialized);
  if (initialized == 0) throw Error(ErrorCode::Communication, "MPI isn't initialised");
  MPI_Comm given = MPI_Comm_f2c(fortranHandle);
  if (given == MPI_COMM_NULL) throw Error(ErrorCode::InvalidArgument, "not a communicator");
  OwnedComm duplicate;
  check(MPI_Comm_dup(given, duplicate.out()), "MPI_Comm_dup");
  check(MPI_Comm_set_errhandler(duplicate.handle(), MPI_ERRORS_RETURN), "MPI_Comm_set_errhandler");
  std::unique_ptr<State> state = State::on(duplicate);
  OwnedComm node;
  check(MPI_Comm_split_type(state->comm(), MPI_COMM_TYPE_SHARED, state->rank, MPI_INFO_NULL, node.out()),
        "MPI_Comm_split_type");
  check(MPI_Comm_rank(node.handle(), &state->localRank), "MPI_Comm_rank");
  OwnedComm part;
  int host = 0;
  // All ranks report this later: a rank that left here would leave the others waiting.
  std::exception_ptr bad;
  try {
    host = hostOf(state->localRank);
  } catch (const Error&) {
    bad = std::current_exception();
  }
  check(MPI_Comm_split(node.handle(), host, state->rank, part.out()), "MPI_Comm_split");
  int leader = state->rank;
  check(MPI_Bcast(&leader, 1, MPI_INT, 0, part.handle()), "MPI_Bcast");
  check(MPI_Allgather(&leader, 1, MPI_INT, state->hostLeaders.data(), 1, MPI_INT, state->comm()),
        "MPI_Allgather");
  Communicator made(std::move(state));
  made.agree(bad);
  return made;
}

Communicator Communicator::world() {
  int initialized = 0;
  int finalized = 0;
  MPI_Initialized(&initialized);
  MPI_Finalized(&finalized);
  return initialized != 0 && finalized == 0 ? fromMpi(MPI_Comm_c2f(MPI_COMM_WORLD)) : serial();
}

int Communicator::rank() const {
  return state_->rank;
}
int Communicator::size() const {
  return state_->size;
}
int Communicator::localRank() const {
  return state_->localRank;
}

int Communicator::hostLeader(int rank) const {
  assert(rank >= 0 && rank < size());
  return state_->hostLeaders[static_cast<std::size_t>(rank)];
}

std::string Communicator::environment(const char* name) const {
  return broadcastText([&] { return environmentText(name).value_or(""); }, 0);
}

void Communicator::barrier() const {
  if (!state_->serial()) call("MPI_Barrier", MPI_Barrier, MPI_Ibarrier, state_->comm());
}

void Communicator::allReduceMin(std::span<double> values) const {
  state_->allReduce(values, MPI_DOUBLE, MPI_MIN);
}
void Communicator::allReduceMax(std::span<double> values) const {
  state_->allReduce(values, MPI_DOUBLE, MPI_MAX);
}
void Communicator::allReduceSum(std::span<double> values) const {
  state_->allReduce(values, MPI_DOUBLE, MPI_SUM);
}
void Communicator::allReduceSum(std::span<std::uint64_t> values) const {
  state_->allReduce(values, MPI_UINT64_T, MPI_SUM);
}
void Communicator::allReduceMax(std::span<std::uint64_t> values) const {
  state_->allReduce(values, MPI_UINT64_T, MPI_MAX);
}
void Communicator::reduceMax(std::span<std::uint64_t> values, int root) const {
  assert(values.size() <= maxElements);
  if (state_->serial()) return;
  const bool isRoot = rank() == root;
  const void* sent = isRoot ? MPI_IN_PLACE : values.data();
  void* received = isRoot ? values.data() : nullptr;
  call("MPI_Reduce", MPI_Reduce, MPI_Ireduce, sent, received, static_cast<int>(values.size()), MPI_UINT64_T,
       MPI_MAX, root, state_->comm());
}

// Memory is allocated under together() before each exchange, or with the communicator: a rank without enough
// makes all fail, instead of leaving the others waiting in a call that it never makes.

std::vector<std::byte> Communicator::broadcast(std::vector<std::byte> bytes, int root) const {
  assert(root >= 0 && root < size());
  if (state_->serial()) return bytes;
  std::uint64_t size = bytes.size();
  call("MPI_Bcast", MPI_Bcast, MPI_Ibcast, &size, 1, MPI_UINT64_T, root, state_->comm());
  together([&] { bytes.resize(size); });
  broadcastInto(bytes, root);
  return bytes;
}

double Communicator::broadcast(double number, int root) const {
  assert(root >= 0 && root < size());
  broadcastInto(std::as_writable_bytes(std::span(&number, 1)), root);
  return number;
}

std::string Communicator::broadcastText(FunctionRef<std::string()> work, int root) const {
  assert(root >= 0 && root < size());
  std::string text;
  const std::vector<std::uint64_t> sizes = gatherTogether([&]() -> std::uint64_t {
    if (rank() == root) text = work();
    return text.size();
  });
  together([&] { text.resize(sizes[static_cast<std::size_t>(root)]); });
  broadcastInto(std::as_writable_bytes(std::span(text)), root);
  return text;
}

void Communicator::broadcastInto(std::span<std::byte> bytes, int root) const {
  if (state_->serial()) return;
  constexpr std::size_t chunk = 1ULL << 30;
  for (std::size_t done = 0; done < bytes.size(); done += chunk) {
    const auto part = static_cast<int>(std::min(chunk, bytes.size() - done));
    call("MPI_Bcast", MPI_Bcast, MPI_Ibcast, bytes.data() + done, part, MPI_BYTE, root, state_->comm());
  }
}

Gathered Communicator::allGather(std::span<const std::byte> bytes, std::size_t elementBytes) const {
  return gatherTo(std::nullopt, bytes, elementBytes);
}

Gathered Communicator::gather(std::span<const std::byte> bytes, std::size_t elementBytes, int root) const {
  assert(root >= 0 && root < size());
  return gatherTo(root, bytes, elementBytes);
}

Gathered Communicator::gatherTo(std::optional<int> root, std::span<const std::byte> bytes,
                                std::size_t elementBytes) const {
  assert(elementBytes > 0 && bytes.size() % elementBytes == 0);
  if (state_->serial()) return {{bytes.begin(), bytes.end()}, {0, bytes.size()}};
  const auto mine = static_cast<int>(bytes.size() / elementBytes);
  state_->layOut(bytes.size() / elementBytes);
  const Layout& layout = state_->in;
  std::optional<ElementType> type;
  Gathered result;
  together([&] {
    layout.requireFits();
    type.emplace(elementBytes);
    if (root.value_or(rank()) == rank()) result = emptyGathered(layout, elementBytes);
  });
  if (root) {
    call("MPI_Gatherv", MPI_Gatherv, MPI_Igatherv, bytes.data(), mine, type->handle(), result.bytes.data(),
         layout.counts.data(), layout.starts.data(), type->handle(), *root, state_->comm());
  } else {
    call("MPI_Allgatherv", MPI_Allgatherv, MPI_Iallgatherv, bytes.data(), mine, type->handle(),
         result.bytes.data(), layout.counts.data(), layout.starts.data(), type->handle(), state_->comm());
  }
  return result;
}

Gathered Communicator::allToAll(std::span<const std::byte> bytes, std::span<const std::uint64_t> counts,
                                std::size_t elementBytes) const {
  assert(counts.size() == static_cast<std::size_t>(size()));
  assert(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}) * elementBytes == bytes.size());
  if (state_->serial()) return {{bytes.begin(), bytes.end()}, {0, bytes.size()}};
  state_->allToAll(counts, state_->sizes);
  Layout& out = state_->out;
  Layout& in = state_->in;
  out.set(counts);
  in.set(state_->sizes);
  std::optional<ElementType> type;
  Gathered result;
  together([&] {
    out.requireFits();
    in.requireFits();
    type.emplace(elementBytes);
    result = emptyGathered(in, elementBytes);
  });
  call("MPI_Alltoallv", MPI_Alltoallv, MPI_Ialltoallv, bytes.data(), out.counts.data(), out.starts.data(),
       type->handle(), result.bytes.data(), in.counts.data(), in.starts.data(), type->handle(),
       state_->comm());
  return result;
}

std::vector<std::uint64_t> Communicator::allGatherWords(std::span<const std::uint64_t> words) const {
  if (state_->serial()) return {words.begin(), words.end()};
  std::vector<std::uint64_t> all;
  together([&] { all.resize(words.size() * static_cast<std::size_t>(size())); });
  state_->allGather(words, all);
  return all;
}

void Communicator::allToAllWords(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) const {
  assert(to.size() % static_cast<std::size_t>(size()) == 0 && from.size() == to.size());
  if (state_->serial()) {
    std::copy(to.begin(), to.end(), from.begin());
  } else {
    state_->allToAll(to, from);
  }
}

void Communicator::agree(const std::exception_ptr& mine) const {
  if (state_->serial()) {
    if (mine) std::rethrow_exception(mine);
    return;
  }
  int firstFailing = mine ? rank() : size();
  call("MPI_Allreduce", MPI_Allreduce, MPI_Iallreduce, MPI_IN_PLACE, &firstFailing, 1, MPI_INT, MPI_MIN,
       state_->comm());
  if (firstFailing < size()) failTogether(mine, firstFailing);
}

void Communicator::failTogether(const std::exception_ptr& mine, int firstFailing) const {
  Text text{};
  if (rank() == firstFailing) text = describe(mine);
  call("MPI_Bcast", MPI_Bcast, MPI_Ibcast, text.data(), static_cast<int>(text.size()), MPI_CHAR, firstFailing,
       state_->comm());
  if (mine) std::rethrow_exception(mine);
  throw Error(ErrorCode::RemoteRank, fmt::format("rank {} failed: {}", firstFailing, text.data()));
}

void Communicator::together(FunctionRef<void()> work) const {
  agree(errorOf(work));
}

bool Communicator::anyTogether(FunctionRef<bool()> work) const {
  if (state_->serial()) return work();
  bool mine = false;
  const std::exception_ptr error = errorOf([&] { mine = work(); });
  std::array<int, 2> least{error ? rank() : size(), mine ? 0 : 1};
  call("MPI_Allreduce", MPI_Allreduce, MPI_Iallreduce, MPI_IN_PLACE, least.data(), 2, MPI_INT, MPI_MIN,
       state_->comm());
  if (least[0] < size()) failTogether(error, least[0]);
  return least[1] == 0;
}

std::vector<std::uint64_t> Communicator::gatherTogether(FunctionRef<std::uint64_t()> work) const {
  if (state_->serial()) return {work()};
  std::array<std::uint64_t, 2> mine{};
  std::vector<std::uint64_t> values;
  const std::exception_ptr error = errorOf([&] {
    values.resize(static_cast<std::size_t>(size()));
    mine[1] = work();
  });
  mine[0] = error ? 1 : 0;
  const std::span<std::uint64_t> all = state_->results;
  state_->allGather(mine, all);
  for (int r = 0; r < size(); ++r) {
    if (all[2 * static_cast<std::size_t>(r)] != 0) failTogether(error, r);
  }
  for (std::size_t r = 0; r < values.size(); ++r) values[r] = all[2 * r + 1];
  return values;
}

void Communicator::requireEqual(std::uint64_t fingerprint, const char* what) const {
  requireEqual([&] { return std::vector{Fingerprint{fingerprint, what}}; });
}

void Communicator::requireEqual(FunctionRef<std::vector<Fingerprint>()> work) const {
  // The maxima of x and ~x equal x and ~x on every rank only if all have the same x.
  std::vector<Fingerprint> fingerprints;
  std::vector<std::uint64_t> extremes;
  together([&] {
    fingerprints = work();
    for (const Fingerprint& print : fingerprints)
      extremes.insert(extremes.end(), {print.value, ~print.value});
  });
  allReduceMax(extremes);
  std::vector<const char*> different;
  for (std::size_t i = 0; i < fingerprints.size(); ++i) {
    if (extremes[2 * i] != ~extremes[2 * i + 1]) different.push_back(fingerprints[i].what);
  }
  if (different.empty()) return;
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("the ranks were given different values: {}", fmt::join(different, ", ")));
}

/// The MPI requests of messages under way.
struct Messages::State {
  std::uint64_t reserved = 0;
  std::vector<MPI_Request> requests;
};

namespace {

/// MPI counts in int: larger messages are split.
constexpr std::uint64_t largestMessage = 1ULL << 30;
constexpr int messageTag = 1;

}  // namespace

Messages::Messages(const Communicator& comm) : comm_(comm) {}

Messages::~Messages() {
  // The memory of a message under way must stay, even while an exception unwinds the stack.
  try {
    wait();
  } catch (const Error&) {  // this error can be handled no better than the exception that is unwinding
  }
}

void Messages::reserve(std::uint64_t bytes) {
  if (!state_) state_ = std::make_unique<State>();
  std::vector<MPI_Request>& requests = state_->requests;
  state_->reserved += (bytes + largestMessage - 1) / largestMessage;
  if (requests.capacity() < state_->reserved)
    requests.reserve(std::max<std::uint64_t>(state_->reserved, 2 * requests.capacity()));
}

void Messages::send(int to, std::span<const std::byte> bytes) {
  for (std::uint64_t done = 0; done < bytes.size(); done += largestMessage) {
    const auto count = static_cast<int>(std::min<std::uint64_t>(largestMessage, bytes.size() - done));
    assert(state_ && state_->requests.size() < state_->requests.capacity());
    state_->requests.push_back(MPI_REQUEST_NULL);
    callHere("MPI_Isend", [&] {
      return MPI_Isend(bytes.data() + done, count, MPI_BYTE, to, messageTag, comm_.state_->comm(),
                       &state_->requests.back());
    });
  }
}

void Messages::receive(int from, std::span<std::byte> bytes) {
  for (std::uint64_t done = 0; done < bytes.size(); done += largestMessage) {
    const auto count = static_cast<int>(std::min<std::uint64_t>(largestMessage, bytes.size() - done));
    assert(state_ && state_->requests.size() < state_->requests.capacity());
    state_->requests.push_back(MPI_REQUEST_NULL);
    callHere("MPI_Irecv", [&] {
      return MPI_Irecv(bytes.data() + done, count, MPI_BYTE, from, messageTag, comm_.state_->comm(),
                       &state_->requests.back());
    });
  }
}

void Messages::wait() {
  if (state_) waitForAll(state_->requests);
}

}  // namespace vdi::comm
