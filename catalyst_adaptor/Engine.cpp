// Written against ParaView 5.11: AddPipeline and ExecutePipelines have other signatures from 5.12 on.
#include "catalyst_adaptor/Engine.h"

#include <vtkInSituInitializationHelper.h>
#include <vtkInSituPipeline.h>
#include <vtkInSituPipelinePython.h>
#include <vtkLogger.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPVTrivialProducer.h>
#include <vtkPythonInterpreter.h>
#include <vtkSMProxyManager.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMSourceProxy.h>
#include <vtkSmartPointer.h>

#include <atomic>
#include <cstdio>
#include <regex>
#include <stdexcept>
#include <utility>

#include "catalyst_adaptor/ScriptGuard.h"

namespace vdi::catalyst {

namespace {

constexpr const char* channel = "grid";
/// Said by Debian's engine at each step; it concerns steering, which isn't used here.
constexpr const char* harmless = "IOCatalystConduit";

/// VTK's log, as long as it lives: keeps the first error, which is the caller's to report, and passes on the
/// rest. Filters' errors reach no script and no return value: the log is the only place that has them all.
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

  /// ParaView's start chooses what's printed; this undoes it.
  static void silenceOtherOutput() { vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF); }

  /// Since the last call; "" if there was none.
  std::string takeFirstError() { return std::exchange(firstError_, {}); }

 private:
  static constexpr const char* id = "vdi_catalyst";

  static void onMessage(void* user, const vtkLogger::Message& message) {
    auto& self = *static_cast<Log*>(user);
    const std::string text = message.message;
    if (message.verbosity <= vtkLogger::VERBOSITY_ERROR) {
      if (text.find(harmless) != std::string::npos || !self.firstError_.empty()) return;
      // An object's address tells a user nothing; some texts start on the next line.
      static const std::regex address(R"( \((0x[0-9a-f]+|nullptr)\):\s*)");
      self.firstError_ = std::regex_replace(text, address, ": ", std::regex_constants::format_first_only);
      while (!self.firstError_.empty() && self.firstError_.back() == '\n') self.firstError_.pop_back();
      return;
    }
    auto* controller = vtkMultiProcessController::GetGlobalController();
    if (controller != nullptr && controller->GetLocalProcessId() > 0) return;  // they'd say the same
    std::fprintf(stderr, "%s%s%s%s\n", message.preamble, message.indentation, message.prefix, text.c_str());
  }

  vtkLogger::Verbosity before_;
  std::string firstError_;
};

/// A Python pipeline that the engine goes on calling: the engine drops one that has failed once.
class Pipeline : public vtkInSituPipeline {
 public:
  static Pipeline* New();
  vtkTypeMacro(Pipeline, vtkInSituPipeline);

  void setScript(const std::string& script) { script_ = script; }
  /// Of the last step.
  bool failed() const { return failed_; }

  bool Execute(int step, double time) override {
    if (!python_) {
      // A script that couldn't be loaded starts anew at the next step.
      vtkNew<vtkInSituPipelinePython> python;
      python->SetFileName(script_.c_str());
      if (python->Initialize()) python_ = python;
    }
    failed_ = !python_ || !python_->Execute(step, time);
    return true;
  }

  bool Finalize() override {
    const auto python = std::exchange(python_, nullptr);  // once, whoever calls
    return !python || python->Finalize();
  }

 private:
  std::string script_;
  bool failed_ = false;
  vtkSmartPointer<vtkInSituPipelinePython> python_;
};

vtkStandardNewMacro(Pipeline);

}  // namespace

struct Engine::State {
  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  Log log;
  vtkSmartPointer<vtkSMSourceProxy> producer;
  std::vector<vtkSmartPointer<Pipeline>> pipelines;

  ~State() {
    producer = nullptr;
    if (vtkInSituInitializationHelper::IsInitialized()) vtkInSituInitializationHelper::Finalize();
  }
  void start(int fortranCommunicator, const std::vector<std::string>& scripts);
};

void Engine::State::start(int fortranCommunicator, const std::vector<std::string>& scripts) {
  using Helper = vtkInSituInitializationHelper;
  if (!Helper::IsPythonSupported()) throw std::runtime_error("this ParaView was built without Python");
  Helper::Initialize(static_cast<vtkTypeUInt64>(fortranCommunicator));
  Log::silenceOtherOutput();
  auto* manager = vtkSMProxyManager::GetProxyManager();
  auto* proxies = manager != nullptr ? manager->GetActiveSessionProxyManager() : nullptr;
  if (proxies == nullptr) throw std::runtime_error("ParaView's in situ engine doesn't start");
  vtkPythonInterpreter::Initialize(0);  // 0: signals stay the simulation's
  if (vtkPythonInterpreter::RunSimpleString(scriptGuard) != 0)
    throw std::runtime_error("ParaView's Python modules can't be imported; is python3-paraview installed?");
  producer.TakeReference(vtkSMSourceProxy::SafeDownCast(proxies->NewProxy("sources", "PVTrivialProducer")));
  producer->UpdateVTKObjects();
  Helper::SetProducer(channel, producer);
  for (const std::string& script : scripts) {
    vtkNew<Pipeline> pipeline;
    pipeline->setScript(script);
    Helper::AddPipeline(pipeline);
    pipelines.emplace_back(pipeline);
  }
}

Engine::Engine(int fortranCommunicator, const std::vector<std::string>& scripts) {
  static std::atomic<bool> started = false;  // what's counted is starts in this process, whoever's they are
  if (vtkInSituInitializationHelper::IsInitialized() || started.exchange(true))
    throw std::runtime_error("ParaView's in situ engine starts only once in a process");
  state_ = std::make_unique<State>();
  state_->start(fortranCommunicator, scripts);
}

Engine::~Engine() = default;

std::optional<std::string> Engine::finish() {
  state_->log.takeFirstError();
  bool good = true;
  for (const auto& pipeline : state_->pipelines) good = pipeline->Finalize() && good;
  std::string error = state_->log.takeFirstError();
  if (good && error.empty()) return std::nullopt;
  return error;
}

std::optional<std::string> Engine::execute(vtkDataObject* grid, std::int64_t step, double time) {
  using Helper = vtkInSituInitializationHelper;
  state_->log.takeFirstError();
  auto* producer = vtkPVTrivialProducer::SafeDownCast(state_->producer->GetClientSideObject());
  producer->SetOutput(grid, time);
  Helper::MarkProducerModified(channel);
  bool good = Helper::ExecutePipelines(static_cast<int>(step), time);
  for (const auto& pipeline : state_->pipelines) good = good && !pipeline->failed();
  std::string error = state_->log.takeFirstError();
  if (good && error.empty()) return std::nullopt;
  return error;
}

}  // namespace vdi::catalyst
