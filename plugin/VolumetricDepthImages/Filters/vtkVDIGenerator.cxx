#include "vtkVDIGenerator.h"

#include <fmt/format.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataObject.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPiecewiseFunction.h>
#include <vtkScalarsToColors.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "VDIArrays.h"
#include "VDIBlocks.h"
#include "VDIImageData.h"
#include "VDISession.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/Pipeline.h"

vtkStandardNewMacro(vtkVDIGenerator);

struct vtkVDIGenerator::Internals {
  /// What tells one set of blocks from another.
  struct Origin {
    std::vector<std::uint64_t> Input;  // pv::identityOf
    /// When what makes the input was modified: in situ, arrays are overwritten in place.
    vtkMTimeType Upstream = 0;
    double Time = 0.0;
    pv::ArrayChoice Choice;
    bool FillGhosts = true;
    bool operator==(const Origin&) const = default;
  };

  std::unique_ptr<vdi::VdiGenerator> Generator;  // none until the first update
  std::uint64_t Identity = 0;                    // of the generator: the same on all ranks, and no other's
  std::optional<Origin> Shown;                   // by the generator
  /// The last frame failed. Data counts as newer than any output then: left to the executive, rank 0, whose
  /// empty output isn't what was asked for, would try again alone.
  bool Failed = false;
  /// Of the map that stands in for none: the first frame's range, kept while the array is the same, or films
  /// would flicker.
  std::optional<vdi::ScalarRange> FirstRange;
  pv::ArrayChoice FirstChoice;
};

vtkVDIGenerator::vtkVDIGenerator()
    : Internal(new Internals), Controller(vtkMultiProcessController::GetGlobalController()) {
  this->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS,
                               vtkDataSetAttributes::SCALARS);
}

vtkVDIGenerator::~vtkVDIGenerator() {
  this->SetReport(nullptr);
}

void vtkVDIGenerator::SetReport(const char* text) {
  delete[] this->Report;
  this->Report = nullptr;
  if (text == nullptr) return;
  const std::size_t bytes = std::strlen(text) + 1;
  this->Report = new char[bytes];
  std::memcpy(this->Report, text, bytes);
}

void vtkVDIGenerator::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Resolution: " << this->Resolution[0] << " x " << this->Resolution[1] << "\n"
     << indent << "Supersegments: " << this->Supersegments << "\n"
     << indent << "SamplingRate: " << this->SamplingRate << "\n"
     << indent << "Algorithm: " << this->Algorithm << "\n"
     << indent << "Budget: " << this->Budget << "\n"
     << indent << "Fill: " << this->Fill << "\n"
     << indent << "Precision: " << this->Precision << "\n"
     << indent << "TerminationOpacity: " << this->TerminationOpacity << "\n"
     << indent << "ScalarOpacityUnitDistance: " << this->ScalarOpacityUnitDistance << "\n";
}

void vtkVDIGenerator::SetLookupTable(vtkScalarsToColors* table) {
  if (this->LookupTable == table) return;
  this->LookupTable = table;
  this->Modified();
}

void vtkVDIGenerator::SetScalarOpacityFunction(vtkPiecewiseFunction* function) {
  if (this->ScalarOpacityFunction == function) return;
  this->ScalarOpacityFunction = function;
  this->Modified();
}

void vtkVDIGenerator::SetController(vtkMultiProcessController* controller) {
  if (this->Controller == controller) return;
  this->Controller = controller;
  this->Internal->Generator.reset();
  this->Internal->Shown.reset();
  this->Modified();
}

vtkMTimeType vtkVDIGenerator::GetMTime() {
  if (this->Internal->Failed) this->Modified();
  vtkMTimeType time = this->Superclass::GetMTime();
  if (this->LookupTable) time = std::max(time, this->LookupTable->GetMTime());
  if (this->ScalarOpacityFunction) time = std::max(time, this->ScalarOpacityFunction->GetMTime());
  return time;
}

int vtkVDIGenerator::FillInputPortInformation(int, vtkInformation* info) {
  // Any data object: RequestData says clearly what it can't take, and composite ones come whole instead of
  // leaf by leaf.
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject");
  return 1;
}

int vtkVDIGenerator::RequestInformation(vtkInformation*, vtkInformationVector**,
                                        vtkInformationVector* outputs) {
  // The other ranks' pictures are empty; announcing that keeps the pipeline from asking them for more again
  // and again.
  const bool root = this->Controller == nullptr || this->Controller->GetLocalProcessId() == 0;
  const int extent[6] = {
      0, root ? this->Resolution[0] - 1 : -1, 0, root ? this->Resolution[1] - 1 : -1, 0, root ? 0 : -1};
  vtkInformation* info = outputs->GetInformationObject(0);
  info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
  info->Set(vtkDataObject::SPACING(), 1.0, 1.0, 1.0);
  info->Set(vtkDataObject::ORIGIN(), 0.0, 0.0, 0.0);
  vtkDataObject::SetPointDataActiveScalarInfo(info, VTK_UNSIGNED_CHAR, 4);
  return 1;
}

int vtkVDIGenerator::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs,
                                         vtkInformationVector*) {
  using Pipeline = vtkStreamingDemandDrivenPipeline;
  vtkInformation* info = inputs[0]->GetInformationObject(0);
  const int rank = this->Controller ? this->Controller->GetLocalProcessId() : 0;
  const int ranks = this->Controller ? this->Controller->GetNumberOfProcesses() : 1;
  // Cell data needs a neighbour's cells to interpolate up to the common face; points on the face are both
  // blocks' anyway.
  int association = vtkDataObject::FIELD_ASSOCIATION_POINTS;
  if (vtkInformation* array = this->GetInputArrayInformation(0)) {
    if (array->Has(vtkDataObject::FIELD_ASSOCIATION()))
      association = array->Get(vtkDataObject::FIELD_ASSOCIATION());
  }
  const int ghosts = ranks > 1 && association == vtkDataObject::FIELD_ASSOCIATION_CELLS ? 1 : 0;
  info->Set(Pipeline::UPDATE_PIECE_NUMBER(), rank);
  info->Set(Pipeline::UPDATE_NUMBER_OF_PIECES(), ranks);
  info->Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), ghosts);
  // The whole extent, of which the source makes this rank's piece: it splits the extent that it's asked for.
  if (info->Has(Pipeline::WHOLE_EXTENT())) {
    int whole[6];
    info->Get(Pipeline::WHOLE_EXTENT(), whole);
    info->Set(Pipeline::UPDATE_EXTENT(), whole, 6);
  } else {
    info->Remove(
        Pipeline::UPDATE_EXTENT());  // the picture's, of which a composite's sources would be asked for
  }
  return 1;
}

namespace {

/// In situ, a script's misspelt channel is a source without data.
void demandInput(vtkDataObject* input) {
  if (input != nullptr && std::strcmp(input->GetClassName(), "vtkDataObject") != 0) return;
  throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                   "the input has no data; in a Catalyst script, TrivialProducer(registrationName=...) names "
                   "what the simulation hands over, \"grid\" for vdi_catalyst");
}

std::string reportOf(const std::vector<vdi::RankReport>& reports, const std::string& device) {
  std::string text =
      "rank  blocks  volume MiB  upload s  generate s  distribute s  composite s  gather s  sent MiB  device "
      "MiB\n";
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const vdi::RankReport& r = reports[i];
    constexpr double mib = 1024.0 * 1024.0;
    text += fmt::format(
        "{:4}  {:6}  {:10.1f}  {:8.3f}  {:10.3f}  {:12.3f}  {:11.3f}  {:8.3f}  {:8.2f}  {:10.1f}\n", i,
        r.blocks, static_cast<double>(r.volumeBytes) / mib, r.uploadSeconds, r.generateSeconds,
        r.distributeSeconds, r.compositeSeconds, r.gatherSeconds, static_cast<double>(r.bytesSent) / mib,
        static_cast<double>(r.deviceBytes) / mib);
  }
  return text + "device of rank 0: " + device + "\n";
}

}  // namespace

int vtkVDIGenerator::RequestData(vtkInformation*, vtkInformationVector** inputs,
                                 vtkInformationVector* outputs) {
  vtkDataObject* input = vtkDataObject::GetData(inputs[0]);
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  double time = 0.0;
  if (input != nullptr && input->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP())) {
    time = input->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
  }
  this->Internal->Failed = true;
  try {
    this->Generate(input, time, output);
  } catch (const vdi::Error& error) {
    output->Initialize();
    if (error.code() == vdi::ErrorCode::Cancelled) return 1;
    vtkErrorMacro(<< error.what());
    return 0;
  } catch (const std::exception& error) {
    output->Initialize();
    vtkErrorMacro(<< error.what());
    return 0;
  }
  this->Internal->Failed = false;
  return 1;
}

/// Only where something changed: another camera or transfer function needs no upload.
void vtkVDIGenerator::ShowBlocks(vtkDataObject* input, double time) {
  vdi::VdiGenerator& generator = *this->Internal->Generator;
  const vdi::comm::Communicator& comm = generator.communicator();
  Internals::Origin origin;
  comm.together([&] {
    if (vtkInformation* array = this->GetInputArrayInformation(0)) {
      if (array->Has(vtkDataObject::FIELD_NAME()))
        origin.Choice.name = array->Get(vtkDataObject::FIELD_NAME());
      if (array->Has(vtkDataObject::FIELD_ASSOCIATION())) {
        origin.Choice.cells =
            array->Get(vtkDataObject::FIELD_ASSOCIATION()) == vtkDataObject::FIELD_ASSOCIATION_CELLS;
      }
    }
    origin.Choice.component = this->Component;
    origin.FillGhosts = this->FillGhosts;
    origin.Time = time;
    if (input != nullptr) origin.Input = pv::identityOf(input);
    if (auto* upstream = vtkDemandDrivenPipeline::SafeDownCast(this->GetInputExecutive(0, 0)))
      origin.Upstream = upstream->GetPipelineMTime();
    demandInput(input);
  });
  // What the ranks do next depends on these; the generator compares the rest.
  comm.demandEqual(std::hash<std::string>()(origin.Choice.name), "SelectInputScalars, the array");
  comm.demandEqual(origin.Choice.cells ? 1U : 0U, "SelectInputScalars, of points or of cells");
  comm.demandEqual(static_cast<std::uint64_t>(std::int64_t{this->Component}), "Component");
  comm.demandEqual(this->FillGhosts ? 1U : 0U, "FillGhosts");
  comm.demandEqual(this->PictureOnly ? 1U : 0U, "PictureOnly");
  std::array<std::uint64_t, 1> changed{this->Internal->Shown == origin ? 0U : 1U};
  comm.allReduceMax(changed);
  if (changed[0] == 0) return;
  std::vector<vdi::Block> blocks;
  comm.together([&] {
    pv::demandArray(input, this->GetInputAlgorithm(0, 0), origin.Choice);
    blocks = pv::blocksOf(input, origin.Choice);
  });
  this->UpdateProgress(0.05);
  this->Internal->Shown.reset();
  generator.setBlocks(std::move(blocks), this->FillGhosts);
  this->Internal->Shown = origin;
  if (this->Internal->FirstRange && !(this->Internal->FirstChoice == origin.Choice))
    this->Internal->FirstRange.reset();
  this->Internal->FirstChoice = origin.Choice;
}

vdi::ScalarRange vtkVDIGenerator::StandInRange() {
  Internals& internal = *this->Internal;
  if (internal.FirstRange) return *internal.FirstRange;
  vdi::ScalarRange range = internal.Generator->scalarRange();
  if (range.min < range.max) return *(internal.FirstRange = range);
  // Of nothing, or of one value everywhere: no range to keep.
  const double low = range.min <= range.max ? range.min : 0.0;
  return {low, low + 1.0};
}

vdi::Camera vtkVDIGenerator::Viewpoint(const vdi::Box& bounds) const {
  const auto vector = [](const double* v) { return glm::dvec3(v[0], v[1], v[2]); };
  vdi::Camera camera{vector(this->CameraPosition), vector(this->CameraFocalPoint), vector(this->CameraViewUp),
                     this->CameraViewAngle,        this->CameraParallelProjection, this->CameraParallelScale};
  const bool usable = this->CameraViewAngle > 0.0 && this->CameraViewAngle < 180.0;  // else View says so
  if (camera.position != camera.focalPoint || !usable) return camera;
  camera = vdi::Camera::framing(bounds, {0.0, 0.0, -1.0}, camera.viewUp, camera.viewAngle);
  camera.parallelProjection = this->CameraParallelProjection;
  return camera;
}

/// Where ranks come with generators that don't belong together, these are given up: new ones will.
void vtkVDIGenerator::Enter() {
  Internals& internal = *this->Internal;
  const std::string name = internal.Generator ? fmt::format("{:x}", internal.Identity) : "a new one";
  try {
    pv::enterCollective(this->Controller, "VolumetricDepthImage, " + name);
  } catch (const vdi::Error&) {
    internal.Generator.reset();
    internal.Shown.reset();
    throw;
  }
}

void vtkVDIGenerator::Generate(vtkDataObject* input, double time, vtkImageData* output) {
  this->Enter();
  if (!this->Internal->Generator) {
    vdi::comm::Communicator comm = pv::communicatorOf(this->Controller);
    std::shared_ptr<vdi::gpu::Device> device;
    comm.together([&] { device = pv::sharedDevice(comm.localRank()); });
    this->Internal->Generator = std::make_unique<vdi::VdiGenerator>(std::move(device), std::move(comm));
    const auto& own = this->Internal->Generator;
    std::array<std::uint64_t, 1> rootsAddress{
        own->communicator().rank() == 0 ? reinterpret_cast<std::uintptr_t>(own.get()) : 0U};
    own->communicator().allReduceMax(rootsAddress);
    this->Internal->Identity = rootsAddress[0];
  }
  vdi::VdiGenerator& generator = *this->Internal->Generator;
  this->ShowBlocks(input, time);
  this->UpdateProgress(0.1);

  const vdi::Scene& scene = generator.scene();
  const double diagonal = scene.bounds.empty() ? 1.0 : glm::length(scene.bounds.size());
  const double unit =
      this->ScalarOpacityUnitDistance > 0.0 ? this->ScalarOpacityUnitDistance : 0.01 * diagonal;
  const vdi::ScalarRange range = this->StandInRange();
  const vdi::TransferFunction function =
      pv::transferFunctionOf(this->LookupTable, this->ScalarOpacityFunction, range.min, range.max, unit);
  const vdi::Camera camera = this->Viewpoint(scene.bounds);
  vdi::GenerateSettings settings;
  settings.width = this->Resolution[0];
  settings.height = this->Resolution[1];
  settings.supersegments = static_cast<std::uint32_t>(std::max(this->Supersegments, 0));
  settings.samplesPerVoxel = this->SamplingRate;
  settings.algorithm = static_cast<vdi::Algorithm>(this->Algorithm);
  settings.budget = static_cast<vdi::Budget>(this->Budget);
  settings.fill = this->Fill;
  settings.precision = static_cast<vdi::Precision>(this->Precision);
  settings.terminationOpacity = this->PictureOnly
                                    ? std::min(this->TerminationOpacity, vdi::pictureTermination)
                                    : this->TerminationOpacity;
  const auto progress = [this](double done) {
    this->UpdateProgress(0.1 + 0.9 * done);
    return !this->CheckAbort();
  };
  const auto takeReport = [&] {
    this->SetReport(
        generator.reports().empty() ? "" : reportOf(generator.reports(), generator.device().name()).c_str());
  };
  if (this->PictureOnly) {
    std::optional<vdi::Image> picture = generator.renderVolume(camera, function, settings, progress);
    takeReport();
    if (picture) pv::setPicture(output, *picture, true);
  } else {
    std::optional<vdi::Vdi> vdi = generator.generate(camera, function, settings, progress);
    takeReport();
    if (!vdi) return;
    vdi->time = time;
    vdi->timeStep = static_cast<std::uint64_t>(std::max(this->TimeStep, 0));
    pv::setVdi(output, *vdi);
  }
  output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
}
