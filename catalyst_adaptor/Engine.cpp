// Written against ParaView 5.11: AddPipeline and ExecutePipelines have other signatures from 5.12 on.
#include "catalyst_adaptor/Engine.h"

#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkInSituInitializationHelper.h>
#include <vtkInSituPipeline.h>
#include <vtkInSituPipelinePython.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPVTrivialProducer.h>
#include <vtkSMProxyManager.h>
#include <vtkSMSessionProxyManager.h>
#include <vtkSMSourceProxy.h>

#include <stdexcept>

namespace vdi::catalyst {

namespace {

constexpr const char* channel = "grid";
/// Said by Debian's engine at each step; it concerns steering, which isn't used here.
constexpr const char* harmless = "IOCatalystConduit";

/// A Python pipeline that the engine goes on calling: the engine drops one that has failed once.
class Pipeline : public vtkInSituPipeline {
 public:
  static Pipeline* New();
  vtkTypeMacro(Pipeline, vtkInSituPipeline);

  void setScript(const std::string& script) { script_ = script; }
  /// Of the last step; "" if it went well.
  const std::string& failure() const { return failure_; }

  bool Execute(int step, double time) override {
    failure_.clear();
    if (!python_) {
      python_ = vtkSmartPointer<vtkInSituPipelinePython>::New();
      python_->SetFileName(script_.c_str());
      if (!python_->Initialize()) {
        python_ = nullptr;  // from the start at the next step
        failure_ = "the script " + script_ + " can't be loaded";
        return true;
      }
    }
    if (!python_->Execute(step, time)) {
      failure_ = "the script " + script_ + " failed";
      python_ = nullptr;
    }
    return true;
  }

  bool Finalize() override { return !python_ || python_->Finalize(); }

 private:
  std::string script_;
  std::string failure_;
  vtkSmartPointer<vtkInSituPipelinePython> python_;
};

vtkStandardNewMacro(Pipeline);

}  // namespace

struct Engine::State {
  vtkSmartPointer<vtkSMSourceProxy> producer;
  std::vector<vtkSmartPointer<Pipeline>> pipelines;
  vtkNew<vtkCallbackCommand> listener;
  std::string firstError;

  /// Errors that filters report reach no script: they're taken from VTK's output, where Python's standard
  /// error lands too.
  static void onError(vtkObject*, unsigned long, void* state, void* text) {
    auto& self = *static_cast<State*>(state);
    const std::string message = text != nullptr ? static_cast<const char*>(text) : "";
    const bool reported = message.starts_with("ERROR: In ") && message.find(harmless) == std::string::npos;
    if (!reported || !self.firstError.empty()) return;
    // "ERROR: In FILE, line N", then the text.
    const std::size_t body = message.find('\n');
    self.firstError = body == std::string::npos ? message : message.substr(body + 1);
    while (!self.firstError.empty() && self.firstError.back() == '\n') self.firstError.pop_back();
  }
};

Engine::Engine(int fortranCommunicator, const std::vector<std::string>& scripts)
    : state_(std::make_unique<State>()) {
  using Helper = vtkInSituInitializationHelper;
  if (Helper::IsInitialized())
    throw std::runtime_error("ParaView's in situ engine is in use in this process");
  Helper::Initialize(static_cast<vtkTypeUInt64>(fortranCommunicator));
  if (!Helper::IsInitialized())
    throw std::runtime_error("ParaView's in situ engine can't be started (again)");
  if (!Helper::IsPythonSupported()) throw std::runtime_error("this ParaView was built without Python");
  state_->listener->SetCallback(&State::onError);
  state_->listener->SetClientData(state_.get());
  vtkOutputWindow::GetInstance()->AddObserver(vtkCommand::ErrorEvent, state_->listener);
  auto* proxies = vtkSMProxyManager::GetProxyManager()->GetActiveSessionProxyManager();
  state_->producer.TakeReference(
      vtkSMSourceProxy::SafeDownCast(proxies->NewProxy("sources", "PVTrivialProducer")));
  state_->producer->UpdateVTKObjects();
  Helper::SetProducer(channel, state_->producer);
  for (const std::string& script : scripts) {
    vtkNew<Pipeline> pipeline;
    pipeline->setScript(script);
    Helper::AddPipeline(pipeline);
    state_->pipelines.emplace_back(pipeline);
  }
}

Engine::~Engine() {
  vtkOutputWindow::GetInstance()->RemoveObserver(state_->listener);
  state_->pipelines.clear();
  state_->producer = nullptr;
  vtkInSituInitializationHelper::Finalize();
}

std::string Engine::execute(vtkDataObject* grid, std::int64_t step, double time) {
  using Helper = vtkInSituInitializationHelper;
  state_->firstError.clear();
  auto* producer = vtkPVTrivialProducer::SafeDownCast(state_->producer->GetClientSideObject());
  producer->SetOutput(grid, time);
  Helper::MarkProducerModified(channel);
  const bool good = Helper::ExecutePipelines(static_cast<int>(step), time);
  for (const auto& pipeline : state_->pipelines) {
    if (!pipeline->failure().empty()) return pipeline->failure();
  }
  if (!state_->firstError.empty()) return state_->firstError;
  return good ? "" : "ParaView's in situ engine reports a failure";
}

}  // namespace vdi::catalyst
