#include "catalyst_adaptor/json/RunEngine.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "catalyst_adaptor/json/LiveStream.h"
#include "vdi/comm/Communicator.h"
#include "vdi/core/Error.h"
#include "vdi/core/Flatten.h"
#include "vdi/core/UnitDistance.h"
#include "vdi/gpu/Device.h"
#include "vdi/gpu/DeviceRequest.h"
#include "vdi/io/Files.h"
#include "vdi/io/Png.h"
#include "vdi/io/VdiFile.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vdi/runlog/RunLog.h"

namespace vdi::catalyst {

namespace {

void makeFolderOf(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) throw Error(ErrorCode::Io, "can't make the folder: " + error.message(), folder.string());
}

/// 0 for a device.
std::uint64_t sizeOfFile(const std::string& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  return error ? 0 : bytes;
}

runlog::LogFiles logFilesOf(const config::RunLogFiles& names) {
  runlog::LogFiles files;
  if (!names.json.empty()) files.json = names.json;
  if (!names.text.empty()) files.text = names.text;
  return files;
}

runlog::FrameRecord recordOf(std::int64_t step, double time) {
  runlog::FrameRecord record;
  record.step = step;
  record.time = time;
  return record;
}

}  // namespace

struct RunEngine::State {
  explicit State(int handle) : fortranCommunicator(handle), comm(comm::Communicator::fromMpi(handle)) {}

  /// Collective.
  void start() {
    comm.together([&] { device = gpu::Device::create(gpu::requestFromEnvironment(comm.localRank())); });
    generator = std::make_unique<VdiGenerator>(device, comm::Communicator::fromMpi(fortranCommunicator),
                                               generatorOptionsFromEnvironment(comm));
  }
  bool isRoot() const { return comm.rank() == 0; }

  int fortranCommunicator;
  comm::Communicator comm;
  std::shared_ptr<gpu::Device> device;
  std::unique_ptr<VdiGenerator> generator;
  std::unique_ptr<runlog::RunLog> log;    // the root's
  std::unique_ptr<LiveStream> stream;     // the root's
  std::optional<ScalarRange> firstRange;  // of the colours, unless the run has one
};

/// All that the generator needs beside its blocks.
struct RunEngine::Frame {
  Camera camera;
  TransferFunction function;
  TimeStamp stamp;
};

RunEngine::RunEngine(int fortranCommunicator, config::Run run, std::optional<config::ColorMap> map)
    : run_(std::move(run)), map_(std::move(map)), state_(std::make_unique<State>(fortranCommunicator)) {
  state_->start();
  state_->comm.together([&] {
    if (!state_->isRoot()) return;
    if (run_.log.any()) {
      const runlog::RunStart start{run_.field, state_->comm.size(), std::time(nullptr)};
      state_->log = std::make_unique<runlog::RunLog>(logFilesOf(run_.log), start);
    }
    if (run_.stream) state_->stream = std::make_unique<LiveStream>(*run_.stream);
  });
}

RunEngine::~RunEngine() = default;

void RunEngine::execute(const Fields& fields, std::int64_t step, double time, double waited) {
  const auto start = std::chrono::steady_clock::now();
  runlog::FrameRecord record = recordOf(step, time);
  if (!run_.log.any()) {
    makeOrRetry(fields, step, time, record);
    return;
  }
  const std::vector<double> waits = millisecondsOfRanks(waited);
  std::exception_ptr failure;
  try {
    makeOrRetry(fields, step, time, record);
  } catch (const std::exception& error) {
    failure = std::current_exception();
    record = recordOf(step, time);
    record.error = error.what();
  }
  state_->comm.together([&] {
    if (failure && !state_->log) std::rethrow_exception(failure);
    if (!state_->log) return;
    const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
    record.milliseconds = waits.front() + spent.count();
    if (!failure) record.stages.insert(record.stages.begin(), runlog::stageOf("wait", waits));
    if (state_->stream) record.dropped = state_->stream->dropped();
    try {
      state_->log->add(record);
    } catch (const std::exception& error) {
      if (!failure) throw;
      fmt::print(stderr, "vdi_catalyst: step {}: {}\n", step, error.what());
    }
    if (failure) std::rethrow_exception(failure);
  });
}

void RunEngine::finish() {
  state_->comm.together([&] {
    if (!state_->log) return;
    fmt::print(stderr, "vdi_catalyst: {}\n", runlog::textLine(state_->log->finish()));
  });
}

/// Collective: of each rank, on the root alone.
std::vector<double> RunEngine::millisecondsOfRanks(double seconds) const {
  const double milliseconds = 1e3 * seconds;
  const comm::Gathered all =
      state_->comm.gather(std::as_bytes(std::span(&milliseconds, 1)), sizeof milliseconds, 0);
  std::vector<double> ranks(all.bytes.size() / sizeof milliseconds);
  if (!ranks.empty()) std::memcpy(ranks.data(), all.bytes.data(), all.bytes.size());
  return ranks;
}

void RunEngine::makeOrRetry(const Fields& fields, std::int64_t step, double time,
                            runlog::FrameRecord& record) {
  std::exception_ptr failure;
  try {
    make(fields, step, time, record);
  } catch (...) {  // on all ranks, but with another exception on each
    failure = std::current_exception();
  }
  if (!failure) return;
  if (!state_->comm.anyTogether([&] { return state_->device->isLost(); })) std::rethrow_exception(failure);
  state_->generator.reset();
  state_->start();
  record = recordOf(step, time);
  make(fields, step, time, record);
}

void RunEngine::make(const Fields& fields, std::int64_t step, double time, runlog::FrameRecord& record) {
  const Frame frame = frameOf(fields, step, time);
  deliver(frame, step, record);
}

RunEngine::Frame RunEngine::frameOf(const Fields& fields, std::int64_t step, double time) {
  State& state = *state_;
  const comm::Communicator& comm = state.comm;
  // Whether the field is one of cells: ranks without blocks may not know, all others agree.
  std::array<std::uint64_t, 2> kinds{0, 0};  // of points, of cells
  comm.together([&] {
    const std::optional<bool> cells = run_.cells ? run_.cells : fields.associationOf(run_.field);
    if (cells) kinds[*cells ? 1 : 0] = 1;
  });
  comm.allReduceMax(kinds);
  if (kinds[0] > 0 && kinds[1] > 0) {
    throw Error(ErrorCode::InvalidArgument, "ranks have '" + run_.field +
                                                "' of cells and of points: 'association' "
                                                "must name one");
  }
  const bool cells = kinds[1] > 0;
  std::vector<Block> blocks;
  comm.together([&] { blocks = fields.blocksOf(run_.field, cells, run_.component); });
  double mostPerVolume = 0.0;
  for (const Block& block : blocks)
    mostPerVolume = std::max(mostPerVolume, 1.0 / (block.spacing.x * block.spacing.y * block.spacing.z));
  std::array<double, 2> largest{mostPerVolume, static_cast<double>(fields.componentsOf(run_.field, cells))};
  comm.allReduceMax(largest);

  VdiGenerator& generator = *state.generator;
  generator.setBlocks(std::move(blocks));
  ScalarRange range = generator.scalarRange();
  if (!state.firstRange && range.min < range.max) state.firstRange = range;
  if (state.firstRange) range = *state.firstRange;
  const Box& bounds = generator.scene().bounds;
  const double voxelVolume = largest[0] > 0.0 ? 1.0 / largest[0] : 0.0;
  const int components = static_cast<int>(largest[1]);
  Frame frame;
  comm.together([&] {
    frame.camera = run_.cameraAt(step, bounds);
    frame.function = run_.transferFunction(map_, range, unitDistanceOf(bounds, voxelVolume));
  });
  frame.stamp = {time,
                 static_cast<std::uint64_t>(step),
                 {.name = run_.field,
                  .cells = cells,
                  .components = components,
                  .component = components > 1 ? run_.component : 0}};
  return frame;
}

void RunEngine::deliver(const Frame& frame, std::int64_t step, runlog::FrameRecord& record) {
  State& state = *state_;
  VdiGenerator& generator = *state.generator;
  const bool isRoot = state.isRoot();
  state.comm.together([&] {
    if (isRoot && run_.vdi) makeFolderOf(run_.vdi->path(step));
    if (isRoot && run_.png) makeFolderOf(run_.png->path(step));
  });
  if (!run_.png && !run_.stream) {  // no rank ever has the whole VDI
    generator.write(run_.vdi->path(step), frame.camera, frame.function, run_.settings, frame.stamp);
    state.comm.together([&] {
      if (!isRoot) return;
      runlog::setReports(record, generator.reports());
      noteFiles(step, record);
    });
    return;
  }
  std::optional<Vdi> made = generator.generate(frame.camera, frame.function, run_.settings);
  state.comm.together([&] {
    if (!made) return;
    made->time = frame.stamp.time;
    made->timeStep = frame.stamp.step;
    made->coloring->array = frame.stamp.array;
    save(std::move(*made), step, record);
  });
}

/// On the root, which has the VDI. What it takes is output, too.
void RunEngine::save(Vdi vdi, std::int64_t step, runlog::FrameRecord& record) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<RankReport> reports = state_->generator->reports();
  if (run_.vdi) io::writeVdi(run_.vdi->path(step), vdi);
  if (run_.png) io::writePng(run_.png->path(step), io::toPicture(flatten(vdi)));
  if (state_->stream) state_->stream->publish(std::make_shared<const Vdi>(std::move(vdi)));
  noteFiles(step, record);
  for (const std::string& file : record.files) reports.front().bytesWritten += sizeOfFile(file);
  reports.front().outputSeconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  runlog::setReports(record, reports);
}

void RunEngine::noteFiles(std::int64_t step, runlog::FrameRecord& record) {
  const auto note = [&](const std::optional<config::FilePattern>& pattern, const char* latest) {
    if (!pattern) return;
    const std::filesystem::path file = pattern->path(step);
    record.files.push_back(file.string());
    if (run_.latest) io::replaceLink(file.parent_path() / latest, file.filename());
  };
  note(run_.vdi, "latest.vdi");
  note(run_.png, "latest.png");
}

}  // namespace vdi::catalyst
