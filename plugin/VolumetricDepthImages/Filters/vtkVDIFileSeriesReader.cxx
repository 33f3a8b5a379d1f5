#include "vtkVDIFileSeriesReader.h"

#include <vtkDataObject.h>
#include <vtkFieldData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkStringArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "VDIFileState.h"
#include "VDISession.h"
#include "vdi/core/Error.h"
#include "vdi/io/Metadata.h"
#include "vdi/io/VdiFile.h"
#include "vtkVDIReader.h"

vtkStandardNewMacro(vtkVDIFileSeriesReader);

/// The part of a file's header that the series needs. It consists of numbers only, so that it can be
/// broadcast.
struct vtkVDIFileSeriesReader::Header {
  double IsKnown = 0.0;
  double Time = 0.0;
  double Width = 0.0;
  double Height = 0.0;
  double Viewpoint[12] = {};
};

struct vtkVDIFileSeriesReader::Known {
  struct File {
    std::optional<pv::FileState> State;
    Header Last;
    std::string Coloring;
  };
  std::map<std::string, File> Files;
};

namespace {

std::array<double, 12> numbersOf(const vdi::Camera& camera) {
  const auto& [position, focalPoint, viewUp, viewAngle, parallelProjection, parallelScale] = camera;
  return {position.x,
          position.y,
          position.z,
          focalPoint.x,
          focalPoint.y,
          focalPoint.z,
          viewUp.x,
          viewUp.y,
          viewUp.z,
          viewAngle,
          parallelProjection ? 1.0 : 0.0,
          parallelScale};
}

/// The time at `index` on the line through two known times: those around it, or else the nearest two. With
/// one known time, steps are 1 apart.
double timeBetween(const std::map<std::size_t, double>& known, std::size_t index) {
  auto right = known.lower_bound(index);
  if (right != known.end() && right->first == index) return right->second;
  if (right == known.end()) --right;
  if (right == known.begin() && known.size() > 1) ++right;
  const double at = static_cast<double>(index) - static_cast<double>(right->first);
  if (right == known.begin()) return right->second + at;
  const auto left = std::prev(right);
  const double slope = (right->second - left->second) / static_cast<double>(right->first - left->first);
  return right->second + at * slope;
}

}  // namespace

vtkVDIFileSeriesReader::vtkVDIFileSeriesReader() : Headers(new Known) {}

vtkVDIFileSeriesReader::~vtkVDIFileSeriesReader() = default;

/// Opens only files that have changed. A file that is no longer readable keeps its last header.
std::vector<vtkVDIFileSeriesReader::Header> vtkVDIFileSeriesReader::ReadHeaders() {
  std::vector<Header> headers(this->GetNumberOfFileNames());
  for (std::size_t i = 0; i < headers.size(); ++i) {
    const std::string name = this->GetFileName(static_cast<unsigned int>(i));
    const std::optional<pv::FileState> state = pv::stateOf(name);
    Known::File& file = this->Headers->Files[name];
    if (state && state != file.State) {
      try {
        const vdi::Vdi header = vdi::io::readVdiInfo(name).header;
        file.Last = {.IsKnown = 1.0,
                     .Time = header.time,
                     .Width = static_cast<double>(header.pictureSize().x),
                     .Height = static_cast<double>(header.pictureSize().y)};
        std::ranges::copy(numbersOf(header.camera), file.Last.Viewpoint);
        file.Coloring = header.coloring
                            ? vdi::io::metadataText(*header.coloring, header.time, header.timeStep)
                            : std::string();
        file.State = state;
      } catch (const vdi::Error&) {  // the reader reports it when it reads the file
        file.State.reset();
      }
    }
    headers[i] = file.Last;
    if (this->Coloring.empty()) this->Coloring = file.Coloring;
  }
  return headers;
}

void vtkVDIFileSeriesReader::ShareHeaders(std::vector<Header>& headers) {
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  if (controller == nullptr || controller->GetNumberOfProcesses() == 1) return;
  pv::enterCollective(controller, "times of a VDIReader");
  auto count = static_cast<vtkIdType>(headers.size());
  controller->Broadcast(&count, 1, 0);
  static_assert(sizeof(Header) == 16 * sizeof(double));
  headers.resize(static_cast<std::size_t>(count));
  if (count > 0) controller->Broadcast(&headers[0].IsKnown, 16 * count, 0);
}

int vtkVDIFileSeriesReader::RequestInformation(vtkInformation* request, vtkInformationVector** inputs,
                                               vtkInformationVector* outputs) {
  std::vector<Header> headers;
  try {
    if (pv::isRoot()) headers = this->ReadHeaders();
    this->ShareHeaders(headers);
  } catch (const vdi::Error& error) {
    vtkErrorMacro(<< error.what());
    return 0;
  }
  std::map<std::size_t, double> known;
  const Header* first = nullptr;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    if (headers[i].IsKnown == 0.0) continue;
    known.emplace(i, headers[i].Time);
    if (first == nullptr) first = &headers[i];
  }
  std::ranges::fill(this->Viewpoint, 0.0);
  if (first != nullptr) std::ranges::copy(first->Viewpoint, this->Viewpoint);

  std::set<double> times;
  std::map<std::string, vtkVDIReader::Announced> series;
  const std::size_t count = std::min<std::size_t>(headers.size(), this->GetNumberOfFileNames());
  for (std::size_t i = 0; i < count && first != nullptr; ++i) {
    const Header& shape = headers[i].IsKnown != 0.0 ? headers[i] : *first;
    const double time = timeBetween(known, i);
    times.insert(time);
    series[this->GetFileName(static_cast<unsigned int>(i))] = {
        .Time = time, .Width = static_cast<int>(shape.Width), .Height = static_cast<int>(shape.Height)};
  }
  this->IgnoreReaderTime = times.size() != headers.size();
  if (auto* reader = vtkVDIReader::SafeDownCast(this->Reader)) reader->SetSeries(std::move(series));
  return this->Superclass::RequestInformation(request, inputs, outputs);
}

int vtkVDIFileSeriesReader::RequestData(vtkInformation* request, vtkInformationVector** inputs,
                                        vtkInformationVector* outputs) {
  const int result = this->Superclass::RequestData(request, inputs, outputs);
  if (vtkDataObject* output = vtkDataObject::GetData(outputs)) {
    // Files without times of their own have their indices' times. VTK 9.6 keeps data whose time is the
    // requested one.
    if (this->IgnoreReaderTime != 0)
      output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(),
                                    static_cast<double>(this->GetFileIndex()));
    auto* coloring = vtkStringArray::SafeDownCast(output->GetFieldData()->GetAbstractArray("VDI.coloring"));
    this->Coloring = coloring != nullptr ? coloring->GetValue(0) : std::string();
  }
  const vtkIdType index = this->GetFileIndex();
  const auto count = static_cast<vtkIdType>(this->GetNumberOfFileNames());
  auto* reader = vtkVDIReader::SafeDownCast(this->Reader);
  if (this->LastIndex != index && count > 1) {
    const vtkIdType step = this->LastIndex >= 0 ? (index - this->LastIndex + count) % count : 0;
    const bool goesOn = step != 0 && step == this->LastStep;
    if (goesOn && reader != nullptr)
      reader->Prefetch(this->GetFileName(static_cast<unsigned int>((index + step) % count)));
    this->LastStep = step;
  }
  this->LastIndex = index;
  // The reader has reported the cause. A failure would make the pipeline repeat that in many lines.
  return count > 1 ? 1 : result;
}
