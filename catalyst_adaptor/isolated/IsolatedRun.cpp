#include "catalyst_adaptor/isolated/IsolatedRun.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <mpi.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>

#include "vdi/io/Files.h"
#include "vdi/io/JsonText.h"

namespace vdi::catalyst {

namespace {

constexpr std::chrono::milliseconds tick(20);  // between two agreements while ranks wait
constexpr double startLimit = 300.0;           // seconds in which processes start, make a frame, or end a run
constexpr double stopLimit = 2.0;              // seconds in which somebody may let stopped processes continue
constexpr std::chrono::milliseconds endLimit(10000);

/// Collective: the maximum of each number over the ranks.
template <std::size_t count>
std::array<std::int64_t, count> meet(MPI_Comm comm, std::array<std::int64_t, count> numbers) {
  MPI_Allreduce(MPI_IN_PLACE, numbers.data(), static_cast<int>(count), MPI_INT64_T, MPI_MAX, comm);
  return numbers;
}

/// The program that makes frames, which lies beside the library with this code.
std::string programFile() {
  Dl_info self;
  if (dladdr(reinterpret_cast<const void*>(&programFile), &self) == 0 || self.dli_fname == nullptr)
    throw std::runtime_error("the path of vdi_catalyst_process is unknown");
  const auto file = std::filesystem::absolute(self.dli_fname).parent_path() / "vdi_catalyst_process";
  if (access(file.c_str(), X_OK) != 0)
    throw std::runtime_error(
        file.string() +
        " is missing or can't be executed; it is part of pv-vdi's adaptor, so reinstall pv-vdi");
  return file.string();
}

mode_t currentUmask() {
  const mode_t mask = umask(S_IRWXG | S_IRWXO);
  umask(mask);
  return mask;
}

using HostName = std::array<char, MPI_MAX_PROCESSOR_NAME>;

/// Collective: fills in the hosts of all ranks, [size], on the first one.
void gatherHosts(MPI_Comm comm, std::vector<HostName>& hosts) {
  HostName name{};
  int length = 0;
  MPI_Get_processor_name(name.data(), &length);
  const auto bytes = static_cast<int>(name.size());
  MPI_Gather(name.data(), bytes, MPI_CHAR, hosts.data(), bytes, MPI_CHAR, 0, comm);
}

}  // namespace

IsolatedRun::IsolatedRun(FieldCalls& self, IsolatedOptions options)
    : self_(self), options_(std::move(options)) {
  MPI_Comm_rank(self_.comm, &rank_);
  MPI_Comm_size(self_.comm, &size_);
  if (options_.run) schedule_.emplace(*options_.run);
}

IsolatedRun::~IsolatedRun() = default;

int IsolatedRun::start() {
  return launch(false);
}

Setup IsolatedRun::setupOf(bool isGoingOn) const {
  Setup setup;
  setup.rank = rank_;
  setup.isJson = options_.run.has_value();
  setup.isGoingOn = isGoingOn;
  setup.hasText = options_.json.has_value();
  setup.json = options_.json.value_or("");
  for (const Script& script : options_.scripts) setup.scripts.push_back({script.file, script.arguments});
  for (char** variable = environ; variable != nullptr && *variable != nullptr; ++variable)
    setup.environment.emplace_back(*variable);
  setup.folder = std::filesystem::current_path().string();
  setup.umask = currentUmask();
  return setup;
}

int IsolatedRun::launch(bool isGoingOn) {
  handedOver_ = settled_ = 0;
  timedOutAt_.reset();
  std::array<char, 64> name{};
  std::vector<HostName> hosts;
  int code = guarded(self_, VDI_CATALYST_ENGINE, [&] {
    if (rank_ != 0) return;
    std::snprintf(name.data(), name.size(), "%s", newSocketName().c_str());
    hosts.resize(static_cast<std::size_t>(size_));
  });
  if (code != VDI_CATALYST_OK) return code;
  MPI_Bcast(name.data(), static_cast<int>(name.size()), MPI_CHAR, 0, self_.comm);
  gatherHosts(self_.comm, hosts);
  code = guarded(self_, VDI_CATALYST_ENGINE, [&] {
    process_ = std::make_unique<FrameProcess>(std::string(name.data()) + "-" + std::to_string(rank_),
                                              setupOf(isGoingOn));
  });
  if (code == VDI_CATALYST_OK) {
    code = guarded(self_, VDI_CATALYST_ENGINE, [&] {
      if (rank_ != 0) return;
      const std::string program = programFile();
      std::vector<std::string> names;
      names.reserve(hosts.size());
      for (const HostName& host : hosts) names.emplace_back(host.data());
      job_ = std::make_unique<Job>(
          program,
          commandOf(options_.launcher, names, {program, "serve", name.data(), std::to_string(size_)}));
    });
  }
  if (code == VDI_CATALYST_OK) code = awaitStart();
  if (code != VDI_CATALYST_OK) end();
  return code;
}

int IsolatedRun::awaitStart() {
  const auto progress = [&] { return process_->startCode().has_value() ? 1 : 0; };
  const Wait result = wait(progress, 1, startLimit).first;
  if (result == Wait::Over) return *process_->startCode();
  return guarded(self_, VDI_CATALYST_ENGINE, [&]() -> std::optional<std::string> {
    if (result == Wait::TimedOut) {
      return process_->startCode() ? ""
                                   : "the process that makes frames hasn't started in " +
                                         std::to_string(static_cast<int>(startLimit)) + " s";
    }
    if (process_->isGone()) return "the process that makes frames " + process_->end();
    if (!job_ || !job_->isOver(Milliseconds(0))) return "";
    const std::string said = job_->said();
    return "the processes that make frames didn't start; their launcher said: " +
           (said.empty() ? "nothing" : said);
  });
}

/// Waits until all ranks' progress, which only grows, has come to the goal. Gives up when the least progress
/// hasn't grown for `limit` seconds. Returns the least progress, too.
template <typename Progress>
std::pair<IsolatedRun::Wait, std::int64_t> IsolatedRun::wait(Progress progress, std::int64_t goal,
                                                             double limit) {
  auto lastGrowth = Clock::now();
  auto lastRun = lastGrowth;
  std::int64_t least = std::numeric_limits<std::int64_t>::min();
  const auto since = [](Clock::time_point time) {
    return std::chrono::duration<double>(Clock::now() - time).count();
  };
  for (;;) {
    process_->listen(tick);
    const bool isStopped = process_->isStopped();
    if (!isStopped) lastRun = Clock::now();
    const bool isLate = rank_ == 0 && since(lastGrowth) > limit;
    const bool isStoppedLong = isStopped && since(lastRun) > stopLimit;
    // Once the job is over, processes that haven't come yet never will, on any host.
    const bool isLost = job_ && !process_->startCode() && job_->isOver(Milliseconds(0));
    const std::int64_t mine = progress();
    const bool isGone = (process_->isGone() || isLost) && mine < goal;
    const auto [gone, behind, timedOut] =
        meet<3>(self_.comm, {isGone ? 1 : 0, -mine, isLate || isStoppedLong ? 1 : 0});
    if (-behind >= goal) return {Wait::Over, -behind};
    if (gone != 0) return {Wait::Dead, -behind};
    if (timedOut != 0) return {Wait::TimedOut, -behind};
    if (-behind > least) lastGrowth = Clock::now();
    least = -behind;
  }
}

/// Ends the remaining processes, and reports the loss of the lowest rank that has lost its own.
int IsolatedRun::reapDead(std::optional<std::int64_t> step) {
  const bool restarts = options_.isolation.restart && step;
  const int code = guarded(
      self_, VDI_CATALYST_ENGINE,
      [&]() -> std::optional<std::string> {
        if (!process_->isGone()) return "";
        return "the process that makes frames " + process_->end() +
               (restarts ? "; it starts again for the next frame"
                : step   ? "; no more frames are made"
                         : "");
      },
      step);
  end();
  return code;
}

void IsolatedRun::end() {
  process_.reset();
  job_.reset();
}

/// Takes the result of one step, and notes the parameters that have changed. Returns the worse code.
int IsolatedRun::take(const DoneNotice& notice, int worst, Values& changes) {
  Values values;
  for (std::size_t i = 0; i < notice.parameters.size(); ++i) {
    const Parameter& parameter = parameters_.all()[i];
    if (parameter.value == notice.parameters[i]) continue;
    values[parameter.name] = changes[parameter.name] = notice.parameters[i];
  }
  parameters_.set(values);
  if (notice.code < worst || notice.code == VDI_CATALYST_OK) return worst;
  self_.error = notice.text;
  return notice.code;
}

/// Collective: takes the results of steps up to the given number, which all ranks have. The parameters in
/// them are in force after the simulation's step `at`. Returns the worst code.
int IsolatedRun::settle(std::int64_t done, std::optional<At> at) {
  if (settled_ == done) return VDI_CATALYST_OK;
  int worst = VDI_CATALYST_OK;
  Values changes;
  std::exception_ptr failure;
  for (; settled_ < done; ++settled_) {
    const DoneNotice notice = process_->takeDone();
    try {
      worst = take(notice, worst, changes);
    } catch (const std::bad_alloc&) {
      failure = std::current_exception();
    }
  }
  const int code = guarded(self_, VDI_CATALYST_ENGINE, [&] {
    if (failure) std::rethrow_exception(failure);
    if (rank_ == 0 && at && !changes.empty()) tell(changes, *at);
  });
  return std::max(worst, code);
}

/// Reports when parameters take effect. The process that makes frames has logged when viewers set them,
/// but the simulation has gone on meanwhile.
void IsolatedRun::tell(const Values& changes, const At& at) const {
  for (const auto& [name, value] : changes)
    fmt::print(stderr, "vdi_catalyst: step {}: {} = {:g} from now on\n", at.step, name, value);
  const bool isLogged = options_.run && options_.run->stream && !options_.run->stream->steeringLog.empty();
  if (!isLogged) return;
  io::JsonObject inForce;
  for (const auto& [name, value] : changes) inForce.add(name, io::jsonOf(value));
  io::JsonObject entry;
  entry.add("step", io::jsonOf(at.step)).add("time", io::jsonOf(at.time)).add("in_force", inForce.text());
  io::appendLine(options_.run->stream->steeringLog, entry.text());
}

bool IsolatedRun::isLocallyWanted(std::int64_t step, double time, double now) const {
  if (!schedule_) return !process_ || process_->wants(step).value_or(true);
  if (isSteered()) return true;
  return (rank_ == 0 || !schedule_->needsRoot()) && schedule_->isDue(step, time, now);
}

bool IsolatedRun::wants(std::int64_t step, double time) {
  if (!process_ && !options_.isolation.restart) return false;
  const bool isValid = schedule_ ? step >= 0 : isStep(step);
  if (process_) process_->listen(Milliseconds(0));
  const bool isUnknown = process_ && !schedule_ && isValid && !process_->wants(step);
  const std::int64_t done = process_ ? process_->doneCount() : 0;
  const bool wanted = isValid && isLocallyWanted(step, time, elapsed());
  const auto answers = meet<3>(self_.comm, {wanted ? 1 : 0, isUnknown ? 1 : 0, -done});
  // Idle processes can be asked. Before the first step, scripts aren't loaded.
  const bool canAsk = answers[1] != 0 && -answers[2] == handedOver_ && handedOver_ > 0;
  if (!canAsk) return answers[0] != 0;
  process_->ask(step);
  constexpr double patience = 5.0;
  if (wait([&] { return process_->wants(step) ? 1 : 0; }, 1, patience).first != Wait::Over) return true;
  return meet<1>(self_.comm, {*process_->wants(step) ? 1 : 0})[0] != 0;
}

/// Refuses steps and times that the engines refuse, and steps that differ.
int IsolatedRun::checked(std::int64_t step, double time) {
  int code = guarded(
      self_, VDI_CATALYST_BAD_ARGUMENT,
      [&] {
        require(self_.haveBlocks, "no blocks were given yet");
        if (schedule_) {
          require(step >= 0, "steps count from 0");
        } else {
          requireStep(step);
        }
        requireTime(time);
      },
      step);
  if (code == VDI_CATALYST_OK) {
    code = guarded(
        self_, VDI_CATALYST_BAD_ARGUMENT,
        [&] { requireEqual(self_.comm, step, "the ranks give different steps"); }, step);
  }
  return code;
}

int IsolatedRun::execute(std::int64_t step, double time) {
  if (!process_ && !options_.isolation.restart) return VDI_CATALYST_ENGINE;
  if (process_) process_->listen(Milliseconds(0));
  self_.fields.beginStep();
  const double now = elapsed();
  const bool isRefused = !self_.haveBlocks || !std::isfinite(time) || (schedule_ ? step < 0 : !isStep(step));
  const bool isGone = process_ && process_->isGone();
  const auto [refused, highest, lowest, gone, behind, wanted] = meet<6>(
      self_.comm, {isRefused ? 1 : 0, step, ~step, isGone ? 1 : 0, process_ ? -process_->doneCount() : 0,
                   !isRefused && isLocallyWanted(step, time, now) ? 1 : 0});
  if (refused != 0 || highest != ~lowest) return checked(step, time);
  int code = VDI_CATALYST_OK;
  if (gone != 0) {
    code = reapDead(step);
    if (!options_.isolation.restart) return code;
  } else if (process_) {
    code = settle(-behind, At{step, time});
  }
  if (wanted != 0) {
    if (schedule_ && !isSteered()) schedule_->begin(time, now);
    code = std::max(code, handOver(step, time, now));
  }
  if (code == VDI_CATALYST_OK) self_.printed.clear();
  return code;
}

/// Hands over a wanted step.
int IsolatedRun::handOver(std::int64_t step, double time, double now) {
  int earlier = VDI_CATALYST_OK;
  if (!process_) {
    const int code = launch(true);
    if (code != VDI_CATALYST_OK) return code;
  }
  if (handedOver_ - settled_ >= 2) {
    if (timedOutAt_ == settled_) return leaveOut(step, time);
    const double patience =
        isSteered() ? std::numeric_limits<double>::infinity() : options_.isolation.patience;
    if (patience == 0.0) return leaveOut(step, time);
    const auto [result, done] = wait([&] { return process_->doneCount(); }, handedOver_ - 1, patience);
    if (result == Wait::Dead) {
      const int code = reapDead(step);
      return options_.isolation.restart ? std::max(code, handOver(step, time, now)) : code;
    }
    earlier = settle(done, At{step, time});
    if (result == Wait::TimedOut) {
      timedOutAt_ = settled_;
      return leaveOut(step, time);
    }
  }
  // Scripts may use all fields, so they get all. If any rank lacks a field that a JSON run names, all ranks
  // hand over all fields, too, so that a message about a missing array lists the others.
  bool namedAlone = false;
  int code = guarded(
      self_, VDI_CATALYST_SCRIPT, [&] { namedAlone = hasNamedFields(); }, step);
  if (code != VDI_CATALYST_OK) return code;
  namedAlone = meet<1>(self_.comm, {namedAlone ? 0 : 1})[0] == 0;
  std::optional<StepWriter> data;
  code = guarded(
      self_, VDI_CATALYST_SCRIPT,
      [&] {
        data.emplace(self_.fields.version(), self_.fields.blocks(), fetched(fieldsOf(namedAlone)),
                     parameters_.all());
        process_->reserve(*data);
      },
      step);
  if (code != VDI_CATALYST_OK) return code;
  StepNotice notice;
  notice.step = step;
  notice.time = time;
  notice.clock = now;
  tellLeftOut();
  process_->handOver(*data, notice);
  ++handedOver_;
  return earlier;
}

/// Collective: whether a rank's answer is yes. One rank's stopped process keeps those of the other
/// ranks from finishing frames, so only the stopped one is reported as the cause.
bool IsolatedRun::isOfAny(bool answer) const {
  return meet<1>(self_.comm, {answer ? 1 : 0})[0] != 0;
}

/// Leaves out a step for which there is no buffer. Without patience, that isn't an error.
int IsolatedRun::leaveOut(std::int64_t step, double time) {
  ++leftOut_;
  // Where viewers may steer, not every step that isn't handed over would have had a frame.
  const bool isLogged = rank_ == 0 && options_.run && options_.run->log.any() && !isSteered();
  try {
    if (isLogged) unreportedSkips_.steps.push_back({step, time});
  } catch (const std::bad_alloc&) {  // the log lacks the step
  }
  if (options_.isolation.patience == 0.0) {
    if (!std::exchange(hasReportedSkips_, true) && rank_ == 0) {
      std::fprintf(
          stderr,
          "vdi_catalyst: step %lld: left out: two earlier steps' frames are still to be made; further "
          "such steps aren't reported\n",
          static_cast<long long>(step));
    }
    return VDI_CATALYST_OK;
  }
  const bool isStopped = process_->isStopped();
  const bool isAnyStopped = isOfAny(isStopped);
  return guarded(
      self_, VDI_CATALYST_SCRIPT,
      [&]() -> std::optional<std::string> {
        if (isStopped) return "left out: the process that makes frames was stopped (SIGSTOP)";
        if (!isAnyStopped && process_->doneCount() == settled_)
          return "left out: the process that makes frames hasn't finished one for a long time";
        return "";
      },
      step);
}

/// Tells the process about the steps that were left out since the last ones of which it knows.
void IsolatedRun::tellLeftOut() {
  if (!unreportedSkips_.steps.empty() && process_->tellLeftOut(unreportedSkips_))
    unreportedSkips_.steps.clear();
}

/// The names of the arrays that a JSON run uses.
std::vector<std::string> IsolatedRun::namedArrays() const {
  std::vector<std::string> names;
  for (const config::RunField& field : options_.run->fields) names.push_back(field.array);
  if (options_.run->when) names.push_back(options_.run->when->field);
  return names;
}

/// Whether this rank has the arrays that a JSON run uses.
bool IsolatedRun::hasNamedFields() const {
  const Fields& fields = self_.fields;
  const auto has = [&](const std::string& name) { return fields.has(name, false) || fields.has(name, true); };
  return options_.run && std::ranges::all_of(namedArrays(), has);
}

/// The fields to hand over: all, or only those that a JSON run names.
StepFields IsolatedRun::fieldsOf(bool namedAlone) const {
  StepFields all;
  all.arrays = self_.fields.arrays();
  for (const auto& [name, particles] : self_.fields.particles())
    all.particles.push_back(
        {name, particles, self_.fields.offsetOf(name, true), self_.fields.missingOf(name, true)});
  if (!namedAlone) return all;
  const std::vector<std::string> names = namedArrays();
  const auto isUnnamed = [&](const std::string& name) {
    return std::ranges::find(names, name) == names.end();
  };
  std::erase_if(all.arrays, [&](const Fields::NamedArray& array) { return isUnnamed(array.name); });
  std::erase_if(all.particles,
                [&](const StepFields::NamedParticles& particles) { return isUnnamed(particles.name); });
  return all;
}

/// Makes the values of the fields readable.
StepFields IsolatedRun::fetched(StepFields fields) {
  for (const Fields::NamedArray& array : fields.arrays) self_.fields.fetch(array.name, array.cells);
  for (const StepFields::NamedParticles& particles : fields.particles)
    self_.fields.fetchParticles(particles.name);
  return fields;
}

int IsolatedRun::finish() {
  if (leftOut_ > 0 && rank_ == 0) {
    std::fprintf(stderr, "vdi_catalyst: in all, %lld steps were left out\n",
                 static_cast<long long>(leftOut_));
  }
  if (!process_) return VDI_CATALYST_ENGINE;
  tellLeftOut();
  process_->finish();
  // A viewer may pause a steered run for any length of time.
  const double limit = isSteered() ? std::numeric_limits<double>::infinity()
                                   : std::max(options_.isolation.patience, startLimit);
  const auto progress = [&] { return process_->doneCount() + (process_->finished() ? 1 : 0); };
  const Wait result = wait(progress, handedOver_ + 1, limit).first;
  if (result == Wait::Dead) return reapDead(std::nullopt);
  if (result == Wait::TimedOut) {
    const bool isStopped = process_->isStopped();
    const bool isAnyStopped = isOfAny(isStopped);
    const int code = guarded(self_, VDI_CATALYST_ENGINE, [&]() -> std::optional<std::string> {
      if (isStopped) return "the process that makes frames was stopped (SIGSTOP); killing it";
      if (isAnyStopped || process_->finished()) return "";
      return "the process that makes frames doesn't end the run; killing it";
    });
    end();
    return code;
  }
  int code = settle(handedOver_, std::nullopt);
  if (process_->finished()->code > code) {
    const int ended = process_->finished()->code;
    code = std::max(ended,
                    guarded(self_, VDI_CATALYST_ENGINE, [&] { self_.error = process_->finished()->text; }));
  }
  process_->awaitEnd(endLimit);
  if (job_) (void)job_->isOver(endLimit);
  end();
  return code;
}

}  // namespace vdi::catalyst
