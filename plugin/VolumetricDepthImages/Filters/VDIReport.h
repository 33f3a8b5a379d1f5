// The reports of filters and writers about what they have made.
#ifndef VDIReport_h
#define VDIReport_h

#include <optional>
#include <string>
#include <vector>

#include "VDIRecords.h"
#include "vdi/core/Estimate.h"
#include "vdi/pipeline/Reports.h"

namespace vdi {
class VdiGenerator;
}  // namespace vdi
class vtkAlgorithm;
class vtkImageData;

namespace pv {

/// The reports of a generator's last frame.
struct FrameReports {
  std::vector<vdi::RankReport> ranks;  // empty on ranks other than the root
  std::string device;                  // the name of this rank's
};

FrameReports reportsOf(const vdi::VdiGenerator& generator);
/// Time and memory, one line per rank; empty without reports.
std::string textOf(const FrameReports& reports);
/// Figures of the VDI in the image, which was made with these settings. The next VDI is estimated from them.
/// Nullopt for an image without a VDI, and without reports.
std::optional<vdi::MadeVdi> madeVdiOf(vtkImageData* image, const vdi::GenerateSettings& settings,
                                      const std::vector<vdi::RankReport>& reports);

/// Invoke the events of VDIRecords.h. The second one fills in the filter upstream of the writer.
void noteFrame(FrameMade frame);
void noteOutput(vtkAlgorithm* writer, OutputMade output);

}  // namespace pv

#endif
