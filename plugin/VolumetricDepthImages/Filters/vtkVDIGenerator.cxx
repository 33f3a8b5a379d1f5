#include "vtkVDIGenerator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <vtkCommunicator.h>
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
#include <vtkTimeStamp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "VDIArrays.h"
#include "VDIBlocks.h"
#include "VDIFailure.h"
#include "VDIImageData.h"
#include "VDILastVdi.h"
#include "VDIPlace.h"
#include "VDIPreparation.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "VDITransferFunctions.h"
#include "VDIValues.h"
#include "VDIVolume.h"
#include "vdi/core/BitCast.h"
#include "vdi/core/Blending.h"
#include "vdi/core/Error.h"
#include "vdi/core/Scene.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/UnitDistance.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIGenerator);

/// What a frame depends on besides the volume.
struct vtkVDIGenerator::Frame {
  vdi::Camera Camera;
  vdi::TransferFunction Function;
  vdi::GenerateSettings Settings;
};

/// What a view has asked for and hasn't got yet.
struct vtkVDIGenerator::Request {
  pv::Load Load;
  vdi::Box Bounds;  // of all ranks' blocks
};

struct vtkVDIGenerator::Internals {
  std::shared_ptr<pv::Volumes> Volumes = pv::sharedVolumes();
  std::shared_ptr<pv::Volume> Volume;  // none until the first update; other filters may use it, too
  std::uint64_t Identity = 0;          // of the filter, with its first volume: the same on all ranks
  /// Of the last VDI or picture. A preparation's thread writes these until it ends.
  std::vector<vdi::RankReport> Reports;
  std::string Device;
  /// The last frame failed. Data counts as newer than any output then: left to the executive, rank 0, whose
  /// empty output isn't what was asked for, would try again alone.
  bool Failed = false;
  pv::Failure Said;
  bool Held = false;
  vtkNew<vtkVDIImageData> Made;      // the last output: VTK empties it before it asks for another one
  std::optional<pv::Origin> MadeOf;  // where Made is an output
  vtkMTimeType Executed = 0;         // CurrentMTime of the last frame
  bool Defers = false;               // DeferViews
  int Views = 0;                     // of BeginView, without their EndView
  std::optional<Request> Asked;      // by a view, which got an earlier output
  vtkTimeStamp AskedTime;            // of the last EndView by which they got that, or of its replacement
  bool InPlace = false;              // what is asked for can't be prepared
  /// Of the map that stands in for none: the first frame's range, kept while the array is the same, or films
  /// would flicker.
  std::optional<vdi::ScalarRange> FirstRange;
  pv::ArrayChoice FirstChoice;
  std::optional<pv::Origin> PreparedFor;       // what is prepared
  std::unique_ptr<pv::Preparation> Preparing;  // last: its thread uses the others

  /// Views haven't seen yet what replaces an earlier output.
  void Answer() {
    if (!this->Asked) return;
    this->Asked.reset();
    this->AskedTime.Modified();
  }
  /// Before a frame of that array.
  void NoteChoice(const pv::ArrayChoice& choice) {
    if (this->FirstRange && !(this->FirstChoice == choice)) this->FirstRange.reset();
    this->FirstChoice = choice;
  }
  /// What the volume shows, if that is it and no turn that was taken changes it; else null.
  std::shared_ptr<const pv::Shown> ShownOf(const pv::Origin& origin) const {
    if (!this->Volume || !this->Volume->targets(origin)) return nullptr;
    std::shared_ptr<const pv::Shown> shown = this->Volume->shown();
    return shown && shown->of == origin ? shown : nullptr;
  }
  void TakeReports(const vdi::VdiGenerator& generator) {
    this->Reports = generator.reports();
    this->Device = generator.device().name();
  }
};

vtkVDIGenerator::vtkVDIGenerator()
    : Internal(new Internals), Controller(vtkMultiProcessController::GetGlobalController()) {
  this->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS,
                               vtkDataSetAttributes::SCALARS);
  for (const vdi::Setting& setting : vdi::settingsTable())
    this->Settings.push_back(setting.get({.samplesPerVoxel = vdi::automaticRate}));
}

vtkVDIGenerator::~vtkVDIGenerator() {
  this->SetReport(nullptr);
  if (this->Internal->Volume) this->Internal->Volume->leave(this);
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
  os << indent << "Resolution: " << this->Resolution[0] << " x " << this->Resolution[1] << "\n";
  for (std::size_t i = 0; i < this->Settings.size(); ++i) {
    const vdi::Setting& setting = vdi::settingsTable()[i];
    os << indent << setting.property << ": " << this->Settings[i] << "\n";
  }
  os << indent << "Lights: " << this->Lights.size() << "\n"
     << indent << "Cropping: " << this->Cropping << "\n"
     << indent << "CroppingBox: " << fmt::format("{}", fmt::join(this->CroppingBox, " ")) << "\n"
     << indent << "ClippingPlanes: " << this->ClippingPlanes.size() << "\n"
     << indent << "BlendMode: " << this->BlendMode << "\n"
     << indent << "IsosurfaceValues: " << fmt::format("{}", fmt::join(this->IsosurfaceValues, " ")) << "\n"
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

void vtkVDIGenerator::AddIsosurfaceValue(double value) {
  this->IsosurfaceValues.push_back(value);
  this->Modified();
}

void vtkVDIGenerator::RemoveAllIsosurfaceValues() {
  if (this->IsosurfaceValues.empty()) return;
  this->IsosurfaceValues.clear();
  this->Modified();
}

/// Throws vdi::Error where a VDI can't hold it.
vdi::Blending vtkVDIGenerator::CurrentBlending() const {
  vdi::Blending blending;
  blending.mode = static_cast<vdi::BlendMode>(this->BlendMode);
  if (blending.mode == vdi::BlendMode::Isosurface) blending.isovalues = this->IsosurfaceValues;
  if (blending.mode != vdi::BlendMode::Composite && !this->PictureOnly)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                     "a VDI holds composite blending alone. Choose Composite as Blend Mode, or Picture Only "
                     "(PictureOnly) for a picture of this mode without a VDI");
  return blending;
}

vdi::Region vtkVDIGenerator::CurrentRegion() const {
  vdi::Region region;
  const double* b = this->CroppingBox;
  if (this->Cropping) region.box = {{b[0], b[2], b[4]}, {b[1], b[3], b[5]}};
  for (const std::array<double, 6>& plane : this->ClippingPlanes)
    region.planes.push_back({{plane[0], plane[1], plane[2]}, {plane[3], plane[4], plane[5]}});
  return region;
}

void vtkVDIGenerator::SetSetting(const char* property, double value) {
  double& setting = this->Settings[vdi::indexOfSetting(property)];
  if (setting == value) return;
  setting = value;
  this->Modified();
}

double vtkVDIGenerator::GetSetting(const char* property) const {
  return this->Settings[vdi::indexOfSetting(property)];
}

void vtkVDIGenerator::SetController(vtkMultiProcessController* controller) {
  if (this->Controller == controller) return;
  this->DropPreparation();
  this->UseVolume(nullptr);
  this->Internal->Identity = 0;
  this->Controller = controller;
  this->Modified();
}

vtkMTimeType vtkVDIGenerator::GetMTime() {
  const Internals& internal = *this->Internal;
  // What a view has got is good enough for views, until it's replaced, and for nobody else.
  const bool isGoodEnough = internal.Asked && this->ServesView();
  const vtkMTimeType asked = isGoodEnough ? 0 : internal.AskedTime.GetMTime();
  if (internal.Held && (isGoodEnough || !internal.Asked)) return std::max(internal.Executed, asked);
  if (internal.Failed) this->Modified();
  return std::max(this->CurrentMTime(), asked);
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
  const bool root = this->IsRoot();
  const auto [width, height] = this->PictureSize();
  const int extent[6] = {0, root ? width - 1 : -1, 0, root ? height - 1 : -1, 0, root ? 0 : -1};
  pv::announcePicture(outputs->GetInformationObject(0), extent);
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

vdi::Image nothingOf(int width, int height) {
  vdi::Image nothing{.width = width, .height = height, .rgba = {}, .depth = {}};
  nothing.rgba.resize(nothing.pixelCount());
  return nothing;
}

/// How many of the smallest voxels there are in a unit of volume; 0 without any.
double mostPerVolume(const std::vector<vdi::Block>& blocks) {
  double most = 0.0;
  for (const vdi::Block& block : blocks) {
    const double volume = block.spacing.x * block.spacing.y * block.spacing.z;
    if (volume > 0.0) most = std::max(most, 1.0 / volume);
  }
  return most;
}

/// `components`: what the array has on those ranks that have it; 0: on none.
vdi::ScalarArray arrayOf(const pv::ArrayChoice& choice, int components) {
  const int count = std::max(components, 1);
  return {.name = choice.name,
          .cells = choice.cells,
          .components = count,
          .component = count > 1 ? choice.component : 0};
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

/// Gives the output the VDI, in whose coloring the array is missing.
void giveVdi(vdi::Vdi& vdi, const pv::Shown& shown, vtkImageData* output) {
  vdi.coloring->array = shown.array;
  pv::setVdi(output, vdi);
  pv::setShownValues(output, shown.array, shown.values);
}

std::string whatOf(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    return error.what();
  }
}

bool isCancellation(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const vdi::Error& error) {
    return error.code() == vdi::ErrorCode::Cancelled;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace

int vtkVDIGenerator::RequestData(vtkInformation*, vtkInformationVector** inputs,
                                 vtkInformationVector* outputs) {
  vtkDataObject* input = vtkDataObject::GetData(inputs[0]);
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  Internals& internal = *this->Internal;
  const pv::Origin origin = this->OriginOf(input);
  const bool isHeld = internal.Held && !internal.Asked;
  // Who asks for other pieces of it, a writer on several ranks, gets what is there.
  const bool isMade = internal.MadeOf == origin && !internal.Failed &&
                      (isHeld || internal.Executed == this->CurrentMTime()) &&
                      (internal.Made->GetNumberOfPoints() > 0 || !this->IsRoot());
  const vtkMTimeType executed = std::exchange(internal.Executed, this->CurrentMTime());
  const bool hasFailed = std::exchange(internal.Failed, true);
  std::exception_ptr failure;
  try {
    this->Enter();
    if (pv::onAllRanks(this->Controller, isMade)) {
      output->ShallowCopy(internal.Made);
      setTime(output, origin.time);
      internal.Executed = executed;
      internal.Failed = false;
      internal.Answer();
      if (!(internal.PreparedFor == origin)) this->GivesUpPreparation();
      return 1;
    }
    if (this->Defer(input, origin, hasFailed, output)) {
      internal.Executed = executed;
      internal.Failed = false;
      return 1;
    }
    internal.Answer();
    internal.InPlace = false;
    this->Generate(input, origin, output);
  } catch (const std::exception&) {
    failure = std::current_exception();
  }
  if (failure && this->DropLostDevice()) {
    vtkWarningMacro(<< whatOf(failure) << "; trying a new device");
    failure = nullptr;
    try {
      output->Initialize();
      this->Enter();
      this->Generate(input, origin, output);
    } catch (const std::exception&) {
      failure = std::current_exception();
      this->DropLostDevice();
    }
  }
  if (failure) {
    output->Initialize();
    if (isCancellation(failure)) {
      // As ParaView's filters: it's not tried again until something changes.
      internal.Failed = false;
      this->SetAbortOutput(false);  // or the executive empties the output
      this->KeepEarlier(output);
      return 1;
    }
    this->SayFailure(whatOf(failure));
    return 0;
  }
  internal.Made->ShallowCopy(output);
  internal.MadeOf = origin;
  this->NoteMade(output);
  internal.Failed = false;
  internal.Said.isOver();
  internal.Executed = this->CurrentMTime();  // a map's table has been built
  return 1;
}

void vtkVDIGenerator::SayFailure(const std::string& what) {
  // Simulations learn from the message that a step has failed, so each step has one.
  const bool isNew = this->Internal->Said.isNew(this, what);
  if (isNew || pv::isWatched(this->Controller)) vtkErrorMacro(<< what);
}

/// Whether a rank has failed because it has lost its device: the volume is given up then, and the next one
/// gets devices that aren't lost. All ranks fail together where there's a generator, and all must call this
/// then, whatever each of them failed of.
bool vtkVDIGenerator::DropLostDevice() {
  const std::shared_ptr<pv::Volume> volume = this->Internal->Volume;
  if (!volume || !volume->isMade()) return false;
  {
    pv::Turn turn(*volume);
    turn.await();
    const vdi::VdiGenerator& generator = volume->generator();
    if (!generator.communicator().anyTogether([&] { return generator.device().isLost(); })) return false;
  }
  this->DropPreparation();
  this->UseVolume(nullptr);
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
    pv::setPicture(output, nothingOf(width, height), false);
  }
}

bool vtkVDIGenerator::ServesView() const {
  return this->Internal->Views > 0 && this->Internal->Defers && !this->PictureOnly;
}

void vtkVDIGenerator::DeferViews() {
  this->Internal->Defers = true;
}

void vtkVDIGenerator::DeferNoViews() {
  this->Internal->Defers = false;
}

void vtkVDIGenerator::BeginView() {
  ++this->Internal->Views;
}

void vtkVDIGenerator::EndView() {
  --this->Internal->Views;
  if (this->Internal->Asked) this->Internal->AskedTime.Modified();
}

int vtkVDIGenerator::GetOutdated() {
  return this->Internal->Asked ? 1 : 0;
}

/// For a view that needn't wait: gives it an earlier output, and notes what it asks for. False where the VDI
/// is to be made in place, or taken: it has just been prepared. Collective.
bool vtkVDIGenerator::Defer(vtkDataObject* input, const pv::Origin& origin, bool hasFailed,
                            vtkImageData* output) {
  Internals& internal = *this->Internal;
  // Without a map the colours need the range of the scalars, which is known once they're on the device.
  const bool can = this->ServesView() && !hasFailed && !internal.InPlace && this->LookupTable != nullptr;
  if (!pv::onAllRanks(this->Controller, can)) return false;
  const auto& preparing = internal.Preparing;
  if (pv::onAllRanks(this->Controller, this->IsPrepared(origin))) {
    if (!pv::onAllRanks(this->Controller, !preparing->isDone())) return false;
  } else {
    this->GivesUpPreparation();
  }
  if (!this->Ask(input, origin)) return false;
  this->GiveEarlier(output);
  setTime(output, origin.time);
  return true;
}

/// Notes what Prepare is to make. False where the input is no good, which an update in place says.
/// Collective.
bool vtkVDIGenerator::Ask(vtkDataObject* input, const pv::Origin& origin) {
  Internals& internal = *this->Internal;
  const bool isAsked = internal.Asked && internal.Asked->Load.of == origin;
  if (pv::onAllRanks(this->Controller, isAsked)) return true;
  internal.Asked.reset();
  Request request{.Load = {.of = origin, .blocks = {}, .array = {}}, .Bounds = {}};
  bool isGood = true;
  try {
    requireInput(input);
    pv::requireArray(input, this->GetInputAlgorithm(0, 0), origin.choice);
    request.Load.blocks = pv::blocksOf(input, origin.choice);
  } catch (const vdi::Error&) {
    isGood = false;
  }
  if (!pv::onAllRanks(this->Controller, isGood)) return false;
  const vdi::Box own = vdi::localScene(request.Load.blocks).bounds;
  const double components = pv::componentsOf(input, origin.choice);
  std::array<double, 8> least{own.lo.x,  own.lo.y,  own.lo.z,    -own.hi.x,
                              -own.hi.y, -own.hi.z, -components, -mostPerVolume(request.Load.blocks)};
  if (this->Controller != nullptr && this->Controller->GetNumberOfProcesses() > 1) {
    const std::array<double, 8> mine = least;
    this->Controller->AllReduce(mine.data(), least.data(), static_cast<vtkIdType>(least.size()),
                                vtkCommunicator::MIN_OP);
  }
  request.Bounds = {{least[0], least[1], least[2]}, {-least[3], -least[4], -least[5]}};
  request.Load.array = arrayOf(origin.choice, static_cast<int>(-least[6]));
  request.Load.voxelVolume = least[7] < 0.0 ? -1.0 / least[7] : 0.0;
  internal.Asked = std::move(request);
  return true;
}

/// What views get instead of what isn't made yet: the VDI that was made last, in a picture of the announced
/// size; without one, nothing, at its place.
void vtkVDIGenerator::GiveEarlier(vtkImageData* output) {
  if (!this->IsRoot()) return;
  const Internals& internal = *this->Internal;
  const Request& asked = *internal.Asked;
  output->ShallowCopy(internal.Made);
  const auto [width, height] = this->PictureSize();
  int size[3];
  output->GetDimensions(size);
  if (size[0] != width || size[1] != height) {
    output->GetPointData()->Initialize();
    pv::setPicture(output, nothingOf(width, height), false);
    if (internal.Made->GetNumberOfPoints() == 0)
      pv::setBeingMade(output, this->Viewpoint(asked.Bounds), asked.Bounds);
  }
  // Views colour by the array that they ask for, and adapt its map to its range.
  if (output->GetFieldData()->GetAbstractArray(asked.Load.array.name.c_str()) == nullptr) {
    const double* range = this->LookupTable->GetRange();
    pv::setShownValues(output, asked.Load.array, std::array{range[0], range[1]});
  }
}

pv::Origin vtkVDIGenerator::OriginOf(vtkDataObject* input) {
  pv::Origin origin;
  if (vtkInformation* array = this->GetInputArrayInformation(0)) {
    if (array->Has(vtkDataObject::FIELD_NAME())) origin.choice.name = array->Get(vtkDataObject::FIELD_NAME());
    if (array->Has(vtkDataObject::FIELD_ASSOCIATION())) {
      origin.choice.cells =
          array->Get(vtkDataObject::FIELD_ASSOCIATION()) == vtkDataObject::FIELD_ASSOCIATION_CELLS;
    }
  }
  origin.choice.component = this->Component;
  origin.fillGhosts = this->FillGhosts;
  if (input != nullptr) {
    if (input->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
      origin.time = input->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
    origin.input = pv::identityOf(input);
  }
  if (auto* upstream = vtkDemandDrivenPipeline::SafeDownCast(this->GetInputExecutive(0, 0)))
    origin.upstream = upstream->GetPipelineMTime();
  return origin;
}

void vtkVDIGenerator::UseVolume(const std::shared_ptr<pv::Volume>& volume) {
  std::shared_ptr<pv::Volume>& own = this->Internal->Volume;
  if (own == volume) return;
  if (own) own->leave(this);
  own = volume;
  if (!own) return;
  own->join(this, [this](const pv::Origin& origin) {
    return this->GetNumberOfInputConnections(0) > 0 &&
           this->OriginOf(this->GetInputDataObject(0, 0)) == origin;
  });
}

/// Takes the volume that shows this input to another filter, or one that can show it. Collective.
void vtkVDIGenerator::ChooseVolume(const pv::Origin& origin) {
  Internals& internal = *this->Internal;
  if (internal.Identity == 0) internal.Identity = pv::newIdentity(this->Controller);
  this->UseVolume(internal.Volumes->choose(this->Controller, origin, internal.Volume, this));
}

/// Shows the input in the volume, of which the filter has the turn. Where another filter has done so, or only
/// the camera or the transfer function has changed, nothing is uploaded. Collective.
void vtkVDIGenerator::ShowBlocks(vtkDataObject* input, const pv::Origin& origin) {
  pv::Volume& volume = *this->Internal->Volume;
  const vdi::comm::Communicator& comm = volume.generator().communicator();
  comm.together([&] { requireInput(input); });
  // What the ranks do next depends on these; the generator compares the rest.
  comm.requireEqual(std::hash<std::string>()(origin.choice.name), "SelectInputScalars, the array");
  comm.requireEqual(origin.choice.cells ? 1U : 0U, "SelectInputScalars, of points or of cells");
  comm.requireEqual(static_cast<std::uint64_t>(std::int64_t{this->Component}), "Component");
  comm.requireEqual(this->FillGhosts ? 1U : 0U, "FillGhosts");
  comm.requireEqual(this->PictureOnly ? 1U : 0U, "PictureOnly");
  comm.requireEqual(static_cast<std::uint64_t>(this->BlendMode), "BlendMode");
  comm.together([&] { static_cast<void>(this->CurrentBlending()); });  // before values are loaded in vain
  if (!comm.anyTogether([&] { return this->Internal->ShownOf(origin) == nullptr; })) return;
  pv::Load load{.of = origin, .blocks = {}, .array = {}};
  comm.together([&] {
    pv::requireArray(input, this->GetInputAlgorithm(0, 0), origin.choice);
    load.blocks = pv::blocksOf(input, origin.choice);
  });
  // Doubles that aren't negative are ordered as their bits are.
  std::array<std::uint64_t, 2> largest{vdi::bit_cast<std::uint64_t>(mostPerVolume(load.blocks)),
                                       static_cast<std::uint64_t>(pv::componentsOf(input, origin.choice))};
  comm.allReduceMax(largest);
  load.voxelVolume = largest[0] > 0 ? 1.0 / vdi::bit_cast<double>(largest[0]) : 0.0;
  load.array = arrayOf(origin.choice, static_cast<int>(largest[1]));
  this->UpdateProgress(0.05);
  volume.setTarget(origin);
  volume.show(load);
}

vdi::ScalarRange vtkVDIGenerator::StandInRange(const pv::Shown& shown) {
  Internals& internal = *this->Internal;
  internal.NoteChoice(shown.of.choice);
  if (internal.FirstRange) return *internal.FirstRange;
  const vdi::ScalarRange range = shown.range;
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

/// Where ranks come with filters that don't belong together, they give up their volumes and start anew.
void vtkVDIGenerator::Enter() {
  Internals& internal = *this->Internal;
  const std::string name =
      internal.Identity != 0 ? fmt::format("{:x}", internal.Identity) : std::string("a new one");
  try {
    pv::enterCollective(this->Controller, "VolumetricDepthImage, " + name);
  } catch (const vdi::Error&) {
    this->DropPreparation();
    this->UseVolume(nullptr);
    internal.Identity = 0;
    throw;
  }
}

std::array<int, 2> vtkVDIGenerator::PictureSize() const {
  if (this->Resolution[0] == 0 && this->Resolution[1] == 0) return {1280, 720};
  return {this->Resolution[0], this->Resolution[1]};
}

/// Of blocks in these bounds and the properties and maps as they are. `range`: of the map that stands in for
/// none.
vtkVDIGenerator::Frame vtkVDIGenerator::CurrentFrame(const vdi::Box& bounds, double voxelVolume,
                                                     const vdi::ScalarRange& range) {
  double unit = this->ScalarOpacityUnitDistance;
  if (unit <= 0.0) unit = vdi::unitDistanceOf(bounds, voxelVolume);
  Frame frame{.Camera = this->Viewpoint(bounds),
              .Function = pv::transferFunctionOf(this->LookupTable, this->ScalarOpacityFunction, range.min,
                                                 range.max, unit),
              .Settings = this->CurrentSettings()};
  return frame;
}

vdi::GenerateSettings vtkVDIGenerator::CurrentSettings() const {
  vdi::GenerateSettings settings;
  const auto [width, height] = this->PictureSize();
  settings.width = width;
  settings.height = height;
  for (std::size_t i = 0; i < this->Settings.size(); ++i)
    vdi::settingsTable()[i].put(settings, this->Settings[i]);
  if (!this->Lights.empty()) settings.shading.lights.clear();
  for (const std::array<double, 6>& light : this->Lights)
    settings.shading.lights.push_back({{light[0], light[1], light[2]}, {light[3], light[4], light[5]}});
  settings.region = this->CurrentRegion();
  settings.blending = this->CurrentBlending();
  if (this->PictureOnly)
    settings.terminationOpacity = std::min(settings.terminationOpacity, vdi::pictureTermination);
  return settings;
}

/// For the estimate of the next one. The properties are as they were when it was made.
void vtkVDIGenerator::NoteMade(vtkImageData* output) {
  vtkFieldData* fields = output->GetFieldData();
  vtkDataArray* offsets = fields->GetArray("VDI.offsets");
  const std::vector<vdi::RankReport>& reports = this->Internal->Reports;
  if (offsets == nullptr || reports.empty()) return;
  const vtkIdType lists = offsets->GetNumberOfTuples() - 1;
  vdi::MadeVdi made{.settings = this->CurrentSettings(),
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
  std::ranges::copy(pv::numbersOf(made), this->LastVdi);
}

void vtkVDIGenerator::Hold() {
  this->Internal->Held = true;
  this->GivesUpPreparation();
}

void vtkVDIGenerator::Release() {
  Internals& internal = *this->Internal;
  internal.Held = false;
  const vtkMTimeType time = this->CurrentMTime();
  if (internal.Executed == time && !internal.Asked) return;
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

/// Whether what is under way, or there, is what the update asks for.
bool vtkVDIGenerator::IsPrepared(const pv::Origin& origin) const {
  const Internals& internal = *this->Internal;
  return internal.Preparing && !internal.Preparing->isGivenUp() &&
         internal.Preparing->time() == internal.Executed && internal.PreparedFor == origin;
}

void vtkVDIGenerator::Prepare() {
  Internals& internal = *this->Internal;
  this->DropPreparation();
  const bool isMade = !internal.Failed && internal.Executed == this->CurrentMTime() && !internal.Asked;
  const auto shown = internal.MadeOf ? internal.ShownOf(*internal.MadeOf) : nullptr;
  bool can = !isMade && (internal.Asked || shown) && !this->PictureOnly;
  Frame frame;
  if (pv::onAllRanks(this->Controller, can)) {
    try {
      frame = internal.Asked ? this->AskedFrame() : this->ShownFrame(*shown);
    } catch (const vdi::Error&) {
      can = false;  // said by the update that comes instead
    }
  } else {
    can = false;
  }
  if (!pv::onAllRanks(this->Controller, can)) {
    internal.InPlace = internal.Asked.has_value();
    return;
  }
  std::optional<pv::Load> load;  // of other blocks than the volume's
  if (internal.Asked) load = internal.Asked->Load;
  internal.PreparedFor = load ? load->of : *internal.MadeOf;
  if (load) internal.Volume->setTarget(load->of);
  internal.Preparing = std::make_unique<pv::Preparation>(
      internal.Volume, this->CurrentMTime(),
      [&internal, frame = std::move(frame), load = std::move(load), of = *internal.PreparedFor,
       step = std::max(this->TimeStep, 0)](pv::Volume& volume, const vdi::Progress& progress,
                                           vtkVDIImageData* output) {
        volume.make();  // alone: several ranks have it
        if (load) {
          volume.show(*load);
        } else {
          volume.requireShown(of);
        }
        internal.Reports.clear();
        vdi::VdiGenerator& generator = volume.generator();
        std::optional<vdi::Vdi> vdi =
            generator.generate(frame.Camera, frame.Function, frame.Settings, progress);
        internal.TakeReports(generator);
        if (!vdi) return;  // another rank has it
        vdi->time = of.time.value_or(0.0);
        vdi->timeStep = static_cast<std::uint64_t>(step);
        giveVdi(*vdi, *volume.shown(), output);
        findRanges(output->GetPointData());
        findRanges(output->GetFieldData());
        if (pv::isServer()) output->SetFile(pv::fileOf(*vdi));
      });
}

/// Of what a view has asked for, whose volume it chooses. Collective.
vtkVDIGenerator::Frame vtkVDIGenerator::AskedFrame() {
  const Request& asked = *this->Internal->Asked;
  this->ChooseVolume(asked.Load.of);
  // A thread must not make a communicator of several ranks.
  if (this->Internal->Volume->hasRanks()) this->Internal->Volume->make();
  this->Internal->NoteChoice(asked.Load.of.choice);
  return this->CurrentFrame(asked.Bounds, asked.Load.voxelVolume, {0.0, 1.0});
}

vtkVDIGenerator::Frame vtkVDIGenerator::ShownFrame(const pv::Shown& shown) {
  return this->CurrentFrame(shown.bounds, shown.voxelVolume, this->StandInRange(shown));
}

/// Makes sure that no thread of this filter uses the volume. True if `output` is what one has made of just
/// this, for which an update that can't wait for its turn, a writer's, waits here. Collective.
bool vtkVDIGenerator::TakePreparation(const pv::Origin& origin, vtkImageData* output) {
  Internals& internal = *this->Internal;
  const auto& preparing = internal.Preparing;
  if (!preparing) return false;
  if (!pv::onAllRanks(this->Controller, this->IsPrepared(origin))) {
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
  const bool isGood = end == pv::Preparation::End::Good;
  if (isGood) {
    output->ShallowCopy(preparing->output());
    if (output->GetNumberOfPoints() > 0) setTime(output, origin.time);
  }
  this->DropPreparation();
  if (isGood) this->TakeReport();
  return isGood;
}

void vtkVDIGenerator::TakeReport() {
  const Internals& internal = *this->Internal;
  this->SetReport(internal.Reports.empty() ? "" : reportOf(internal.Reports, internal.Device).c_str());
}

void vtkVDIGenerator::Generate(vtkDataObject* input, const pv::Origin& origin, vtkImageData* output) {
  if (this->TakePreparation(origin, output)) return;
  Internals& internal = *this->Internal;
  this->ChooseVolume(origin);
  pv::Volume& volume = *internal.Volume;
  pv::Turn turn(volume);
  turn.await();
  volume.make();
  vdi::VdiGenerator& generator = volume.generator();
  if (!(internal.MadeOf == origin)) {
    internal.Made->Initialize();  // no need to have two in memory
    internal.MadeOf.reset();
  }
  this->ShowBlocks(input, origin);
  this->UpdateProgress(0.1);
  const std::shared_ptr<const pv::Shown> shown = volume.shown();
  const auto [camera, function, settings] = this->ShownFrame(*shown);
  const auto progress = [this](double done) {
    this->UpdateProgress(0.1 + 0.9 * done);
    return !this->CheckAbort();
  };
  const auto takeReport = [&] {
    internal.TakeReports(generator);
    this->TakeReport();
  };
  if (this->PictureOnly) {
    std::optional<vdi::Image> picture = generator.renderVolume(camera, function, settings, progress);
    takeReport();
    if (picture) {
      pv::setPicture(output, *picture, true);
      pv::setPlace(output->GetFieldData(), camera, shown->bounds);
    }
  } else {
    std::optional<vdi::Vdi> vdi = generator.generate(camera, function, settings, progress);
    takeReport();
    if (!vdi) return;
    vdi->time = origin.time.value_or(0.0);
    vdi->timeStep = static_cast<std::uint64_t>(std::max(this->TimeStep, 0));
    giveVdi(*vdi, *shown, output);
  }
  setTime(output, origin.time);
}
