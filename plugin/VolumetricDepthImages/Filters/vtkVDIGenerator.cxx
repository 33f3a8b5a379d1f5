#include "vtkVDIGenerator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <vtkCompositeDataSet.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkDataSetAttributes.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiProcessController.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkScalarsToColors.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "VDIArrays.h"
#include "VDIBlocks.h"
#include "VDIFailure.h"
#include "VDIImageData.h"
#include "VDIPlace.h"
#include "VDIPreparation.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "VDITransferFunctions.h"
#include "VDIValues.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIGenerator);

/// What tells one set of blocks from another.
struct vtkVDIGenerator::Origin {
  std::vector<std::uint64_t> Input;  // pv::identityOf
  /// When what makes the input was modified: in situ, arrays are overwritten in place.
  vtkMTimeType Upstream = 0;
  std::optional<double> Time;  // none: the data have none
  pv::ArrayChoice Choice;
  bool FillGhosts = true;
  bool operator==(const Origin&) const = default;
};

/// What a frame of given blocks depends on.
struct vtkVDIGenerator::Frame {
  vdi::Camera Camera;
  vdi::TransferFunction Function;
  vdi::GenerateSettings Settings;
};

struct vtkVDIGenerator::Internals {
  std::unique_ptr<vdi::VdiGenerator> Generator;  // none until the first update
  std::uint64_t Identity = 0;                    // of the generator: the same on all ranks, and no other's
  std::optional<Origin> Shown;                   // by the generator
  /// The last frame failed. Data counts as newer than any output then: left to the executive, rank 0, whose
  /// empty output isn't what was asked for, would try again alone.
  bool Failed = false;
  pv::Failure Said;
  bool Held = false;
  vtkNew<vtkVDIImageData> Made;  // the last output: VTK empties it before it asks for another one
  vtkMTimeType Executed = 0;     // CurrentMTime of the last frame
  double VoxelVolume = 0.0;      // of the smallest voxel of all ranks; 0 without any
  vdi::ScalarArray Array;        // of the generator's blocks
  std::vector<double> Values;    // some of theirs; the root's
  /// Of the map that stands in for none: the first frame's range, kept while the array is the same, or films
  /// would flicker.
  std::optional<vdi::ScalarRange> FirstRange;
  pv::ArrayChoice FirstChoice;
  std::unique_ptr<pv::Preparation> Preparing;  // last: its thread uses the generator; who has one keeps off
};

vtkVDIGenerator::vtkVDIGenerator()
    : Internal(new Internals), Controller(vtkMultiProcessController::GetGlobalController()) {
  this->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS,
                               vtkDataSetAttributes::SCALARS);
}

vtkVDIGenerator::~vtkVDIGenerator() {
  this->SetReport(nullptr);
  // Who deletes the filter waits for the thread only where others' MPI does.
  if (this->GivesUpPreparation() && !this->Internal->Preparing->hasRanks())
    pv::retire(std::move(this->Internal));
}

bool vtkVDIGenerator::IsRoot() const {
  return this->Controller == nullptr || this->Controller->GetLocalProcessId() == 0;
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
     << indent << "Margin: " << this->Margin << "\n"
     << indent << "Supersegments: " << this->Supersegments << "\n"
     << indent << "SamplingRate: " << this->SamplingRate << "\n"
     << indent << "Algorithm: " << this->Algorithm << "\n"
     << indent << "Budget: " << this->Budget << "\n"
     << indent << "Fill: " << this->Fill << "\n"
     << indent << "Precision: " << this->Precision << "\n"
     << indent << "TerminationOpacity: " << this->TerminationOpacity << "\n"
     << indent << "Shade: " << this->Shade << "\n"
     << indent << "Ambient: " << this->Ambient << "\n"
     << indent << "Diffuse: " << this->Diffuse << "\n"
     << indent << "Lights: " << this->Lights.size() << "\n"
     << indent << "Cropping: " << this->Cropping << "\n"
     << indent << "CroppingBox: " << fmt::format("{}", fmt::join(this->CroppingBox, " ")) << "\n"
     << indent << "ClippingPlanes: " << this->ClippingPlanes.size() << "\n"
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

void vtkVDIGenerator::AddLight(double right, double up, double back, double red, double green, double blue) {
  this->Lights.push_back({right, up, back, red, green, blue});
  this->Modified();
}

void vtkVDIGenerator::RemoveAllLights() {
  if (this->Lights.empty()) return;
  this->Lights.clear();
  this->Modified();
}

void vtkVDIGenerator::AddClippingPlane(double originX, double originY, double originZ, double normalX,
                                       double normalY, double normalZ) {
  this->ClippingPlanes.push_back({originX, originY, originZ, normalX, normalY, normalZ});
  this->Modified();
}

void vtkVDIGenerator::RemoveAllClippingPlanes() {
  if (this->ClippingPlanes.empty()) return;
  this->ClippingPlanes.clear();
  this->Modified();
}

vdi::Region vtkVDIGenerator::CurrentRegion() const {
  vdi::Region region;
  const double* b = this->CroppingBox;
  if (this->Cropping) region.box = {{b[0], b[2], b[4]}, {b[1], b[3], b[5]}};
  for (const std::array<double, 6>& plane : this->ClippingPlanes)
    region.planes.push_back({{plane[0], plane[1], plane[2]}, {plane[3], plane[4], plane[5]}});
  return region;
}

vdi::Shading vtkVDIGenerator::CurrentShading() const {
  vdi::Shading shading;
  shading.on = this->Shade;
  shading.ambient = this->Ambient;
  shading.diffuse = this->Diffuse;
  if (!this->Lights.empty()) shading.lights.clear();
  for (const std::array<double, 6>& light : this->Lights)
    shading.lights.push_back({{light[0], light[1], light[2]}, {light[3], light[4], light[5]}});
  return shading;
}

void vtkVDIGenerator::SetController(vtkMultiProcessController* controller) {
  if (this->Controller == controller) return;
  this->Controller = controller;
  this->DropPreparation();
  this->Internal->Generator.reset();
  this->Internal->Shown.reset();
  this->Modified();
}

vtkMTimeType vtkVDIGenerator::GetMTime() {
  if (this->Internal->Held) return this->Internal->Executed;
  if (this->Internal->Failed) this->Modified();
  return this->CurrentMTime();
}

vtkMTimeType vtkVDIGenerator::CurrentMTime() {
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

vtkTypeBool vtkVDIGenerator::ProcessRequest(vtkInformation* request, vtkInformationVector** inputs,
                                            vtkInformationVector* outputs) {
  if (request->Has(vtkDemandDrivenPipeline::REQUEST_DATA_OBJECT())) {
    vtkVDIImageData::MakeOutput(outputs);
    return 1;
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkVDIGenerator::RequestInformation(vtkInformation*, vtkInformationVector**,
                                        vtkInformationVector* outputs) {
  // The other ranks' pictures are empty; announcing that keeps the pipeline from asking them for more again
  // and again.
  const bool root = this->IsRoot();
  const auto [width, height] = this->PictureSize();
  const int extent[6] = {0, root ? width - 1 : -1, 0, root ? height - 1 : -1, 0, root ? 0 : -1};
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
void requireInput(vtkDataObject* input) {
  if (input != nullptr && std::strcmp(input->GetClassName(), "vtkDataObject") != 0) return;
  throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                   "the input has no data; in a Catalyst script, TrivialProducer(registrationName=...) names "
                   "what the simulation hands over, \"grid\" for vdi_catalyst");
}

/// Arrays keep their ranges, which ParaView asks for after an update: half a second for a large VDI.
void findRanges(vtkFieldData* fields) {
  for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = fields->GetArray(i);
    if (array == nullptr) continue;
    const int components = array->GetNumberOfComponents();
    for (int component = components > 1 ? -1 : 0; component < components; ++component) {
      double range[2];
      array->GetRange(range, component);
      array->GetFiniteRange(range, component);
    }
  }
}

/// As the input's: data without a time stay so.
void setTime(vtkImageData* output, std::optional<double> time) {
  if (time) {
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), *time);
  } else {
    output->GetInformation()->Remove(vtkDataObject::DATA_TIME_STEP());
  }
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
  if (!reports.empty()) text += fmt::format("samples per voxel: {:g}\n", reports.front().samplesPerVoxel);
  return text + "device of rank 0: " + device + "\n";
}

}  // namespace

int vtkVDIGenerator::RequestData(vtkInformation*, vtkInformationVector** inputs,
                                 vtkInformationVector* outputs) {
  vtkDataObject* input = vtkDataObject::GetData(inputs[0]);
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  std::optional<double> time;
  if (input != nullptr && input->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP())) {
    time = input->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
  }
  Internals& internal = *this->Internal;
  const Origin origin = this->OriginOf(input, time);
  const bool isOfThis = internal.Shown == origin;
  if (!isOfThis) internal.Made->Initialize();  // no need to have two in memory
  // Who asks for other pieces of it, a writer on several ranks, gets what is there.
  const bool isMade = isOfThis && !internal.Failed &&
                      (internal.Held || internal.Executed == this->CurrentMTime()) &&
                      (internal.Made->GetNumberOfPoints() > 0 || !this->IsRoot());
  const vtkMTimeType executed = std::exchange(internal.Executed, this->CurrentMTime());
  internal.Failed = true;
  try {
    try {
      this->Enter();
      if (pv::onAllRanks(this->Controller, isMade)) {
        output->ShallowCopy(internal.Made);
        setTime(output, time);
        internal.Executed = executed;
        internal.Failed = false;
        return 1;
      }
      this->Generate(input, origin, output);
    } catch (const vdi::Error& error) {
      if (!this->DropLostDevice(error)) throw;
      vtkWarningMacro(<< error.what() << "; trying a new device");
      output->Initialize();
      this->Enter();
      this->Generate(input, origin, output);
    }
  } catch (const vdi::Error& error) {
    output->Initialize();
    if (error.code() == vdi::ErrorCode::Cancelled) {
      // As ParaView's filters: it's not tried again until something changes.
      internal.Failed = false;
      this->SetAbortOutput(false);  // or the executive empties the output
      this->KeepEarlier(output);
      return 1;
    }
    this->DropLostDevice(error);
    this->SayFailure(error);
    return 0;
  } catch (const std::exception& error) {
    output->Initialize();
    this->SayFailure(error);
    return 0;
  }
  internal.Made->ShallowCopy(output);
  internal.Failed = false;
  internal.Said.isOver();
  internal.Executed = this->CurrentMTime();  // a map's table has been built
  return 1;
}

void vtkVDIGenerator::SayFailure(const std::exception& error) {
  // Simulations learn from the message that a step has failed, so each step has one.
  const bool isNew = this->Internal->Said.isNew(this, error.what());
  if (isNew || pv::isWatched(this->Controller)) vtkErrorMacro(<< error.what());
}

/// Whether `error` is that a rank has lost its device: the generators are given up then, and new ones get
/// devices that aren't lost. Collective where there's a generator, for then all ranks have failed together.
bool vtkVDIGenerator::DropLostDevice(const vdi::Error& error) {
  const bool maybe =
      error.code() == vdi::ErrorCode::DeviceFailure || error.code() == vdi::ErrorCode::RemoteRank;
  if (!maybe || !this->Internal->Generator) return false;
  const vdi::VdiGenerator& generator = *this->Internal->Generator;
  if (!generator.communicator().anyTogether([&] { return generator.device().isLost(); })) return false;
  this->DropPreparation();
  this->Internal->Generator.reset();
  this->Internal->Shown.reset();
  return true;
}

/// What an abort leaves on rank 0: the picture that was there, or one that shows nothing.
void vtkVDIGenerator::KeepEarlier(vtkImageData* output) {
  if (!this->IsRoot()) return;
  const auto [width, height] = this->PictureSize();
  int size[3];
  this->Internal->Made->GetDimensions(size);
  if (size[0] == width && size[1] == height) {
    output->ShallowCopy(this->Internal->Made);
  } else {
    vdi::Image nothing{.width = width, .height = height, .rgba = {}, .depth = {}};
    nothing.rgba.resize(nothing.pixelCount());
    pv::setPicture(output, nothing, false);
  }
}

vtkVDIGenerator::Origin vtkVDIGenerator::OriginOf(vtkDataObject* input, std::optional<double> time) {
  Origin origin;
  if (vtkInformation* array = this->GetInputArrayInformation(0)) {
    if (array->Has(vtkDataObject::FIELD_NAME())) origin.Choice.name = array->Get(vtkDataObject::FIELD_NAME());
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
  return origin;
}

/// Only where something changed: another camera or transfer function needs no upload.
void vtkVDIGenerator::ShowBlocks(vtkDataObject* input, const Origin& origin) {
  vdi::VdiGenerator& generator = *this->Internal->Generator;
  const vdi::comm::Communicator& comm = generator.communicator();
  comm.together([&] { requireInput(input); });
  // What the ranks do next depends on these; the generator compares the rest.
  comm.requireEqual(std::hash<std::string>()(origin.Choice.name), "SelectInputScalars, the array");
  comm.requireEqual(origin.Choice.cells ? 1U : 0U, "SelectInputScalars, of points or of cells");
  comm.requireEqual(static_cast<std::uint64_t>(std::int64_t{this->Component}), "Component");
  comm.requireEqual(this->FillGhosts ? 1U : 0U, "FillGhosts");
  comm.requireEqual(this->PictureOnly ? 1U : 0U, "PictureOnly");
  std::array<std::uint64_t, 1> changed{this->Internal->Shown == origin ? 0U : 1U};
  comm.allReduceMax(changed);
  if (changed[0] == 0) return;
  std::vector<vdi::Block> blocks;
  comm.together([&] {
    pv::requireArray(input, this->GetInputAlgorithm(0, 0), origin.Choice);
    blocks = pv::blocksOf(input, origin.Choice);
  });
  // Doubles that aren't negative are ordered as their bits are.
  std::array<std::uint64_t, 2> largest{0, static_cast<std::uint64_t>(pv::componentsOf(input, origin.Choice))};
  for (const vdi::Block& block : blocks) {
    const double volume = block.spacing.x * block.spacing.y * block.spacing.z;
    if (volume > 0.0) largest[0] = std::max(largest[0], vdi::bit_cast<std::uint64_t>(1.0 / volume));
  }
  comm.allReduceMax(largest);
  this->Internal->VoxelVolume = largest[0] > 0 ? 1.0 / vdi::bit_cast<double>(largest[0]) : 0.0;
  const int components = std::max(static_cast<int>(largest[1]), 1);
  this->Internal->Array = {.name = origin.Choice.name,
                           .cells = origin.Choice.cells,
                           .components = components,
                           .component = components > 1 ? origin.Choice.component : 0};
  this->UpdateProgress(0.05);
  this->Internal->Shown.reset();
  const std::vector<vdi::Block> shown = blocks;  // the values are shared
  generator.setBlocks(std::move(blocks), this->FillGhosts);
  this->Internal->Values = pv::sampleOf(shown, generator.scalarRange(), comm);
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
    this->DropPreparation();
    internal.Generator.reset();
    internal.Shown.reset();
    throw;
  }
}

std::array<int, 2> vtkVDIGenerator::PictureSize() const {
  if (this->Resolution[0] == 0 && this->Resolution[1] == 0) return {1280, 720};
  return {this->Resolution[0], this->Resolution[1]};
}

/// Of the generator's blocks and the properties and maps as they are.
vtkVDIGenerator::Frame vtkVDIGenerator::CurrentFrame() {
  const vdi::Box& bounds = this->Internal->Generator->scene().bounds;
  const glm::dvec3 size = bounds.empty() ? glm::dvec3(0.0) : bounds.size();
  double unit = this->ScalarOpacityUnitDistance;
  if (unit <= 0.0) {
    const double volume = size.x * size.y * size.z;
    unit = volume > 0.0 ? glm::length(size) * std::cbrt(this->Internal->VoxelVolume / volume) : 1.0;
  }
  const vdi::ScalarRange range = this->StandInRange();
  Frame frame{.Camera = this->Viewpoint(bounds),
              .Function = pv::transferFunctionOf(this->LookupTable, this->ScalarOpacityFunction, range.min,
                                                 range.max, unit),
              .Settings = {}};
  vdi::GenerateSettings& settings = frame.Settings;
  const auto [width, height] = this->PictureSize();
  settings.width = width;
  settings.height = height;
  settings.margin = this->Margin;
  settings.supersegments = static_cast<std::uint32_t>(std::max(this->Supersegments, 0));
  settings.samplesPerVoxel = this->SamplingRate;
  settings.algorithm = static_cast<vdi::Algorithm>(this->Algorithm);
  settings.budget = static_cast<vdi::Budget>(this->Budget);
  settings.fill = this->Fill;
  settings.precision = static_cast<vdi::Precision>(this->Precision);
  settings.shading = this->CurrentShading();
  settings.region = this->CurrentRegion();
  settings.terminationOpacity = this->PictureOnly
                                    ? std::min(this->TerminationOpacity, vdi::pictureTermination)
                                    : this->TerminationOpacity;
  return frame;
}

void vtkVDIGenerator::Hold() {
  this->Internal->Held = true;
  this->GivesUpPreparation();
}

void vtkVDIGenerator::Release() {
  Internals& internal = *this->Internal;
  internal.Held = false;
  const vtkMTimeType time = this->CurrentMTime();
  if (internal.Executed == time) return;
  // An output that was asked for meanwhile, and stayed as it was, is younger than what was modified.
  this->Modified();
  if (internal.Preparing && internal.Preparing->time() == time)
    internal.Preparing->setTime(this->CurrentMTime());
}

int vtkVDIGenerator::GetHeld() {
  return this->Internal->Held ? 1 : 0;
}

int vtkVDIGenerator::GetPreparation() {
  const auto& preparing = this->Internal->Preparing;
  return preparing ? preparing->percent() : -1;
}

void vtkVDIGenerator::ServePreparation() {
  const auto& preparing = this->Internal->Preparing;
  constexpr std::chrono::milliseconds most{15};  // the window waits for that
  if (preparing && preparing->hasRanks() && !preparing->isDone()) preparing->serve(most);
}

/// Tells the thread that it's unwanted. False where nothing is under way.
bool vtkVDIGenerator::GivesUpPreparation() {
  const auto& preparing = this->Internal->Preparing;
  if (!preparing || preparing->isDone()) return false;
  preparing->giveUp();
  return true;
}

/// Collective.
void vtkVDIGenerator::DropPreparation() {
  this->Internal->Preparing.reset();
}

void vtkVDIGenerator::Prepare() {
  Internals& internal = *this->Internal;
  this->DropPreparation();
  const bool isMade = !internal.Failed && internal.Executed == this->CurrentMTime();
  bool can = !isMade && internal.Generator && internal.Shown && !this->PictureOnly;
  Frame frame;
  try {
    if (can) frame = this->CurrentFrame();
  } catch (const vdi::Error&) {
    can = false;  // said by the update that comes instead
  }
  if (!pv::onAllRanks(this->Controller, can)) return;
  internal.Preparing = std::make_unique<pv::Preparation>(
      this->Controller, this->CurrentMTime(),
      [&internal, frame = std::move(frame), step = std::max(this->TimeStep, 0)](const vdi::Progress& progress,
                                                                                vtkVDIImageData* output) {
        std::optional<vdi::Vdi> vdi =
            internal.Generator->generate(frame.Camera, frame.Function, frame.Settings, progress);
        if (!vdi) return;  // another rank has it
        vdi->time = internal.Shown->Time.value_or(0.0);
        vdi->timeStep = static_cast<std::uint64_t>(step);
        vdi->coloring->array = internal.Array;
        pv::setVdi(output, *vdi);
        pv::setShownValues(output, internal.Array, internal.Values);
        findRanges(output->GetPointData());
        findRanges(output->GetFieldData());
        if (pv::isServer()) output->SetFile(pv::fileOf(*vdi));
      });
}

/// Makes sure that no thread uses the generator. True if `output` is what one has made of just this, for
/// which an update that can't wait for its turn, a writer's, waits here. Collective.
bool vtkVDIGenerator::TakePreparation(const Origin& origin, vtkImageData* output) {
  Internals& internal = *this->Internal;
  const auto& preparing = internal.Preparing;
  if (!preparing) return false;
  const bool isOfThis =
      !preparing->isGivenUp() && preparing->time() == internal.Executed && internal.Shown == origin;
  if (!pv::onAllRanks(this->Controller, isOfThis)) {
    this->DropPreparation();
    return false;
  }
  const pv::Preparation::End end = preparing->wait([&] {
    this->UpdateProgress(preparing->share());
    if (this->CheckAbort()) preparing->giveUp();
  });
  if (end == pv::Preparation::End::GivenUp) {
    this->DropPreparation();
    throw vdi::Error(vdi::ErrorCode::Cancelled, "it was aborted");
  }
  if (end == pv::Preparation::End::Good) {
    output->ShallowCopy(preparing->output());
    this->TakeReport();
    if (output->GetNumberOfPoints() > 0) setTime(output, origin.Time);
  }
  this->DropPreparation();
  return end == pv::Preparation::End::Good;
}

void vtkVDIGenerator::TakeReport() {
  const vdi::VdiGenerator& generator = *this->Internal->Generator;
  this->SetReport(
      generator.reports().empty() ? "" : reportOf(generator.reports(), generator.device().name()).c_str());
}

void vtkVDIGenerator::Generate(vtkDataObject* input, const Origin& origin, vtkImageData* output) {
  if (!this->Internal->Generator) {
    vdi::comm::Communicator comm = pv::communicatorOf(this->Controller);
    std::shared_ptr<vdi::gpu::Device> device;
    comm.together([&] { device = pv::sharedDevice(comm.localRank()); });
    const vdi::GeneratorOptions options = vdi::generatorOptionsFromEnvironment(comm);
    this->Internal->Generator =
        std::make_unique<vdi::VdiGenerator>(std::move(device), std::move(comm), options);
    const auto& own = this->Internal->Generator;
    std::array<std::uint64_t, 1> rootsAddress{
        own->communicator().rank() == 0 ? reinterpret_cast<std::uintptr_t>(own.get()) : 0U};
    own->communicator().allReduceMax(rootsAddress);
    this->Internal->Identity = rootsAddress[0];
  }
  vdi::VdiGenerator& generator = *this->Internal->Generator;
  if (this->TakePreparation(origin, output)) return;
  this->ShowBlocks(input, origin);
  this->UpdateProgress(0.1);
  const auto [camera, function, settings] = this->CurrentFrame();
  const auto progress = [this](double done) {
    this->UpdateProgress(0.1 + 0.9 * done);
    return !this->CheckAbort();
  };
  if (this->PictureOnly) {
    std::optional<vdi::Image> picture = generator.renderVolume(camera, function, settings, progress);
    this->TakeReport();
    if (picture) {
      pv::setPicture(output, *picture, true);
      pv::setPlace(output->GetFieldData(), camera, generator.scene().bounds);
    }
  } else {
    std::optional<vdi::Vdi> vdi = generator.generate(camera, function, settings, progress);
    this->TakeReport();
    if (!vdi) return;
    vdi->time = origin.Time.value_or(0.0);
    vdi->timeStep = static_cast<std::uint64_t>(std::max(this->TimeStep, 0));
    vdi->coloring->array = this->Internal->Array;
    pv::setVdi(output, *vdi);
    pv::setShownValues(output, this->Internal->Array, this->Internal->Values);
  }
  setTime(output, origin.Time);
}
