#include <vtkPython.h>  // Python requires it to be first

#include "catalyst_adaptor/scripts/Engine.h"

#include <vtkCallbackCommand.h>
#include <vtkInSituInitializationHelper.h>
#include <vtkInSituPipeline.h>
#include <vtkInSituPipelinePython.h>
#include <vtkLogger.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVTrivialProducer.h>
#include <vtkPythonInterpreter.h>
#include <vtkSMProxyIterator.h>
#include <vtkSMProxyManager.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMSourceProxy.h>
#include <vtkSmartPointer.h>
#include <vtkSmartPyObject.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <regex>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "ScriptGuard.h"
#include "catalyst_adaptor/scripts/Agreement.h"
#include "plugin/VolumetricDepthImages/Filters/VDICollective.h"
#include "plugin/VolumetricDepthImages/Filters/VDIParameters.h"
#include "plugin/VolumetricDepthImages/Filters/VDIRecords.h"
#include "plugin/VolumetricDepthImages/ParaViewVersions.h"

namespace vdi::catalyst {

namespace {

constexpr const char* channel = "grid";
std::atomic<bool> started = false;  // whether this process has started an engine, successfully or not

/// A part of an error that Debian's engine reports at each step. It concerns steering, which isn't used here.
constexpr const char* harmless = "IOCatalystConduit";

/// Captures VTK's log during its lifetime. It keeps the first error, which the caller reports, and passes on
/// the rest. Errors of filters reach no script and no return value: only the log has them all.
class Log {
 public:
  Log() : before_(vtkLogger::GetCurrentVerbosityCutoff()) {
    vtkLogger::AddCallback(id, &Log::onMessage, this, vtkLogger::VERBOSITY_INFO);
    silenceOtherOutput();
  }
  ~Log() {
    vtkLogger::RemoveCallback(id);
    vtkLogger::SetStderrVerbosity(before_);
  }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  /// Silences VTK's log on standard error again: ParaView sets its verbosity when it starts.
  static void silenceOtherOutput() { vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF); }

  void forgetErrors() noexcept {
    firstError_.clear();
    isErrorLost_ = false;
  }

  /// The first error since the last call; "" if there was none. Throws std::bad_alloc if there was no memory
  /// for its text.
  std::string takeFirstError() {
    if (std::exchange(isErrorLost_, false)) throw std::bad_alloc();
    return std::exchange(firstError_, {});
  }

 private:
  static constexpr const char* id = "vdi_catalyst";

  /// Lets no exception out: it would pass through ParaView's engine, which then refuses all further steps.
  static void onMessage(void* user, const vtkLogger::Message& message) noexcept {
    auto& self = *static_cast<Log*>(user);
    if (message.verbosity <= vtkLogger::VERBOSITY_ERROR) {
      const bool hasError = self.isErrorLost_ || !self.firstError_.empty();
      if (hasError || std::strstr(message.message, harmless) != nullptr) return;
      try {
        self.keep(message.message);
      } catch (...) {
        self.firstError_.clear();
        self.isErrorLost_ = true;
      }
      return;
    }
    auto* controller = vtkMultiProcessController::GetGlobalController();
    // other ranks would print the same
    if (controller != nullptr && controller->GetLocalProcessId() > 0) return;
    std::fprintf(stderr, "%s%s%s%s\n", message.preamble, message.indentation, message.prefix,
                 message.message);
  }

  void keep(const char* text) {
    // Removes an object's address, which tells a user nothing. Some texts start on the next line.
    static const std::regex address(R"( \((0x[0-9a-f]+|nullptr)\):\s*)");
    firstError_ = std::regex_replace(text, address, ": ", std::regex_constants::format_first_only);
    while (!firstError_.empty() && firstError_.back() == '\n') firstError_.pop_back();
  }

  vtkLogger::Verbosity before_;
  std::string firstError_;
  bool isErrorLost_ = false;
};

/// A Python pipeline that never fails for the engine, because the engine drops a pipeline that has failed
/// once.
class Pipeline : public vtkInSituPipeline {
 public:
  static Pipeline* New();
  vtkTypeMacro(Pipeline, vtkInSituPipeline);

  void setScript(const Script& script) { script_ = script; }
  /// Whether its script is loaded. A script that couldn't be loaded starts again at the next step.
  bool loaded() const { return python_ != nullptr; }
  /// Whether the last step failed.
  bool failed() const { return failed_; }

  /// Makes it do nothing from now on: ParaView keeps all pipelines that it has been given.
  void end() { hasEnded_ = true; }

  bool Execute(int step, double time) override {
    if (hasEnded_) return true;
    if (!python_) {
      vtkNew<vtkInSituPipelinePython> python;
      python->SetFileName(script_.file.c_str());
      python->SetArguments(script_.arguments);
      if (python->Initialize()) python_ = python;
    }
    failed_ = !python_ || !python_->Execute(step, time);
    return true;
  }

  bool Finalize() override {
    const auto python = std::exchange(python_, nullptr);  // runs once, although two callers may call it
    return !python || python->Finalize();
  }

 private:
  Script script_;
  bool failed_ = false;
  bool hasEnded_ = false;
  vtkSmartPointer<vtkInSituPipelinePython> python_;
};

vtkStandardNewMacro(Pipeline);

constexpr const char* agreementCapsule = "vdi::catalyst::Agreement";

/// The function leave(failed) of script_guard.py, which calls Agreement::leavePart.
PyObject* leave(PyObject* self, PyObject* failed) {
  auto* agreement = static_cast<Agreement*>(PyCapsule_GetPointer(self, agreementCapsule));
  const int truth = agreement != nullptr ? PyObject_IsTrue(failed) : -1;
  if (truth < 0) return nullptr;
  return PyBool_FromLong(agreement->leavePart(truth != 0) ? 1 : 0);
}

PyMethodDef leaveMethod{"leave", leave, METH_O, nullptr};

/// The installed module script_guard.py.
class Guard {
 public:
  Guard(Agreement& agreement, const std::string& plugin) {
    const vtkPythonScopeGilEnsurer lock;
    constexpr const char* name = "_vdi_guard";
    vtkSmartPyObject code(Py_CompileString(scriptGuard, name, Py_file_input));
    if (code) module_.TakeReference(PyImport_ExecCodeModule(name, code));
    vtkSmartPyObject capsule(PyCapsule_New(&agreement, agreementCapsule, nullptr));
    vtkSmartPyObject function(capsule ? PyCFunction_New(&leaveMethod, capsule) : nullptr);
    vtkSmartPyObject done;
    if (module_ && function)
      done.TakeReference(
          PyObject_CallMethod(module_, "install", "Os", function.GetPointer(), plugin.c_str()));
    if (done) return;
    PyErr_Print();
    throw std::runtime_error("ParaView's Python modules can't be imported; is python3-paraview installed?");
  }

  /// Returns a fault of a script that is visible before the script runs; "" if there is none.
  std::string check(const std::string& script) {
    const vtkPythonScopeGilEnsurer lock;
    const vtkSmartPyObject result(PyObject_CallMethod(module_, "check_script", "s", script.c_str()));
    return textOr("the script '" + script + "' can't be checked", result);
  }

  /// Loads our plugin. Returns the reason if it can't be loaded, and "" otherwise.
  std::string loadPlugin() {
    const vtkPythonScopeGilEnsurer lock;
    return textOr("the plugin can't be loaded",
                  vtkSmartPyObject(PyObject_CallMethod(module_, "load_plugin", nullptr)));
  }

  /// As Engine::setWantedSteps. All scripts must be loaded.
  void setWantedSteps(int first, std::span<std::uint8_t> wanted) {
    const vtkPythonScopeGilEnsurer lock;
    const auto count = static_cast<Py_ssize_t>(wanted.size());
    const vtkSmartPyObject result(PyObject_CallMethod(module_, "wanted_steps", "in", first, count));
    char* bytes = nullptr;
    Py_ssize_t length = 0;
    if (result && PyBytes_AsStringAndSize(result, &bytes, &length) == 0 && length == count) {
      std::copy_n(bytes, length, wanted.begin());
    } else {
      PyErr_Clear();
      std::ranges::fill(wanted, std::uint8_t{1});
    }
  }

  /// Call it after all scripts of a step.
  void endStep() { call("end_step"); }
  /// Removes all loaded scripts and what they have made.
  void forgetScripts() { call("forget_scripts"); }

 private:
  void call(const char* function) {
    const vtkPythonScopeGilEnsurer lock;
    const vtkSmartPyObject result(PyObject_CallMethod(module_, function, nullptr));
    if (!result) PyErr_Clear();
  }

  static std::string textOr(const std::string& fallback, PyObject* result) {
    const char* text = result != nullptr ? PyUnicode_AsUTF8(result) : nullptr;
    if (text != nullptr) return text;
    PyErr_Clear();
    return fallback;
  }

  vtkSmartPyObject module_;
};

/// A duplicate of the communicator for ParaView. On it, a mismatch of messages is an error, and doesn't end
/// the process.
class ParaViewComm {
 public:
  explicit ParaViewComm(int fortranCommunicator) {
    if (MPI_Comm_dup(MPI_Comm_f2c(fortranCommunicator), &comm_) != MPI_SUCCESS)
      throw std::runtime_error("MPI_Comm_dup failed");
    MPI_Comm_set_errhandler(comm_, MPI_ERRORS_RETURN);
  }
  ~ParaViewComm() {
    int over = 0;
    MPI_Finalized(&over);
    if (over == 0) MPI_Comm_free(&comm_);
  }
  ParaViewComm(const ParaViewComm&) = delete;
  ParaViewComm& operator=(const ParaViewComm&) = delete;
  MPI_Comm get() const { return comm_; }

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
};

/// Collects the frames of a step from the events of filters and writers.
class FrameCollector {
 public:
  void clear() {
    frames_.clear();
    failure_ = nullptr;
  }

  void add(const pv::FrameMade& made) noexcept {
    using Clock = std::chrono::steady_clock;
    if (made.reports.empty()) return;  // not the first rank
    attempt([&] {
      MadeFrame frame;
      frame.filter = made.filter;
      frame.begin = Clock::now() -
                    std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(made.seconds));
      frame.reports.assign(made.reports.begin(), made.reports.end());
      frames_.push_back(std::move(frame));
    });
  }

  /// Output of a frame that an earlier step has made isn't noted.
  void add(const pv::OutputMade& output) noexcept {
    const auto found = std::find_if(frames_.rbegin(), frames_.rend(), [&](const MadeFrame& frame) {
      return output.filter == nullptr || frame.filter == output.filter;
    });
    if (found == frames_.rend()) return;
    attempt([&] {
      RankReport& report = found->reports.front();
      report.outputSeconds += output.seconds;
      found->dropped += output.dropped;
      if (output.file.empty()) return;
      runlog::countFile(report, output.file);
      found->files.push_back(output.file);
    });
  }

  std::vector<MadeFrame> take() {
    if (const std::exception_ptr failure = std::exchange(failure_, nullptr)) std::rethrow_exception(failure);
    return std::exchange(frames_, {});
  }

 private:
  /// VTK's methods, which call this, can't pass an exception on.
  template <typename Work>
  void attempt(Work work) noexcept {
    try {
      work();
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  std::vector<MadeFrame> frames_;
  std::exception_ptr failure_;
};

/// Names the frames' filters as the scripts do, if there are several.
void nameFilters(std::vector<MadeFrame>& frames) {
  vtkNew<vtkSMProxyIterator> sources;
  sources->SetSessionProxyManager(vtkSMProxyManager::GetProxyManager()->GetActiveSessionProxyManager());
  sources->SetModeToOneGroup();
  int filters = 0;
  for (sources->Begin("sources"); sources->IsAtEnd() == 0; sources->Next()) {
    vtkSMProxy* proxy = sources->GetProxy();
    if (std::string_view(proxy->GetXMLName()) != "VolumetricDepthImage") continue;
    ++filters;
    for (MadeFrame& frame : frames) {
      if (frame.filter == proxy->GetClientSideObject()) frame.name = sources->GetKey();
    }
  }
  if (filters > 1) return;
  for (MadeFrame& frame : frames) frame.name.clear();
}

}  // namespace

struct Engine::State {
  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  std::optional<ParaViewComm> comm;    // null: `start` hasn't begun
  std::optional<Agreement> agreement;  // its communicator is separate from ParaView's and the caller's
  std::optional<Log> log;
  Parameters parameters;
  vtkNew<vtkCallbackCommand> entry;
  vtkNew<vtkCallbackCommand> exchange;
  FrameCollector frames;
  vtkNew<vtkCallbackCommand> frameMade;
  vtkNew<vtkCallbackCommand> outputMade;
  std::optional<Guard> guard;
  vtkSmartPointer<vtkSMSourceProxy> producer;
  std::vector<vtkSmartPointer<Pipeline>> prepared;
  std::vector<vtkSmartPointer<Pipeline>> pipelines;

  ~State() {
    producer = nullptr;
    if (auto* controller = vtkMultiProcessController::GetGlobalController()) ignorePlugin(*controller);
    if (comm && vtkInSituInitializationHelper::IsInitialized()) vtkInSituInitializationHelper::Finalize();
  }
  void start(int fortranCommunicator, const std::string& plugin);
  void watchPlugin();
  void collectFrames();
  void ignorePlugin(vtkMultiProcessController& controller);
  std::optional<std::string> result(bool good);
};

void Engine::State::start(int fortranCommunicator, const std::string& plugin) {
  using Helper = vtkInSituInitializationHelper;
  if (!Helper::IsPythonSupported()) throw std::runtime_error("this ParaView was built without Python");
  // Ranks begin with their collective calls, so that none is missing because its own memory has run out.
  if (!comm) {
    comm.emplace(fortranCommunicator);
    agreement.emplace(MPI_Comm_f2c(fortranCommunicator));
  }
  if (!Helper::IsInitialized()) {
    vtkLogger::EnableUnsafeSignalHandler = false;  // the simulation keeps handling SIGTERM and the like
    pv::initializeInSitu<Helper>(static_cast<vtkTypeUInt64>(MPI_Comm_c2f(comm->get())));
  }
  if (!log) log.emplace();
  Log::silenceOtherOutput();
  auto* manager = vtkSMProxyManager::GetProxyManager();
  auto* proxies = manager != nullptr ? manager->GetActiveSessionProxyManager() : nullptr;
  if (proxies == nullptr) throw std::runtime_error("ParaView's in situ engine doesn't start");
  vtkPythonInterpreter::Initialize(0);  // 0: the simulation keeps handling signals
  if (!guard) guard.emplace(*agreement, plugin);
  if (producer != nullptr) return;
  watchPlugin();
  producer.TakeReference(vtkSMSourceProxy::SafeDownCast(proxies->NewProxy("sources", "PVTrivialProducer")));
  producer->UpdateVTKObjects();
  Helper::SetProducer(channel, producer);
}

void Engine::State::watchPlugin() {
  auto* controller = vtkMultiProcessController::GetGlobalController();
  if (controller == nullptr) return;
  ignorePlugin(*controller);  // a start that failed may have come this far
  entry->SetClientData(&*agreement);
  entry->SetCallback([](vtkObject*, unsigned long, void* client, void* data) {
    auto& asked = *static_cast<pv::CollectiveEntry*>(data);
    asked.refusal = static_cast<Agreement*>(client)->enter(asked.operation);
  });
  controller->AddObserver(pv::CollectiveEntry::event, entry);
  exchange->SetClientData(&parameters);
  exchange->SetCallback([](vtkObject*, unsigned long, void* client, void* data) {
    auto& own = *static_cast<Parameters*>(client);
    auto& asked = *static_cast<pv::ParameterExchange*>(data);
    own.set(asked.changes);
    for (const Parameter& one : own.all())
      asked.parameters.push_back({one.name, one.isWhole, one.value, one.low, one.high});
  });
  controller->AddObserver(pv::ParameterExchange::event, exchange);
}

void Engine::State::collectFrames() {
  auto* controller = vtkMultiProcessController::GetGlobalController();
  if (controller == nullptr) return;
  const auto collect = [&]<typename Data>(vtkCallbackCommand* command, const Data&) {
    controller->RemoveObserver(command);  // an earlier run's
    command->SetClientData(&frames);
    command->SetCallback([](vtkObject*, unsigned long, void* client, void* data) {
      static_cast<FrameCollector*>(client)->add(*static_cast<const Data*>(data));
    });
    controller->AddObserver(Data::event, command);
  };
  collect(frameMade, pv::FrameMade{});
  collect(outputMade, pv::OutputMade{});
}

void Engine::State::ignorePlugin(vtkMultiProcessController& controller) {
  controller.RemoveObserver(entry);
  controller.RemoveObserver(exchange);
  controller.RemoveObserver(frameMade);
  controller.RemoveObserver(outputMade);
}

/// The result of the scripts that ran on this rank since the log was last read.
std::optional<std::string> Engine::State::result(bool good) {
  std::string error = log->takeFirstError();
  if (good && error.empty()) return std::nullopt;
  constexpr std::string_view noMemory = "std::bad_alloc";
  if (const auto at = error.find(noMemory); at != std::string::npos)
    error.replace(at, noMemory.size(), "out of memory on this host");
  if (error.find(Agreement::otherFailed) != std::string::npos) return "";
  return error;
}

bool Engine::wasStarted() {
  return started || vtkInSituInitializationHelper::IsInitialized();
}

Engine::Engine() : state_(std::make_unique<State>()) {}

void Engine::start(int fortranCommunicator, const std::string& plugin) {
  assert(state_->comm || !wasStarted());
  started = true;
  state_->start(fortranCommunicator, plugin);
}

void Engine::check(const std::string& script) {
  const std::string wrong = state_->guard->check(script);
  if (!wrong.empty()) throw std::runtime_error(wrong);
}

bool Engine::runsOn(MPI_Comm comm) const {
  if (!state_->comm) return true;
  int result = MPI_UNEQUAL;
  return MPI_Comm_compare(comm, state_->comm->get(), &result) == MPI_SUCCESS &&
         (result == MPI_IDENT || result == MPI_CONGRUENT);
}

void Engine::loadPlugin() {
  const std::string wrong = state_->guard->loadPlugin();
  if (!wrong.empty()) throw std::runtime_error(wrong);
}

void Engine::prepare(const std::vector<Script>& scripts) {
  state_->prepared.clear();
  for (const Script& script : scripts) {
    vtkNew<Pipeline> pipeline;
    pipeline->setScript(script);
    state_->prepared.emplace_back(pipeline);
  }
}

void Engine::add() {
  for (const auto& pipeline : state_->prepared) vtkInSituInitializationHelper::AddPipeline(pipeline);
  state_->pipelines = std::move(state_->prepared);
}

Engine::~Engine() = default;

void Engine::setWantedSteps(int first, std::span<std::uint8_t> wanted) const {
  const auto& pipelines = state_->pipelines;
  const bool areLoaded =
      std::ranges::all_of(pipelines, [](const auto& pipeline) { return pipeline->loaded(); });
  if (!areLoaded) {
    std::ranges::fill(wanted, std::uint8_t{1});
  } else if (pipelines.empty()) {
    std::ranges::fill(wanted, std::uint8_t{0});
  } else {
    state_->guard->setWantedSteps(first, wanted);
  }
}

Parameters& Engine::parameters() {
  return state_->parameters;
}

void Engine::collectFrames() {
  state_->collectFrames();
}

std::vector<MadeFrame> Engine::takeFrames() {
  std::vector<MadeFrame> frames = state_->frames.take();
  if (!frames.empty()) nameFilters(frames);
  return frames;
}

std::optional<std::string> Engine::finish() {
  state_->log->forgetErrors();
  bool good = true;
  for (const auto& pipeline : state_->pipelines) good = pipeline->Finalize() && good;
  state_->agreement->leaveStep();
  return state_->result(good);
}

void Engine::forgetScripts() {
  for (const auto& pipeline : state_->pipelines) pipeline->end();
  state_->pipelines.clear();
  state_->guard->forgetScripts();
  state_->parameters = {};
}

std::optional<std::string> Engine::execute(vtkDataObject* grid, int step, double time) {
  using Helper = vtkInSituInitializationHelper;
  state_->log->forgetErrors();
  state_->frames.clear();
  std::exception_ptr failure;
  bool good = true;
  try {
    auto* producer = vtkPVTrivialProducer::SafeDownCast(state_->producer->GetClientSideObject());
    producer->SetOutput(grid, time);
    Helper::MarkProducerModified(channel);
    good = Helper::ExecutePipelines(step, time);
    for (const auto& pipeline : state_->pipelines) good = good && !pipeline->failed();
    state_->guard->endStep();
  } catch (...) {
    failure = std::current_exception();
  }
  state_->agreement->leaveStep();
  if (failure) std::rethrow_exception(failure);
  return state_->result(good);
}

}  // namespace vdi::catalyst
