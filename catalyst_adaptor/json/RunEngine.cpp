#include "catalyst_adaptor/json/RunEngine.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "catalyst_adaptor/Deposits.h"
#include "catalyst_adaptor/json/Measure.h"
#include "catalyst_adaptor/json/RunSteering.h"
#include "vdi/comm/Communicator.h"
#include "vdi/config/Schedule.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/SamplingRate.h"
#include "vdi/core/UnitDistance.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/DeviceRequest.h"
#include "vdi/io/Cinema.h"
#include "vdi/io/Files.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/page/Page.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/runlog/RunLog.h"
#include "vdi/stream/LiveStream.h"

namespace vdi::catalyst {

namespace {

void makeFolderOf(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) throw Error(ErrorCode::Io, "can't make the folder: " + error.message(), folder.string());
}

stream::LiveOptions liveOptionsOf(const config::RunStream& run) {
  return {.host = run.host,
          .port = run.port,
          .tokenFile = run.tokenFile,
          .linkFile = run.linkFile,
          .certificate = run.certificate,
          .key = run.key,
          .origins = run.origins,
          .originOption = R"("origins": ["{}"] in "stream")",
          .embedders = run.embedIn,
          .megabits = run.megabits,
          .isSteered = run.steer,
          .page = page::emptyPage(run.title),
          .programName = "vdi_catalyst"};
}

/// The paths of the run's log.
runlog::LogFiles logFilesOf(const config::RunLogFiles& names) {
  runlog::LogFiles files;
  if (!names.json.empty()) files.json = names.json;
  if (!names.text.empty()) files.text = names.text;
  return files;
}

/// The text of a failure; empty if it is another rank's.
std::string textOf(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const Error& error) {
    return error.code() == ErrorCode::RemoteRank ? "" : error.what();
  } catch (const std::bad_alloc&) {
    return "out of memory on this host";
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// The resident memory, shared memory included.
config::HostMemoryBound::Use memoryOfThisProcess() {
  const char* const path = "/proc/self/status";
  config::HostMemoryBound::Use use;
  std::ifstream file(path);
  constexpr std::uint64_t kibibyte = 1024;
  for (std::string name; file >> name;) {
    std::uint64_t* const bytes = name == "VmRSS:" ? &use.now : name == "VmHWM:" ? &use.peak : nullptr;
    std::uint64_t kibibytes = 0;
    if (bytes != nullptr && file >> kibibytes) *bytes = kibibytes * kibibyte;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  if (use.now == 0) throw Error(ErrorCode::Io, "can't read the process's memory", path);
  return use;
}

std::vector<const config::FilePattern*> patternsOf(const config::Run& run) {
  std::vector<const config::FilePattern*> patterns;
  if (run.vdi) patterns.push_back(&*run.vdi);
  if (run.png) patterns.push_back(&*run.png);
  if (run.cinema) patterns.push_back(&run.cinema->pictures);
  return patterns;
}

}  // namespace

/// A field from a camera.
struct RunEngine::Shown {
  const config::RunField& field;
  const config::RunCamera& camera;
  runlog::FrameRecord recordOf(std::int64_t step, double time) const {
    runlog::FrameRecord record;
    record.step = step;
    record.time = time;
    record.field = field.name;
    record.camera = camera.name;
    return record;
  }
};

/// The data of a step's field that its cameras share.
struct RunEngine::LoadedFrame {
  const config::RunField* field = nullptr;
  std::int64_t step = 0;
  double time = 0.0;
  double unitDistance = 1.0;
  ScalarRange range;    // the opacities' range, unless the run has one
  ScalarRange colored;  // the colours'
  vdi::TimeStamp stamp;
};

struct RunEngine::State {
  State(int handle, comm::Communicator own, const config::Run& run)
      : fortranCommunicator(handle),
        comm(std::move(own)),
        mostDeviceBytes(static_cast<std::uint64_t>(run.maxDeviceMiB.value_or(0)) << 20),
        schedule(run),
        wallTimeShare(run.maxShare),
        hostMemory(run.maxHostMiB),
        fields(run.fields.size()) {
    if (run.when) measure.emplace(*run.when);
  }

  /// What a field keeps from frame to frame.
  struct FieldState {
    std::optional<ScalarRange> firstRange;    // the opacities' range, unless the field has one
    std::optional<ScalarRange> firstColored;  // the colours'
    std::optional<double> firstUnitDistance;  // the opacities', unless the field has one
    TransferFunction lastFunction;            // of the last frame, and what it has lost
    std::string lastLoss;
    std::exception_ptr failure;  // of the step
  };

  /// Collective: makes the device and the objects that need one. After a failure, no rank has them.
  void start() {
    generator.reset();
    std::unique_ptr<Deposits> fresh;
    comm.together([&] {
      gpu::DeviceRequest request = gpu::requestFromEnvironment(comm.localRank());
      request.mostBytes = mostDeviceBytes;
      device = gpu::Device::create(request);
      fresh = std::make_unique<Deposits>(device, comm);
      if (deposits) fresh->continueTelling(*deposits);
    });
    const GeneratorOptions options = generatorOptionsFromEnvironment(comm);
    generator.emplace(device, comm::Communicator::fromMpi(fortranCommunicator), options);
    deposits = std::move(fresh);
  }
  bool isRoot() const { return comm.rank() == 0; }
  FieldState& of(const config::Run& run, const config::RunField& field) {
    return fields[static_cast<std::size_t>(&field - run.fields.data())];
  }
  /// Collective: the root's answer on all ranks.
  bool asRootSays(bool answer) const { return comm.broadcast(answer ? 1.0 : 0.0, 0) != 0.0; }
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - begin).count(); }

  int fortranCommunicator;
  comm::Communicator comm;
  std::uint64_t mostDeviceBytes;  // 0: as many as the driver allows
  Clock::time_point begin = Clock::now();
  std::shared_ptr<gpu::Device> device;
  std::optional<VdiGenerator> generator;
  std::unique_ptr<Deposits> deposits;
  config::Schedule schedule;
  config::WallTimeShare wallTimeShare;
  config::HostMemoryBound hostMemory;
  std::optional<Measure> measure;
  std::optional<double> meanNow;               // the mean that decided on this step
  std::optional<double> meanOfLast;            // the mean at the last frame
  std::unique_ptr<runlog::RunLog> log;         // the root's
  std::unique_ptr<stream::LiveStream> stream;  // the root's
  std::unique_ptr<io::CinemaIndex> cinema;     // the root's
  std::optional<RunSteering> steering;
  std::vector<FieldState> fields;    // as the run's
  std::optional<LoadedFrame> frame;  // the frame whose values the device has
  bool isAskedFor = false;           // a viewer waits for a view, which the next step shows
  bool hasToldOfShare = false;
  bool hasToldOfMemory = false;
  std::optional<double> clock;  // the schedule's time in seconds, given for the next step
};

RunEngine::RunEngine(int fortranCommunicator, comm::Communicator comm, config::Run run)
    : run_(std::move(run)), state_(std::make_unique<State>(fortranCommunicator, std::move(comm), run_)) {}

RunEngine::~RunEngine() = default;

void RunEngine::start(bool isIsolated) {
  state_->start();
  open(isIsolated);
}

/// Opens the root's files and stream.
void RunEngine::open(bool isIsolated) {
  State& state = *state_;
  const bool isAnew = run_.existing == config::Existing::Overwrite;
  state.comm.together([&] {
    if (!state.isRoot()) return;
    const config::RunField& first = run_.fields.front();
    if (run_.cinema) {
      state.cinema = std::make_unique<io::CinemaIndex>(run_.cinema->folder, !isAnew, !first.name.empty());
    }
    if (run_.stream) state.stream = std::make_unique<stream::LiveStream>(liveOptionsOf(*run_.stream));
    if (run_.stream && run_.fields.size() > 1) {
      fmt::print(stderr, "vdi_catalyst: the stream shows the first field, '{}'; all {} have files\n",
                 first.name, run_.fields.size());
    }
    // The log comes last, because a start that fails leaves no line in it, and doesn't empty it.
    if (run_.log.any()) {
      runlog::RunStart start{{}, state.comm.size(), std::time(nullptr), isIsolated};
      for (const config::RunField& field : run_.fields)
        start.fields.push_back(field.name.empty() ? field.array : field.name);
      using Before = runlog::RunLog::Before;
      state.log = std::make_unique<runlog::RunLog>(logFilesOf(run_.log), start,
                                                   isAnew ? Before::Goes : Before::Stays);
    }
  });
  if (run_.stream && run_.stream->steer) state.steering.emplace(state.comm, state.stream.get());
}

bool RunEngine::wants(std::int64_t step, double time) const {
  if (step < 0 || !mayExecute(step, time)) return false;
  if (state_->steering) return true;
  if (state_->schedule.needsRoot() && !state_->isRoot()) return false;
  return state_->schedule.isDue(step, time, state_->elapsed());
}

bool RunEngine::mayExecute(std::int64_t step, double time) const {
  return state_->steering || state_->schedule.needsRoot() || state_->schedule.isDue(step, time, 0.0);
}

bool RunEngine::isDue(std::int64_t step, double time) {
  State& state = *state_;
  const double now = state.clock.value_or(state.elapsed());
  bool due = state.schedule.isDue(step, time, now);
  if (state.schedule.needsRoot()) due = state.asRootSays(due);
  if (due) state.schedule.begin(time, now);
  return due;
}

/// Makes the array of that name if it is one of particles and this step doesn't have it yet. Collective.
void RunEngine::deposit(Fields& fields, const std::string& name, std::int64_t step) {
  if (fields.particlesOf(name) != nullptr && !fields.hasDeposit(name))
    state_->deposits->make(fields, name, step);
}

/// Whether the condition, the share of wall time and the bound of memory let a due frame be made. Collective.
bool RunEngine::shouldRender(Fields& fields, std::int64_t step, double time) {
  State& state = *state_;
  if (state.measure) {
    const config::RunCondition& condition = state.measure->condition();
    tryTwice([&] { deposit(fields, condition.field, step); });
    const std::optional<double> value = state.measure->of(state.comm, fields);
    bool holds = value.has_value();
    if (condition.measure == config::RunCondition::Measure::Change) {
      holds = value && (!state.meanOfLast || condition.holds(std::abs(*value - *state.meanOfLast)));
      state.meanNow = value;
    } else if (value) {
      holds = condition.holds(*value);
    }
    // The ranks' sums may differ in their last bits.
    if (!state.asRootSays(holds)) return false;
  }
  return hasWallTime(step, time) && hasHostMemory(step, time);
}

/// Leaves the step out if its frame could exceed the share of wall time. Collective.
bool RunEngine::hasWallTime(std::int64_t step, double time) {
  State& state = *state_;
  const config::WallTimeShare& share = state.wallTimeShare;
  if (!share.isLimited() || state.asRootSays(share.hasRoom(state.elapsed()))) return true;
  leaveOut(step, time, state.hasToldOfShare, [&] {
    constexpr double percent = 100.0;
    return fmt::format("frames have taken {:.3g} s of {:.3g} s, \"max_share\" is {:g} %", share.spent(),
                       state.elapsed(), percent * share.share());
  });
  return false;
}

/// Leaves the step out if its frame could exceed the bound of a process's memory on any rank. In
/// that case, frees the memory of earlier frames for the simulation. Collective.
bool RunEngine::hasHostMemory(std::int64_t step, double time) {
  State& state = *state_;
  if (!state.hostMemory.isSet()) return true;
  config::HostMemoryBound::Use before;
  std::array<double, 1> most{};
  state.comm.together([&] {
    before = memoryOfThisProcess();
    most[0] = static_cast<double>(state.hostMemory.needed(before));
  });
  state.comm.allReduceMax(most);
  const auto needed = static_cast<std::uint64_t>(most[0]);
  if (state.hostMemory.hasRoom(needed)) return true;
  state.generator.reset();  // the next frame makes another one
  state.comm.together([&] { state.hostMemory.free(before, memoryOfThisProcess()); });
  leaveOut(step, time, state.hasToldOfMemory, [&] {
    return fmt::format("a process would need {} MiB of memory, \"max_host_mib\" is {}", needed >> 20U,
                       state.hostMemory.mebibytes());
  });
  return false;
}

void RunEngine::setClock(double seconds) {
  state_->clock = seconds;
}

/// Logs a step that is left out. Rank 0 prints the first one for each kind of cause.
void RunEngine::leaveOut(std::int64_t step, double time, bool& hasTold,
                         FunctionRef<std::string()> causeText) {
  State& state = *state_;
  state.comm.together([&] {
    if (!state.isRoot()) return;
    const std::string cause = causeText();
    if (!std::exchange(hasTold, true)) {
      fmt::print(stderr, "vdi_catalyst: step {}: left out: {}; {}\n", step, cause,
                 state.log ? "the log has all such steps" : "further such steps aren't reported");
    }
    if (state.log) state.log->add(runlog::LeftOut{step, time, cause});
  });
}

void RunEngine::logLeftOut(std::int64_t step, double time) noexcept {
  if (!state_->log) return;
  try {
    state_->log->addNotHandedOver(step, time);
  } catch (const std::exception& error) {  // the other ranks don't know of it, and no step fails
    std::fprintf(stderr, "vdi_catalyst: step %lld: %s\n", static_cast<long long>(step), error.what());
  }
}

void RunEngine::execute(Fields& fields, Parameters& parameters, std::int64_t step, double time,
                        double waited) {
  State& state = *state_;
  state.frame.reset();  // the values may have changed
  fields.dropDeposits();
  if (run_.everyTime) time = state.comm.broadcast(time, 0);  // ranks' times may differ
  std::exception_ptr failure;
  bool isMade = false;
  try {
    if (isDue(step, time)) {
      isMade = shouldRender(fields, step, time);
      if (isMade) makeAll(fields, step, time, waited, true);
    }
    if (!isMade && state.isAskedFor) makeAll(fields, step, time, waited, false);
  } catch (...) {
    failure = std::current_exception();
  }
  state.isAskedFor = false;
  if (state.steering) steer(fields, parameters, step, time);
  fields.dropDeposits();
  if (failure) std::rethrow_exception(failure);
  if (state.steering) state.steering->requireLogged();
}

/// Makes the frames of all fields and cameras, or only that of the first ones if it is for the stream.
void RunEngine::makeAll(Fields& fields, std::int64_t step, double time, double waited, bool isForFiles) {
  State& state = *state_;
  const auto begin = Clock::now();
  config::HostMemoryBound::Use before;
  if (state.hostMemory.isSet()) state.comm.together([&] { before = memoryOfThisProcess(); });
  std::vector<double> waits;
  if (run_.log.any()) waits = millisecondsOfRanks(waited);
  bool hasFailed = false;
  for (std::size_t i = 0; i < run_.fields.size(); ++i) {
    std::exception_ptr& first = state.fields[i].failure;
    first = nullptr;
    for (const config::RunCamera& camera : run_.cameras) {
      const auto start = Clock::now();
      const Shown shown{run_.fields[i], camera};
      runlog::FrameRecord frame;
      std::exception_ptr failure;
      try {
        makeOne(fields, step, time, shown, isForFiles, frame);
      } catch (const std::exception&) {  // thrown on all ranks, but not the same exception on each
        failure = std::current_exception();
      }
      try {
        const auto failed = [&](const char* error) {
          frame = shown.recordOf(step, time);
          frame.error = error;
        };
        record(frame, failure, failed, waits, start);
      } catch (...) {
        failure = std::current_exception();
      }
      waits.clear();
      if (!first) first = failure;
      if (!state.frame || !isForFiles) break;  // other cameras would fail, too
    }
    hasFailed = hasFailed || first;
    if (!isForFiles) break;
  }
  state.wallTimeShare.spend(std::chrono::duration<double>(Clock::now() - begin).count());
  if (state.hostMemory.isSet())
    state.comm.together([&] { state.hostMemory.spend(before, memoryOfThisProcess()); });
  if (isForFiles && !hasFailed) state.meanOfLast = state.meanNow;
  try {
    state.comm.together([&] {
      if (state.cinema && isForFiles) state.cinema->write();
    });
  } catch (...) {
    if (!hasFailed) throw;
  }
  throwFailures();
}

/// Throws the step's failures, of which several fields have one each. If a field has failed, it has on all
/// ranks.
void RunEngine::throwFailures() {
  std::exception_ptr first;
  std::string text;
  for (std::size_t i = 0; i < run_.fields.size(); ++i) {
    const std::exception_ptr failure = std::exchange(state_->fields[i].failure, nullptr);
    if (!failure) continue;
    if (!first) first = failure;
    const std::string own = textOf(failure);
    if (!own.empty())
      text += fmt::format("{}field '{}': {}", text.empty() ? "" : "; ", run_.fields[i].name, own);
  }
  if (!text.empty() && run_.fields.size() > 1) throw std::runtime_error(text);
  if (first) std::rethrow_exception(first);
}

/// Logs a frame. Collective if the run has a log. Rethrows `failure`, or throws the log's error. `failed`
/// turns the record into one of a failed frame.
void RunEngine::record(runlog::FrameRecord& frame, const std::exception_ptr& failure,
                       FunctionRef<void(const char* error)> failed, const std::vector<double>& waits,
                       Clock::time_point start) {
  if (!run_.log.any()) {
    if (failure) std::rethrow_exception(failure);
    return;
  }
  state_->comm.together([&] {
    if (failure && !state_->log) std::rethrow_exception(failure);
    if (!state_->log) return;
    try {
      if (failure) std::rethrow_exception(failure);
    } catch (const std::exception& error) {
      failed(error.what());
    }
    const std::chrono::duration<double, std::milli> spent = Clock::now() - start;
    frame.milliseconds = (waits.empty() ? 0.0 : waits.front()) + spent.count();
    if (!failure && !waits.empty()) frame.stages.insert(frame.stages.begin(), runlog::stageOf("wait", waits));
    if (state_->stream) frame.dropped = state_->stream->dropped();
    try {
      state_->log->add(frame);
    } catch (const std::exception& error) {
      if (!failure) throw;
      fmt::print(stderr, "vdi_catalyst: step {}: {}\n", frame.step, error.what());
    }
    if (failure) std::rethrow_exception(failure);
  });
}

/// Takes the viewers' requests. While they pause the simulation, makes a VDI for each view that they ask for.
void RunEngine::steer(Fields& fields, Parameters& parameters, std::int64_t step, double time) {
  State& state = *state_;
  const Steered steered{run_, state.schedule, state.fields.front().firstColored, parameters};
  const Shown shown{run_.fields.front(), run_.cameras.front()};
  while (state.steering->take(steered, step, time)) {
    state.isAskedFor = true;
    if (!state.steering->isPaused()) return;
    try {
      runlog::FrameRecord none = shown.recordOf(step, time);
      makeOne(fields, step, time, shown, false, none);
      state.isAskedFor = false;
    } catch (const std::exception& error) {  // the viewer may ask for something else
      if (state.isRoot()) fmt::print(stderr, "vdi_catalyst: step {}: {}\n", step, error.what());
    }
  }
}

void RunEngine::finish() {
  state_->comm.together([&] {
    if (!state_->log) return;
    fmt::print(stderr, "vdi_catalyst: {}\n", runlog::textLine(state_->log->finish()));
  });
}

/// Collective: returns each rank's time in milliseconds on the root, and nothing on other ranks.
std::vector<double> RunEngine::millisecondsOfRanks(double seconds) const {
  const double milliseconds = 1e3 * seconds;
  const comm::Gathered all =
      state_->comm.gather(std::as_bytes(std::span(&milliseconds, 1)), sizeof milliseconds, 0);
  std::vector<double> ranks;
  state_->comm.together([&] {
    ranks.resize(all.bytes.size() / sizeof milliseconds);
    if (!ranks.empty()) std::memcpy(ranks.data(), all.bytes.data(), all.bytes.size());
  });
  return ranks;
}

/// Runs `work`, and runs it once more with another device if the first one was lost.
template <typename Work>
void RunEngine::tryTwice(Work work) {
  // An earlier frame lost its device, and no other could be opened then.
  if (!state_->generator) state_->start();
  std::exception_ptr failure;
  try {
    work();
  } catch (...) {  // thrown on all ranks, but not the same exception on each
    failure = std::current_exception();
  }
  if (!failure) return;
  if (!state_->comm.anyTogether([&] { return state_->device->isLost(); })) std::rethrow_exception(failure);
  state_->frame.reset();
  state_->start();
  work();
}

void RunEngine::makeOne(Fields& fields, std::int64_t step, double time, const Shown& shown, bool isForFiles,
                        runlog::FrameRecord& record) {
  try {
    tryTwice([&] {
      state_->comm.together([&] { record = shown.recordOf(step, time); });
      if (!state_->frame || state_->frame->field != &shown.field) prepare(fields, step, time, shown.field);
      deliver(shown, isForFiles, record);
    });
  } catch (const Error& error) {  // thrown on all ranks
    if (error.code() != ErrorCode::OutOfMemory || !run_.maxDeviceMiB) throw;
    throw Error(error.code(), fmt::format("{}; \"max_device_mib\" is {}", error.what(), *run_.maxDeviceMiB));
  }
}

/// Whether the stream shows it.
bool RunEngine::isFirst(const Shown& shown) const {
  return &shown.field == run_.fields.data() && &shown.camera == run_.cameras.data();
}

/// Gives the device the step's values of a field.
void RunEngine::prepare(Fields& fields, std::int64_t step, double time, const config::RunField& field) {
  State& state = *state_;
  const comm::Communicator& comm = state.comm;
  State::FieldState& own = state.of(run_, field);
  state.frame.reset();
  const bool cells = agreeOnCells(comm, fields, field.array, field.cells);
  if (cells) deposit(fields, field.array, step);
  std::vector<Block> blocks;
  std::array<double, 2> largest{};  // the most values per unit of volume, and the most components
  comm.together([&] {
    fields.fetch(field.array, cells);
    blocks = fields.blocksOf(field.array, cells, field.component, field.missing);
    for (Block& block : blocks) {
      largest[0] = std::max(largest[0], 1.0 / (block.spacing.x * block.spacing.y * block.spacing.z));
      block.nearest = field.interpolation == Interpolation::Nearest;
    }
    largest[1] = static_cast<double>(fields.componentsOf(field.array, cells));
  });
  comm.allReduceMax(largest);

  VdiGenerator& generator = *state.generator;
  generator.setBlocks(std::move(blocks));
  const ScalarRange range = generator.scalarRange();
  if (!own.firstRange && range.min < range.max) {
    own.firstRange = range;
    comm.together([&] { noteRange(field, range); });
  }
  const double voxelVolume = largest[0] > 0.0 ? 1.0 / largest[0] : 0.0;
  const int components = static_cast<int>(largest[1]);
  LoadedFrame frame;
  frame.field = &field;
  frame.step = step;
  frame.time = time;
  frame.range = own.firstRange.value_or(range);
  const ScalarRange& colored = generator.coloredRange();
  if (!own.firstColored && colored.min < colored.max) own.firstColored = colored;
  frame.colored = own.firstColored.value_or(colored);
  // The unit distance stays the first frame's, or opacities would jump where levels of refinement come and
  // go.
  const double unitDistance = unitDistanceOf(generator.scene().bounds, voxelVolume);
  if (!own.firstUnitDistance && voxelVolume > 0.0) own.firstUnitDistance = unitDistance;
  frame.unitDistance = own.firstUnitDistance.value_or(unitDistance);
  comm.together([&] {
    frame.stamp = {time,
                   static_cast<std::uint64_t>(step),
                   {.name = field.array,
                    .cells = cells,
                    .components = components,
                    .component = components > 1 ? legendComponent(field.component, components) : 0}};
  });
  state.frame = std::move(frame);
}

/// Says that the first frame's range, by which all frames are coloured, is much wider than its values.
void RunEngine::noteRange(const config::RunField& field, const ScalarRange& range) const {
  if (field.colors.range || !state_->isRoot()) return;
  if (const std::optional<ScalarRange> part = state_->generator->crowdedPart()) {
    std::fprintf(stderr, "vdi_catalyst: field '%s': %s (\"range\" of \"colors\", \"missing\")\n",
                 field.array.c_str(), describeCrowded(range, *part).c_str());
  }
}

void RunEngine::deliver(const Shown& shown, bool isForFiles, runlog::FrameRecord& record) {
  State& state = *state_;
  const config::RunField& field = shown.field;
  const config::RunCamera& camera = shown.camera;
  State::FieldState& own = state.of(run_, field);
  VdiGenerator& generator = *state.generator;
  const LoadedFrame& frame = *state.frame;
  const bool isRoot = state.isRoot();
  Camera from;
  TransferFunction function;
  std::filesystem::path file;  // the VDI's path; empty without a VDI
  state.comm.together([&] {
    if (isForFiles && run_.vdi) file = run_.vdi->path(frame.step, camera.name, field.name);
    from = run_.cameraAt(camera, frame.step, frame.time, generator.scene().bounds);
    function = field.colors.transferFunction(frame.range, frame.unitDistance);
    if (frame.colored != frame.range)
      function.colors = field.colors.transferFunction(frame.colored, frame.unitDistance).colors;
    if (!isRoot) return;
    if (function != own.lastFunction) {
      own.lastFunction = function;
      const std::string loss = describeLoss(function);
      if (!loss.empty() && loss != own.lastLoss)
        std::fprintf(stderr, "vdi_catalyst: field '%s': %s\n", field.array.c_str(), loss.c_str());
      own.lastLoss = loss;
    }
    if (!isForFiles) return;
    for (const config::FilePattern* pattern : patternsOf(run_))
      makeFolderOf(pattern->path(frame.step, camera.name, field.name));
  });
  const GenerateSettings settings = run_.settingsOf(field);
  if (isForFiles && !run_.makesPictures() && !(run_.stream && isFirst(shown))) {
    if (!run_.vdi) return;
    // The ranks write the file together, so that no rank ever has the whole VDI.
    generator.write(file, from, function, settings, frame.stamp);
    state.comm.together([&] {
      if (!isRoot) return;
      runlog::setReports(record, generator.reports());
      record.files.push_back(file.string());
      noteLatest(shown);
    });
    return;
  }
  std::optional<Vdi> made = generator.generate(from, function, settings);
  state.comm.together([&] {
    if (!made) return;
    made->time = frame.stamp.time;
    made->timeStep = frame.stamp.step;
    made->coloring->array = frame.stamp.array;
    save(std::move(*made), shown, isForFiles, record);
  });
}

/// Saves and streams the VDI on the root, which has it. The time that it takes counts as output.
void RunEngine::save(Vdi vdi, const Shown& shown, bool isForFiles, runlog::FrameRecord& record) {
  const auto start = Clock::now();
  std::vector<RankReport> reports = state_->generator->reports();
  if (isForFiles) {
    if (run_.vdi) {
      const std::filesystem::path file = run_.vdi->path(record.step, shown.camera.name, shown.field.name);
      io::writeVdi(file, vdi);
      record.files.push_back(file.string());
    }
    if (run_.makesPictures()) writePictures(vdi, shown, record);
    noteLatest(shown);
  }
  if (state_->stream && isFirst(shown)) {
    state_->stream->publish(std::make_shared<const Vdi>(std::move(vdi)));
    state_->stream->requireSent();
  }
  for (const std::string& file : record.files) runlog::countFile(reports.front(), file);
  reports.front().outputSeconds += std::chrono::duration<double>(Clock::now() - start).count();
  runlog::setReports(record, reports);
}

/// Writes the pictures. Called on the root.
void RunEngine::writePictures(const Vdi& vdi, const Shown& shown, runlog::FrameRecord& record) {
  const config::RunField& field = shown.field;
  const config::RunCamera& camera = shown.camera;
  const auto picture = io::toPicture(flatten(vdi));
  if (run_.png) {
    const std::filesystem::path file = run_.png->path(record.step, camera.name, field.name);
    io::writePng(file, picture);
    record.files.push_back(file.string());
  }
  if (!run_.cinema || camera.fixed) return;  // a viewer's viewpoint isn't on the orbit
  const std::filesystem::path file = run_.cinema->pictures.path(record.step, camera.name, field.name);
  io::writePng(file, picture);
  record.files.push_back(file.string());
  const config::Orbit place = run_.orbitAt(*camera.orbit, record.step, record.time);
  state_->cinema->add({record.time, place.azimuth, place.elevation,
                       file.lexically_relative(run_.cinema->folder).generic_string(), field.name});
}

/// Links the names of the latest files to the step's files. Called on the root.
void RunEngine::noteLatest(const Shown& shown) const {
  if (!run_.latest) return;
  const config::RunField& field = shown.field;
  const config::RunCamera& camera = shown.camera;
  std::string link = "latest";
  for (const std::string& name : {field.name, camera.name}) {
    if (!name.empty()) link += "_" + name;
  }
  const auto replace = [&](const std::optional<config::FilePattern>& pattern, const char* extension) {
    if (!pattern) return;
    const std::filesystem::path file = pattern->path(state_->frame->step, camera.name, field.name);
    io::replaceLink(file.parent_path() / (link + extension), file.filename());
  };
  replace(run_.vdi, ".vdi");
  replace(run_.png, ".png");
}

}  // namespace vdi::catalyst
