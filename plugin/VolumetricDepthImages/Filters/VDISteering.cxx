#include "VDISteering.h"

#include <fmt/format.h>
#include <vtkMultiProcessController.h>
#include <vtkProcessModule.h>
#include <vtkSMExtractsController.h>
#include <vtkSMPropertyHelper.h>
#include <vtkSMSourceProxy.h>
#include <vtkSMTransferFunctionPresets.h>
#include <vtkSMTransferFunctionProxy.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "VDIParameters.h"
#include "VDISession.h"
#include "vdi/core/Error.h"
#include "vdi/io/Files.h"
#include "vdi/stream/Steering.h"
#include "vtkVDIStreamWriter.h"

namespace pv {

namespace {

using vdi::stream::Controls;
using vdi::stream::Wish;

constexpr std::chrono::milliseconds waitingPause{50};

/// The controller of the ranks if each has a client of its own; null if there is one client.
vtkMultiProcessController* ranksWithClients() {
  auto* const controller = vtkMultiProcessController::GetGlobalController();
  const bool areMany = controller != nullptr && controller->GetNumberOfProcesses() > 1 &&
                       vtkProcessModule::GetProcessModule()->GetSymmetricMPIMode();
  return areMany ? controller : nullptr;
}

bool isFirstRank() {
  auto* const ranks = ranksWithClients();
  return ranks == nullptr || ranks->GetLocalProcessId() == 0;
}

/// The filter that makes this proxy's VDIs; null if there is none.
vtkSMProxy* generatorOf(vtkSMProxy* consumer) {
  constexpr int farthest = 16;
  for (int i = 0; i < farthest && consumer != nullptr; ++i) {
    if (std::string_view(consumer->GetXMLName()) == "VolumetricDepthImage") return consumer;
    consumer = consumer->GetProperty("Input") != nullptr ? vtkSMPropertyHelper(consumer, "Input").GetAsProxy()
                                                         : nullptr;
  }
  return nullptr;
}

/// The names of the offered presets that this ParaView has. ParaView 6 has shorter ones.
std::vector<std::string> offeredPresets() {
  std::vector<std::string> names;
  for (const char* const name :
       {"Cool to Warm (Extended)", "Viridis (matplotlib)", "Viridis", "Inferno (matplotlib)", "Inferno",
        "Plasma (matplotlib)", "Plasma", "Turbo", "Black-Body Radiation", "Rainbow Uniform", "X Ray"}) {
    if (vtkSMTransferFunctionPresets::GetInstance()->HasPreset(name)) names.emplace_back(name);
  }
  return names;
}

vtkSMProxy* functionOf(vtkSMProxy* generator, const char* property) {
  return vtkSMPropertyHelper(generator, property).GetAsProxy();
}

void setNumbers(vtkSMProxy* proxy, const char* property, const glm::dvec3& numbers) {
  const std::array<double, 3> all{numbers.x, numbers.y, numbers.z};
  vtkSMPropertyHelper(proxy, property).Set(all.data(), 3);
}

void setCamera(vtkSMProxy* generator, const vdi::Camera& camera) {
  setNumbers(generator, "CameraPosition", camera.position);
  setNumbers(generator, "CameraFocalPoint", camera.focalPoint);
  setNumbers(generator, "CameraViewUp", camera.viewUp);
  vtkSMPropertyHelper(generator, "CameraParallelProjection").Set(camera.parallelProjection ? 1 : 0);
  if (camera.parallelProjection) {
    vtkSMPropertyHelper(generator, "CameraParallelScale").Set(camera.parallelScale);
  } else {
    vtkSMPropertyHelper(generator, "CameraViewAngle").Set(camera.viewAngle);
  }
}

void setColours(vtkSMProxy* generator, const Wish& wish) {
  vtkSMProxy* const colours = functionOf(generator, "LookupTable");
  if (colours == nullptr) return;  // without colours, viewers aren't offered any
  // A preset changes neither the range nor the opacities.
  constexpr bool toCurrentRange = true;
  if (wish.preset) vtkSMTransferFunctionProxy::ApplyPreset(colours, wish.preset->c_str(), toCurrentRange);
  vtkSMProxy* opacities = functionOf(generator, "ScalarOpacityFunction");
  // Without an opacity function of its own, the filter uses the map's.
  if (opacities == nullptr)
    opacities = vtkSMPropertyHelper(colours, "ScalarOpacityFunction", true).GetAsProxy();
  for (vtkSMProxy* const function : {colours, opacities}) {
    if (function == nullptr) continue;
    if (wish.range)
      vtkSMTransferFunctionProxy::RescaleTransferFunction(function, (*wish.range)[0], (*wish.range)[1]);
    function->UpdateVTKObjects();
  }
}

ParameterExchange exchangeParameters(std::map<std::string, double> changes) {
  ParameterExchange exchange{std::move(changes), {}};
  if (auto* const controller = vtkMultiProcessController::GetGlobalController())
    controller->InvokeEvent(ParameterExchange::event, &exchange);
  return exchange;
}

vdi::stream::GeneratorControls controlsOf(vtkSMProxy* generator) {
  vdi::stream::GeneratorControls controls;
  const vtkSMPropertyHelper resolution(generator, "Resolution");
  controls.resolution = {resolution.GetAsInt(0), resolution.GetAsInt(1)};
  controls.supersegments = vtkSMPropertyHelper(generator, "Supersegments").GetAsInt();
  controls.samplingRate = vtkSMPropertyHelper(generator, "SamplingRate").GetAsDouble();
  std::array<double, 2> range{};
  vtkSMProxy* const colours = functionOf(generator, "LookupTable");
  if (colours != nullptr && vtkSMTransferFunctionProxy::GetRange(colours, range.data()) &&
      range[0] < range[1]) {
    controls.range = range;
    controls.presets = offeredPresets();
  }
  return controls;
}

/// Appends a line. Returns the reason if it fails, and "" otherwise.
std::string appendToLog(const std::string& path, const std::string& line) {
  if (path.empty()) return {};
  try {
    vdi::io::appendLine(path, line);
    return {};
  } catch (const vdi::Error& error) {
    return fmt::format("viewers' changes aren't logged: {}", error.what());
  }
}

/// Returns the first rank's text on all ranks. Collective.
std::string textOnAllRanks(std::string text) {
  auto* const ranks = ranksWithClients();
  if (ranks == nullptr) return text;
  int length = static_cast<int>(text.size());
  ranks->Broadcast(&length, 1, 0);
  text.resize(static_cast<std::size_t>(length));
  if (length > 0) ranks->Broadcast(text.data(), length, 0);
  return text;
}

}  // namespace

bool Steering::isDue() {
  if (++sinceLast_ < period_) return false;
  sinceLast_ = 0;
  return true;
}

void Steering::meet(vtkSMSourceProxy* writer, vtkSMExtractsController* extractor) {
  auto* const server = vtkVDIStreamWriter::SafeDownCast(writer->GetClientSideObject());
  if (server == nullptr)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument, "steering needs a script in the process that serves");
  if (auto* const ranks = ranksWithClients()) enterCollective(ranks, "steering of VDIStream");
  vtkSMProxy* const generator = generatorOf(writer);
  const bool isRoot = isFirstRank();
  std::string trouble;  // reported at the end, when no other rank waits for this one
  if (isRoot) tell(server, generator);
  do {
    const std::chrono::milliseconds patience = isPaused_ ? waitingPause : std::chrono::milliseconds(0);
    std::optional<vdi::stream::SteeringRequest> request;
    if (isRoot) {
      request = server->TakeRequest(patience);
    } else {
      std::this_thread::sleep_for(patience);  // waiting in the broadcast would keep a core busy
    }
    const std::string text = textOnAllRanks(request ? vdi::stream::textOf(request->wish) : "");
    if (text.empty()) continue;
    const Wish wish = vdi::stream::wishOf(text);
    apply(wish, generator);
    if (isRoot) {
      tell(server, generator);
      fmt::print(stderr, "VDIStream: step {}: {} (viewer {})\n", extractor->GetTimeStep(),
                 vdi::stream::summaryOf(wish), request->viewer);
      const std::string failure =
          appendToLog(vtkSMPropertyHelper(writer, "SteeringLog").GetAsString(),
                      vdi::stream::logEntryOf(*request, extractor->GetTimeStep(), extractor->GetTime()));
      if (trouble.empty()) trouble = failure;
    }
    if (!vdi::stream::changesVdi(wish)) continue;
    sinceLast_ = period_;  // a viewer who asks for a change needn't wait for a long period
    if (isPaused_) writer->UpdatePipeline(extractor->GetTime());
  } while (isPaused_);
  if (!trouble.empty()) throw vdi::Error(vdi::ErrorCode::Io, trouble);
}

void Steering::apply(const Wish& wish, vtkSMProxy* generator) {
  if (generator != nullptr && vdi::stream::changesVdi(wish)) {
    if (wish.camera) setCamera(generator, *wish.camera);
    if (wish.resolution) vtkSMPropertyHelper(generator, "Resolution").Set(wish.resolution->data(), 2);
    if (wish.supersegments) vtkSMPropertyHelper(generator, "Supersegments").Set(*wish.supersegments);
    if (wish.samplingRate) vtkSMPropertyHelper(generator, "SamplingRate").Set(*wish.samplingRate);
    setColours(generator, wish);
    if (wish.preset) preset_ = *wish.preset;
    generator->UpdateVTKObjects();
  }
  if (!wish.parameters.empty()) (void)exchangeParameters(wish.parameters);
  period_ = wish.period.value_or(period_);
  isPaused_ = wish.paused.value_or(isPaused_);
}

void Steering::tell(vtkVDIStreamWriter* server, vtkSMProxy* generator) const {
  Controls controls;
  if (generator != nullptr) controls.generator = controlsOf(generator);
  if (controls.generator && controls.generator->range) controls.generator->preset = preset_;
  controls.period = period_;
  controls.paused = isPaused_;
  for (const ParameterExchange::Parameter& one : exchangeParameters({}).parameters)
    controls.parameters.push_back({one.name, one.isWhole, one.value, one.low, one.high});
  server->SetControls(controls);
}

}  // namespace pv
