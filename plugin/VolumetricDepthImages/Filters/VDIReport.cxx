#include "VDIReport.h"

#include <fmt/format.h>
#include <vtkAlgorithm.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkMultiProcessController.h>

#include <algorithm>
#include <cstdint>

#include "vdi/pipeline/VdiGenerator.h"

namespace pv {

namespace {

void invoke(unsigned long event, void* data) {
  if (auto* controller = vtkMultiProcessController::GetGlobalController())
    controller->InvokeEvent(event, data);
}

}  // namespace

FrameReports reportsOf(const vdi::VdiGenerator& generator) {
  return {.ranks = generator.reports(), .device = generator.device().name()};
}

std::string textOf(const FrameReports& reports) {
  const std::vector<vdi::RankReport>& ranks = reports.ranks;
  if (ranks.empty()) return {};
  std::string text =
      "rank  blocks  volume MiB  upload s  generate s  distribute s  composite s  gather s  sent MiB  device "
      "MiB\n";
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    const vdi::RankReport& r = ranks[i];
    constexpr double mib = 1024.0 * 1024.0;
    text += fmt::format(
        "{:4}  {:6}  {:10.1f}  {:8.3f}  {:10.3f}  {:12.3f}  {:11.3f}  {:8.3f}  {:8.2f}  {:10.1f}\n", i,
        r.blocks, static_cast<double>(r.volumeBytes) / mib, r.uploadSeconds, r.generateSeconds,
        r.distributeSeconds, r.compositeSeconds, r.gatherSeconds, static_cast<double>(r.bytesSent) / mib,
        static_cast<double>(r.deviceBytes) / mib);
  }
  text += fmt::format("samples per voxel: {:g}\n", ranks.front().samplesPerVoxel);
  return text + "device of rank 0: " + reports.device + "\n";
}

std::optional<vdi::MadeVdi> madeVdiOf(vtkImageData* image, const vdi::GenerateSettings& settings,
                                      const std::vector<vdi::RankReport>& reports) {
  vtkFieldData* fields = image->GetFieldData();
  vtkDataArray* offsets = fields->GetArray("VDI.offsets");
  if (offsets == nullptr || reports.empty()) return std::nullopt;
  const vtkIdType lists = offsets->GetNumberOfTuples() - 1;
  vdi::MadeVdi made{.settings = settings,
                    .lists = static_cast<std::uint64_t>(lists),
                    .supersegments = static_cast<std::uint64_t>(offsets->GetTuple1(lists))};
  made.settings.precision =
      fields->GetArray("VDI.codes") != nullptr ? vdi::Precision::Compact : vdi::Precision::Full;
  made.settings.samplesPerVoxel = reports.front().samplesPerVoxel;
  for (const vdi::RankReport& report : reports) {
    made.castSeconds = std::max(made.castSeconds, report.generateSeconds);
    made.listSeconds =
        std::max(made.listSeconds, report.distributeSeconds + report.compositeSeconds + report.gatherSeconds);
  }
  return made;
}

void noteFrame(FrameMade frame) {
  invoke(FrameMade::event, &frame);
}

void noteOutput(vtkAlgorithm* writer, OutputMade output) {
  vtkAlgorithm* upstream = writer;
  while (upstream != nullptr && upstream->IsA("vtkVDIGenerator") == 0)
    upstream = upstream->GetTotalNumberOfInputConnections() > 0 ? upstream->GetInputAlgorithm() : nullptr;
  output.filter = static_cast<vtkObjectBase*>(upstream);
  invoke(OutputMade::event, &output);
}

}  // namespace pv
