#include "catalyst_adaptor/isolated/process/Worker.h"

#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "catalyst_adaptor/Calls.h"
#include "catalyst_adaptor/EngineFunctions.h"
#include "catalyst_adaptor/isolated/Messages.h"
#include "catalyst_adaptor/isolated/SharedPages.h"
#include "catalyst_adaptor/isolated/StepData.h"
#include "catalyst_adaptor/isolated/StepSignals.h"
#include "catalyst_adaptor/vdi_catalyst.h"
#include "vdi/comm/Communicator.h"

namespace vdi::catalyst {

namespace {

/// Number of future steps for which scripts are asked in advance whether they want them.
constexpr std::int32_t stepsAhead = 1024;
constexpr std::size_t longestText = 16384;

/// The processes of all ranks, in the order of the simulation's ranks. The launcher may number them in
/// another one.
MPI_Comm inOrder(int rank) {
  MPI_Comm comm = MPI_COMM_NULL;
  MPI_Comm_split(MPI_COMM_WORLD, 0, rank, &comm);
  return comm;
}

std::uint64_t hashOf(std::span<const std::byte> bytes) {
  return std::hash<std::string_view>()({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Packs the descriptions of a rank's arrays for the other ranks' processes.
void pack(const std::vector<StepData::Array>& arrays, Packer& packer) {
  packer.put(std::uint64_t{arrays.size()});
  for (const StepData::Array& array : arrays) {
    packer.putText(array.name);
    packer.put(array.cells);
    packer.put(array.type);
    packer.put(array.components);
    packer.put(array.offset);
    packer.putAll(array.missing);
  }
}

std::vector<StepData::Array> unpackArrays(Unpacker unpacker) {
  std::vector<StepData::Array> arrays(unpacker.take<std::uint64_t>());
  for (StepData::Array& array : arrays) {
    array.name = unpacker.takeText();
    array.cells = unpacker.take<bool>();
    array.type = unpacker.take<std::int32_t>();
    array.components = unpacker.take<std::int32_t>();
    for (double& offset : array.offset) offset = unpacker.take<double>();
    array.missing = unpacker.takeAll<double>();
  }
  return arrays;
}

const pid_t self = getpid();

/// Does nothing in this process. In a child that a script forks, such as one of Python's multiprocessing, the
/// signal acts as usual.
extern "C" void disregard(int number) {
  if (getpid() == self) return;
  std::signal(number, SIG_DFL);
  raise(number);
}

/// Disregards the signals through a handler: programs that a script starts would inherit signals
/// that are ignored or blocked.
void disregardStepSignals() {
  struct sigaction action {};
  action.sa_handler = disregard;
  action.sa_flags = SA_RESTART;
  for (const int number : stepSignals) sigaction(number, &action, nullptr);
  const sigset_t unblocked = setOfStepSignals();
  sigprocmask(SIG_UNBLOCK, &unblocked, nullptr);
}

class Worker {
 public:
  Worker(Socket socket, const Setup& setup)
      : socket_(std::move(socket)),
        setup_(setup),
        comm_(inOrder(setup.rank)),
        ranks_(comm::Communicator::fromMpi(MPI_Comm_c2f(comm_))) {
    reading_.comm = comm_;
  }
  ~Worker() { MPI_Comm_free(&comm_); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  int run() {
    const int code = initialize();
    Packer started;
    started.put(Say::Started);
    started.put(std::int32_t{code});
    if (!socket_.send(started.bytes()) || code != VDI_CATALYST_OK) return 0;
    for (;;) {
      Socket::Received received = socket_.receive(std::chrono::milliseconds(-1));
      if (received.result == Socket::Result::Gone) return 1;  // the supervisor kills this process, too
      if (received.result == Socket::Result::Nothing) continue;
      Unpacker message(received.message);
      switch (message.take<Say>()) {
        case Say::LeftOut:
          logLeftOut(received);
          break;
        case Say::Step:
          step(message.take<StepNotice>(), received);
          break;
        case Say::Ask:
          tellWanted(message.take<std::int64_t>());
          break;
        case Say::Finish:
          finish();
          return 0;
        default:
          break;
      }
    }
  }

 private:
  int initialize() {
    const std::int32_t comm = MPI_Comm_c2f(comm_);
    if (setup_.isJson) {
      const char* text = setup_.hasText ? setup_.json.c_str() : nullptr;
      return vdi_catalyst_make_frames_of_json(comm, text, setup_.isGoingOn ? 1 : 0, &catalyst_);
    }
    std::vector<std::vector<const char*>> arguments;
    std::vector<vdi_catalyst_pipeline> pipelines;
    for (const Setup::Pipeline& script : setup_.scripts) {
      std::vector<const char*>& own = arguments.emplace_back();
      for (const std::string& argument : script.arguments) own.push_back(argument.c_str());
      pipelines.push_back({script.file.c_str(), static_cast<std::int32_t>(own.size()), own.data()});
    }
    return vdi_catalyst_make_frames_of_pipelines(comm, static_cast<std::int32_t>(pipelines.size()),
                                                 pipelines.data(), &catalyst_);
  }

  /// Notes the steps in the log, which lacks them if their pages can't be read: frames matter more.
  void logLeftOut(Socket::Received& received) {
    try {
      const SharedPages pages(descriptorOf(received));
      Unpacker unpacker(pages.bytes());
      for (const LeftOutSteps::Step& one : LeftOutSteps::unpack(unpacker).steps)
        vdi_catalyst_log_left_out(catalyst_, one.step, one.time);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "vdi_catalyst: some skipped steps could not be logged: %s\n", error.what());
    }
  }

  /// The descriptor that came with a message. Throws std::runtime_error if it got lost.
  static Descriptor descriptorOf(Socket::Received& received) {
    if (received.descriptors.empty())
      throw std::runtime_error("couldn't receive the simulation's memory: too many open files");
    return std::move(received.descriptors.front());
  }

  void step(const StepNotice& notice, Socket::Received& received) {
    Packer begun;
    begun.put(Say::Begun);
    begun.put(notice.step);
    (void)socket_.send(begun.bytes());
    StepData data;
    std::string error;
    // A rank without the step's data must not leave the others waiting for it in the calls that follow.
    int code = guardedTogether(
        reading_, VDI_CATALYST_SCRIPT,
        [&] {
          ranks_.together([&] { data = dataOf(notice, received); });
          addMissingArrays(data);
          requireSameParticles(data);
        },
        notice.step);
    if (code != VDI_CATALYST_OK) {
      data = {};  // parameters stay unchanged on all ranks
      error = reading_.error.substr(0, longestText);
    } else {
      reading_.printed.clear();
      code = take(data);
      if (code == VDI_CATALYST_OK) {
        vdi_catalyst_set_clock(catalyst_, notice.clock);
        code = vdi_catalyst_execute(catalyst_, notice.step, notice.time);
      }
      if (code != VDI_CATALYST_OK) error = errorText();
    }
    Packer done;
    done.put(Say::Done);
    done.put(notice.step);
    done.put(std::int32_t{code});
    done.putText(error);
    done.put(std::uint64_t{data.parameters.size()});
    for (const Parameter& parameter : data.parameters) done.put(inForceNow(parameter));
    (void)socket_.send(done.bytes());
    if (!setup_.isJson) tellWanted(notice.step + 1);
  }

  /// The step in the notice's buffer. Throws if this process can't map the buffer, or if the step
  /// is damaged.
  StepData dataOf(const StepNotice& notice, Socket::Received& received) {
    SharedPages& buffer = buffers_.at(notice.buffer);
    if (notice.isNewBuffer) {
      buffer = SharedPages();  // first, so that no later step is read from an earlier step's pages
      buffer = SharedPages(descriptorOf(received));
    }
    return StepData::read(buffer.bytes());
  }

  /// Collective: adds the arrays that only other ranks have, without values. Ranks of the simulation may have
  /// different ones, but processes hand arrays over together. Throws on all ranks.
  void addMissingArrays(StepData& data) const {
    Packer own;
    std::array<std::uint64_t, 2> extremes{};
    ranks_.together([&] {
      pack(data.arrays, own);
      extremes = {hashOf(own.bytes()), ~hashOf(own.bytes())};
    });
    ranks_.allReduceMax(extremes);
    if (extremes[0] == ~extremes[1]) return;
    const comm::Gathered all = ranks_.allGather(own.bytes(), 1);
    ranks_.together([&] {
      for (int rank = 0; rank < ranks_.size(); ++rank) {
        for (StepData::Array& array : unpackArrays(Unpacker(all.of(rank)))) {
          const auto isSame = [&](const StepData::Array& other) {
            return other.name == array.name && other.cells == array.cells;
          };
          if (std::ranges::any_of(data.arrays, isSame)) continue;
          array.blocks.resize(data.blocks.size());
          data.arrays.push_back(std::move(array));
        }
      }
    });
  }

  /// Collective: throws on all ranks if they have particles of different names or kinds, which are deposited
  /// together.
  void requireSameParticles(const StepData& data) const {
    ranks_.requireEqual([&] {
      Packer names;
      for (const StepData::Particles& particles : data.particles) {
        names.putText(particles.name);
        names.put(particles.given.kind);
        names.put(particles.given.periodic);
      }
      return std::vector{comm::Communicator::Fingerprint{hashOf(names.bytes()), "the names of particles"}};
    });
  }

  /// Gives the engine the step's blocks, values and parameters.
  int take(const StepData& data) {
    int code = VDI_CATALYST_OK;
    if (version_ != data.version) {
      code = vdi_catalyst_set_blocks(catalyst_, static_cast<std::int32_t>(data.blocks.size()),
                                     data.blocks.data());
      if (code != VDI_CATALYST_OK) return code;
      version_ = data.version;
    }
    for (const StepData::Array& array : data.arrays) {
      const std::vector<vdi_catalyst_strides> strides = stridesOf(data.blocks, array);
      const int association = array.cells ? VDI_CATALYST_CELLS : VDI_CATALYST_POINTS;
      code = vdi_catalyst_set_array_strided(catalyst_, array.name.c_str(), array.type, association,
                                            array.components, array.blocks.data(), strides.data());
      if (code == VDI_CATALYST_OK) code = placeArray(array, association);
      if (code != VDI_CATALYST_OK) return code;
    }
    for (const StepData::Particles& particles : data.particles) {
      code = vdi_catalyst_set_particles(catalyst_, particles.name.c_str(), &particles.given);
      if (code == VDI_CATALYST_OK) code = placeArray(particles, VDI_CATALYST_CELLS);
      if (code != VDI_CATALYST_OK) return code;
    }
    for (const Parameter& parameter : data.parameters) (void)inForceNow(parameter);
    return code;
  }

  /// Gives the engine the offset and the missing values of an array, or of the one that particles become.
  template <typename Array>
  int placeArray(const Array& array, int association) {
    const int code = vdi_catalyst_set_array_offset(catalyst_, array.name.c_str(), association, array.offset);
    if (code != VDI_CATALYST_OK) return code;
    return vdi_catalyst_set_array_missing(catalyst_, array.name.c_str(), association,
                                          static_cast<std::int32_t>(array.missing.size()),
                                          array.missing.data());
  }

  /// The layout of values in order.
  static std::vector<vdi_catalyst_strides> stridesOf(const std::vector<vdi_catalyst_block>& blocks,
                                                     const StepData::Array& array) {
    constexpr std::array<std::int64_t, 10> bytes{1, 1, 2, 2, 4, 4, 4, 8, 8, 8};  // by type
    const std::int64_t scalar = bytes.at(static_cast<std::size_t>(array.type));
    std::vector<vdi_catalyst_strides> all;
    for (const vdi_catalyst_block& block : blocks) {
      vdi_catalyst_strides strides{};
      strides.component_stride = scalar;
      std::int64_t next = scalar * array.components;
      for (int axis = 0; axis < 3; ++axis) {
        strides.strides[axis] = next;
        next *= block.cells[axis] + (array.cells ? 0 : 1);
      }
      all.push_back(strides);
    }
    return all;
  }

  /// The parameter's value in force. The first call declares the parameter with the simulation's value.
  double inForceNow(const Parameter& parameter) {
    const auto whole = [](double number) { return static_cast<std::int64_t>(number); };
    if (parameter.isWhole) {
      return static_cast<double>(vdi_catalyst_parameter_i64(catalyst_, parameter.name.c_str(),
                                                            whole(parameter.value), whole(parameter.low),
                                                            whole(parameter.high)));
    }
    return vdi_catalyst_parameter_f64(catalyst_, parameter.name.c_str(), parameter.value, parameter.low,
                                      parameter.high);
  }

  void tellWanted(std::int64_t first) {
    Packer message;
    message.put(Say::Wanted);
    message.put(first);
    message.put(std::uint64_t{stepsAhead});
    std::array<std::uint8_t, stepsAhead> wanted{};
    vdi_catalyst_wanted_steps(catalyst_, first, stepsAhead, wanted.data());
    for (const std::uint8_t each : wanted) message.put(each);
    (void)socket_.send(message.bytes());
  }

  void finish() {
    const std::string before = errorText();
    const int code = vdi_catalyst_finalize(catalyst_);
    catalyst_ = nullptr;
    Packer finished;
    finished.put(Say::Finished);
    finished.put(std::int32_t{code});
    finished.putText(code == VDI_CATALYST_OK ? "" : before);
    (void)socket_.send(finished.bytes());
  }

  std::string errorText() const { return std::string(vdi_catalyst_error(catalyst_)).substr(0, longestText); }

  Socket socket_;
  const Setup& setup_;
  MPI_Comm comm_;
  const comm::Communicator ranks_;
  Calls reading_;  // reports steps whose data can't be read
  vdi_catalyst* catalyst_ = nullptr;
  std::array<SharedPages, 2> buffers_;
  std::optional<std::uint64_t> version_;  // the version of the engine's blocks
};

}  // namespace

int work(Socket socket, Descriptor setup) {
  disregardStepSignals();
  const SharedPages pages(std::move(setup));
  Unpacker unpacker(pages.bytes());
  const Setup run = Setup::unpack(unpacker);
  int provided = 0;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS) return 1;
  int status = 0;
  {
    Worker worker(std::move(socket), run);
    status = worker.run();
  }
  MPI_Finalize();
  return status;
}

}  // namespace vdi::catalyst
