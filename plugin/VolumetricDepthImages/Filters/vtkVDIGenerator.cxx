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
#include <vtkObjectFactory.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkScalarsToColors.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "VDIBlocks.h"
#include "VDIFailure.h"
#include "VDIImageData.h"
#include "VDILastVdi.h"
#include "VDILoad.h"
#include "VDIPlace.h"
#include "VDIPreparation.h"
#include "VDIRegeneration.h"
#include "VDIReport.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "VDITransferFunctions.h"
#include "VDIValues.h"
#include "VDIVolume.h"
#include "vdi/core/Blending.h"
#include "vdi/core/Error.h"
#include "vdi/core/SettingsTable.h"
#include "vdi/core/UnitDistance.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIGenerator);

/// The inputs of a frame besides the volume: its viewpoint, colours and settings.
struct vtkVDIGenerator::FrameInputs {
  vdi::Camera Camera;
  vdi::TransferFunction Function;
  vdi::GenerateSettings Settings;
};

struct vtkVDIGenerator::Internals {
  std::shared_ptr<pv::Volumes> Volumes = pv::sharedVolumes();
  std::shared_ptr<pv::Volume> Volume;  // null before the first update; other filters may share it
  std::uint64_t Identity = 0;          // the filter's, from its first volume on; the same on all ranks
  /// Reports of the last VDI or picture. A preparation's thread writes them until it ends.
  std::vector<vdi::RankReport> Reports;
  std::string Device;
  pv::Failure Said;
  /// The range of the default map. It stays that of the first frame while the array stays the same, so that
  /// films don't flicker.
  std::optional<vdi::ScalarRange> FirstRange;
  pv::ArrayChoice FirstChoice;
  pv::Regeneration Regeneration;  // last member, because its thread uses the others

  /// Call it before each frame with the frame's array.
  void NoteChoice(const pv::ArrayChoice& choice) {
    if (this->FirstRange && !(this->FirstChoice == choice)) this->FirstRange.reset();
    this->FirstChoice = choice;
  }
  /// The shown blocks if the volume shows this origin and no later turn changes it; else null.
  std::shared_ptr<const pv::Shown> ShownOf(const pv::Origin& origin) const {
    if (!this->Volume || !this->Volume->targets(origin)) return nullptr;
    std::shared_ptr<const pv::Shown> shown = this->Volume->shown();
    return shown && shown->of == origin ? shown : nullptr;
  }
  void TakeReports(const vdi::VdiGenerator& generator) {
    this->Reports = generator.reports();
    this->Device = generator.device().name();
  }
  pv::Preparation::Make Maker(FrameInputs frame, std::optional<pv::Load> load, const pv::Origin& origin,
                              int step);
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
  // The destructor joins the thread only when other ranks take part.
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  if (regeneration.giveUp() && !regeneration.preparesOnRanks()) pv::retire(std::move(this->Internal));
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

/// Throws vdi::Error if a VDI can't hold this blending.
vdi::Blending vtkVDIGenerator::CurrentBlending() const {
  vdi::Blending blending;
  blending.mode = static_cast<vdi::BlendMode>(this->BlendMode);
  if (blending.mode == vdi::BlendMode::Isosurface) blending.isovalues = this->IsosurfaceValues;
  if (blending.mode != vdi::BlendMode::Composite && !this->PictureOnly)
    throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                     "a VDI holds only composite blending. Choose Composite as Blend Mode, or Picture Only "
                     "(PictureOnly, an advanced property) for a picture of this mode without a VDI");
  return blending;
}

vdi::Region vtkVDIGenerator::CurrentRegion() const {
  vdi::Region region;
  const double* b = this->CroppingBox;
  const bool isSet = std::any_of(b, b + 6, [](double bound) { return bound != 0.0; });
  if (this->Cropping && isSet) region.box = {{b[0], b[2], b[4]}, {b[1], b[3], b[5]}};
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

void vtkVDIGenerator::SetController(vtkMultiProcessController* controller) {
  if (this->Controller == controller) return;
  this->Internal->Regeneration.drop();
  this->UseVolume(nullptr);
  this->Internal->Identity = 0;
  this->Controller = controller;
  this->Modified();
}

vtkMTimeType vtkVDIGenerator::GetMTime() {
  return this->Internal->Regeneration.time(this->CurrentMTime(), this->ServesView());
}

vtkMTimeType vtkVDIGenerator::CurrentMTime() {
  vtkMTimeType time = this->Superclass::GetMTime();
  if (this->LookupTable) time = std::max(time, this->LookupTable->GetMTime());
  if (this->ScalarOpacityFunction) time = std::max(time, this->ScalarOpacityFunction->GetMTime());
  return time;
}

int vtkVDIGenerator::FillInputPortInformation(int, vtkInformation* info) {
  // The input may be any data object. RequestData rejects with a clear message, and a composite data set
  // comes whole instead of leaf by leaf.
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
  // Cell data need a neighbour's cells to interpolate up to the common face. Both blocks have the points on
  // that face.
  int association = vtkDataObject::FIELD_ASSOCIATION_POINTS;
  if (vtkInformation* array = this->GetInputArrayInformation(0)) {
    if (array->Has(vtkDataObject::FIELD_ASSOCIATION()))
      association = array->Get(vtkDataObject::FIELD_ASSOCIATION());
  }
  const int ghosts = ranks > 1 && association == vtkDataObject::FIELD_ASSOCIATION_CELLS ? 1 : 0;
  info->Set(Pipeline::UPDATE_PIECE_NUMBER(), rank);
  info->Set(Pipeline::UPDATE_NUMBER_OF_PIECES(), ranks);
  info->Set(Pipeline::UPDATE_NUMBER_OF_GHOST_LEVELS(), ghosts);
  // Asks for the whole extent. The source splits it and makes this rank's piece of it.
  if (info->Has(Pipeline::WHOLE_EXTENT())) {
    int whole[6];
    info->Get(Pipeline::WHOLE_EXTENT(), whole);
    info->Set(Pipeline::UPDATE_EXTENT(), whole, 6);
  } else {
    info->Remove(Pipeline::UPDATE_EXTENT());  // the picture's, which composite sources would get
  }
  return 1;
}

namespace {

/// Computes the ranges that ParaView asks for after an update. The arrays store them. It takes half a second
/// for a large VDI.
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

/// Sets the output's time to the input's, or removes it.
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

/// Completes the VDI with the facts about its blocks, and moves it to the output.
void giveVdi(vdi::Vdi& vdi, const pv::Shown& shown, const pv::Origin& origin, int step,
             vtkImageData* output) {
  vdi.coloring->array = shown.array;
  vdi.time = origin.time.value_or(0.0);
  vdi.timeStep = static_cast<std::uint64_t>(std::max(step, 0));
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
  const auto start = std::chrono::steady_clock::now();
  vtkDataObject* input = vtkDataObject::GetData(inputs[0]);
  vtkImageData* output = vtkImageData::GetData(outputs);
  output->Initialize();
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  const pv::Origin origin = this->OriginOf(input);
  // On several ranks, a writer asks for another piece of the output that has been made already.
  const bool isMade = regeneration.isMade(origin, this->CurrentMTime()) &&
                      (regeneration.made()->GetNumberOfPoints() > 0 || !this->IsRoot());
  const pv::Regeneration::Last last = regeneration.begin(this->CurrentMTime());
  std::exception_ptr failure;
  try {
    this->Enter();
    if (pv::onAllRanks(this->Controller, isMade)) {
      output->ShallowCopy(regeneration.made());
      setTime(output, origin.time);
      regeneration.keep(last);
      regeneration.answer();
      regeneration.giveUpOther(origin);
      return 1;
    }
    if (this->Defer(input, origin, last.hasFailed, output)) {
      regeneration.keep(last);
      return 1;
    }
    regeneration.answer();
    regeneration.setInPlace(false);
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
  if (failure) return this->EndWithout(failure, output);
  this->Internal->Said.isOver();
  if (const auto made = pv::madeVdiOf(output, this->CurrentSettings(), this->Internal->Reports))
    std::ranges::copy(pv::numbersOf(*made), this->LastVdi);
  regeneration.finish(output, origin, this->CurrentMTime());  // the time has grown: a map has built its table
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  pv::noteFrame({static_cast<vtkObjectBase*>(this), spent.count(), this->Internal->Reports});
  return 1;
}

/// Ends a request without a VDI, and returns RequestData's result.
int vtkVDIGenerator::EndWithout(const std::exception_ptr& failure, vtkImageData* output) {
  output->Initialize();
  if (isCancellation(failure)) {
    // Like ParaView's own filters, this one doesn't try again until something changes.
    this->Internal->Regeneration.cancel();
    this->SetAbortOutput(false);  // or the executive empties the output
    this->KeepEarlier(output);
    return 1;
  }
  this->SayFailure(whatOf(failure));
  return 0;
}

void vtkVDIGenerator::SayFailure(const std::string& what) {
  // Simulations learn from the message that a step has failed, so each step has one.
  const bool isNew = this->Internal->Said.isNew(this, what);
  if (isNew || pv::isWatched(this->Controller)) vtkErrorMacro(<< what);
}

/// If a rank has lost its device, gives up the volume, so that the next one gets another device, and returns
/// true. Collective: with a generator, all ranks fail together, whatever the cause on each.
bool vtkVDIGenerator::DropLostDevice() {
  const std::shared_ptr<pv::Volume> volume = this->Internal->Volume;
  if (!volume || !volume->isMade()) return false;
  {
    pv::Turn turn(*volume);
    turn.await();
    const vdi::VdiGenerator& generator = volume->generator();
    if (!generator.communicator().anyTogether([&] { return generator.device().isLost(); })) return false;
  }
  this->Internal->Regeneration.drop();
  this->UseVolume(nullptr);
  return true;
}

/// After an abort, gives rank 0 the last picture, or an empty one if that has another size.
void vtkVDIGenerator::KeepEarlier(vtkImageData* output) {
  if (!this->IsRoot()) return;
  const auto [width, height] = this->PictureSize();
  vtkImageData* made = this->Internal->Regeneration.made();
  int size[3];
  made->GetDimensions(size);
  if (size[0] == width && size[1] == height) {
    output->ShallowCopy(made);
  } else {
    pv::setPicture(output, nothingOf(width, height), false);
  }
}

bool vtkVDIGenerator::ServesView() const {
  return this->Internal->Regeneration.defersView() && !this->PictureOnly;
}

void vtkVDIGenerator::DeferViews() {
  this->Internal->Regeneration.deferViews(true);
}

void vtkVDIGenerator::DeferNoViews() {
  this->Internal->Regeneration.deferViews(false);
}

void vtkVDIGenerator::BeginView() {
  this->Internal->Regeneration.beginView();
}

void vtkVDIGenerator::EndView() {
  this->Internal->Regeneration.endView();
}

int vtkVDIGenerator::GetOutdated() {
  return this->Internal->Regeneration.asked() ? 1 : 0;
}

/// Gives an earlier output to a view that needn't wait, and notes its request. Returns false if the VDI must
/// be made in place, or has just been prepared. Collective.
bool vtkVDIGenerator::Defer(vtkDataObject* input, const pv::Origin& origin, bool hasFailed,
                            vtkImageData* output) {
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  // Without a map, the colours need the range of the scalars, which is known once they are on the device.
  const bool can =
      this->ServesView() && !hasFailed && !regeneration.isInPlace() && this->LookupTable != nullptr;
  if (!pv::onAllRanks(this->Controller, can)) return false;
  if (!regeneration.isPrepared(origin, this->Controller)) {
    regeneration.giveUp();
  } else if (regeneration.isPreparationDone(this->Controller)) {
    return false;
  }
  if (!this->Ask(input, origin)) return false;
  // Only rank 0 gives a picture. If it has no memory for that, all ranks make the VDI in place.
  bool isGiven = true;
  try {
    this->GiveEarlier(output);
    setTime(output, origin.time);
  } catch (const std::bad_alloc&) {
    isGiven = false;
  }
  if (pv::onAllRanks(this->Controller, isGiven)) return true;
  output->Initialize();
  return false;
}

/// Notes the request that Prepare will fulfil. Returns false for an unusable input; an update in place
/// reports why. Collective.
bool vtkVDIGenerator::Ask(vtkDataObject* input, const pv::Origin& origin) {
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  const std::optional<pv::ViewRequest>& asked = regeneration.asked();
  if (pv::onAllRanks(this->Controller, asked && asked->load.of == origin)) return true;
  regeneration.forgetAsked();
  pv::ViewRequest request;
  bool isGood = true;
  try {
    request.load = pv::loadOf(input, this->GetInputAlgorithm(0, 0), origin);
  } catch (const vdi::Error&) {
    isGood = false;
  }
  if (!pv::onAllRanks(this->Controller, isGood)) return false;
  try {
    request.bounds = pv::complete(request.load, input, this->Controller);
  } catch (const vdi::Error&) {  // thrown on all ranks
    return false;
  }
  regeneration.ask(std::move(request));
  return true;
}

/// Gives a view the last VDI in place of the requested one, in a picture of the announced size. Without a
/// last VDI, it gives an empty picture at the place of the requested one.
void vtkVDIGenerator::GiveEarlier(vtkImageData* output) {
  if (!this->IsRoot()) return;
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  const pv::ViewRequest& asked = *regeneration.asked();
  output->ShallowCopy(regeneration.made());
  const auto [width, height] = this->PictureSize();
  int size[3];
  output->GetDimensions(size);
  if (size[0] != width || size[1] != height) {
    output->GetPointData()->Initialize();
    pv::setPicture(output, nothingOf(width, height), false);
    if (regeneration.made()->GetNumberOfPoints() == 0)
      pv::setBeingMade(output, this->Viewpoint(asked.bounds), asked.bounds);
  }
  // Views colour by the requested array, and fit its map to its range.
  if (output->GetFieldData()->GetAbstractArray(asked.load.array.name.c_str()) == nullptr) {
    const double* range = this->LookupTable->GetRange();
    pv::setShownValues(output, asked.load.array, std::array{range[0], range[1]});
  }
}

void vtkVDIGenerator::AnnounceRange(const char* array, int components, int component, double low,
                                    double high) {
  vtkImageData* output = this->GetOutput();
  if (!this->IsRoot() || output == nullptr) return;
  if (output->GetFieldData()->GetAbstractArray(array) == nullptr) return;
  const vdi::ScalarArray shown{.name = array, .components = components, .component = component};
  pv::setShownValues(output, shown, std::array{low, high});
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

/// Uses the volume in which another filter shows this input, or a volume that can show it. Collective.
void vtkVDIGenerator::ChooseVolume(const pv::Origin& origin) {
  Internals& internal = *this->Internal;
  if (internal.Identity == 0) internal.Identity = pv::newIdentity(this->Controller);
  this->UseVolume(internal.Volumes->choose(this->Controller, origin, internal.Volume, this));
}

/// Shows the input in the volume. The filter must have its turn. Uploads nothing if another filter has done
/// so, or if only the camera or the transfer function has changed. Collective.
void vtkVDIGenerator::ShowBlocks(vtkDataObject* input, const pv::Origin& origin) {
  pv::Volume& volume = *this->Internal->Volume;
  const vdi::comm::Communicator& comm = volume.generator().communicator();
  comm.together([&] { pv::requireInput(input); });
  // The ranks' next steps depend on these values. The generator compares the others.
  comm.requireEqual(std::hash<std::string>()(origin.choice.name), "SelectInputScalars, the array");
  comm.requireEqual(origin.choice.cells ? 1U : 0U, "SelectInputScalars, of points or of cells");
  comm.requireEqual(static_cast<std::uint64_t>(std::int64_t{this->Component}), "Component");
  comm.requireEqual(this->FillGhosts ? 1U : 0U, "FillGhosts");
  comm.requireEqual(this->PictureOnly ? 1U : 0U, "PictureOnly");
  comm.requireEqual(static_cast<std::uint64_t>(this->BlendMode), "BlendMode");
  // Rejects the blend mode before any values are loaded.
  comm.together([&] { static_cast<void>(this->CurrentBlending()); });
  if (!comm.anyTogether([&] { return this->Internal->ShownOf(origin) == nullptr; })) return;
  pv::Load load;
  comm.together([&] { load = pv::loadOf(input, this->GetInputAlgorithm(0, 0), origin); });
  pv::complete(load, input, this->Controller);
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
  // Without values, or with one value everywhere, there is no range to keep.
  const double low = range.min <= range.max ? range.min : 0.0;
  return {low, low + 1.0};
}

vdi::Camera vtkVDIGenerator::Viewpoint(const vdi::Box& bounds) const {
  const auto vector = [](const double* v) { return glm::dvec3(v[0], v[1], v[2]); };
  vdi::Camera camera{vector(this->CameraPosition), vector(this->CameraFocalPoint), vector(this->CameraViewUp),
                     this->CameraViewAngle,        this->CameraParallelProjection, this->CameraParallelScale};
  // vdi::View reports an unusable angle later.
  const bool usable = this->CameraViewAngle > 0.0 && this->CameraViewAngle < 180.0;
  if (camera.position != camera.focalPoint || !usable) return camera;
  camera = vdi::Camera::framing(bounds, {0.0, 0.0, -1.0}, camera.viewUp, camera.viewAngle);
  camera.parallelProjection = this->CameraParallelProjection;
  return camera;
}

/// Enters an update on all ranks. If the ranks' filters don't belong together, all give up their volumes and
/// start anew.
void vtkVDIGenerator::Enter() {
  Internals& internal = *this->Internal;
  const std::string name =
      internal.Identity != 0 ? fmt::format("{:x}", internal.Identity) : std::string("a new one");
  try {
    pv::enterCollective(this->Controller, "VolumetricDepthImage, " + name);
  } catch (const vdi::Error&) {
    internal.Regeneration.drop();
    this->UseVolume(nullptr);
    internal.Identity = 0;
    throw;
  }
}

std::array<int, 2> vtkVDIGenerator::PictureSize() const {
  if (this->Resolution[0] == 0 && this->Resolution[1] == 0) return {1280, 720};
  return {this->Resolution[0], this->Resolution[1]};
}

/// The frame for blocks in these bounds, with the current properties and maps. `range` is that of the default
/// map.
vtkVDIGenerator::FrameInputs vtkVDIGenerator::CurrentFrame(const vdi::Box& bounds, double voxelVolume,
                                                           const vdi::ScalarRange& range) {
  double unit = this->ScalarOpacityUnitDistance;
  if (unit <= 0.0) unit = vdi::unitDistanceOf(bounds, voxelVolume);
  FrameInputs frame{.Camera = this->Viewpoint(bounds),
                    .Function = pv::transferFunctionOf(this->LookupTable, this->ScalarOpacityFunction,
                                                       range.min, range.max, unit),
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

void vtkVDIGenerator::Hold() {
  this->Internal->Regeneration.hold();
}

void vtkVDIGenerator::Release() {
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  const vtkMTimeType time = this->CurrentMTime();
  if (!regeneration.release(time)) return;
  // An update that kept the held output is newer than the edited properties, so it would hide their change.
  this->Modified();
  regeneration.carryOver(time, this->CurrentMTime());
}

int vtkVDIGenerator::GetHeld() {
  return this->Internal->Regeneration.isHeld() ? 1 : 0;
}

int vtkVDIGenerator::GetPreparation() {
  return this->Internal->Regeneration.percent();
}

void vtkVDIGenerator::ServePreparation() {
  constexpr std::chrono::milliseconds most{15};  // the window waits that long
  this->Internal->Regeneration.serve(most);
}

/// Returns the function that a preparation's thread runs. `load` has the blocks of `origin` if the volume
/// doesn't show them yet.
pv::Preparation::Make vtkVDIGenerator::Internals::Maker(FrameInputs frame, std::optional<pv::Load> load,
                                                        const pv::Origin& origin, int step) {
  return [this, frame = std::move(frame), load = std::move(load), origin, step](
             pv::Volume& volume, const vdi::Progress& progress, vtkVDIImageData* output) {
    volume.make();  // does nothing on several ranks, because AskedFrame has done it
    if (load) {
      volume.show(*load);
    } else {
      volume.requireShown(origin);
    }
    this->Reports.clear();
    vdi::VdiGenerator& generator = volume.generator();
    std::optional<vdi::Vdi> vdi = generator.generate(frame.Camera, frame.Function, frame.Settings, progress);
    this->TakeReports(generator);
    if (!vdi) return;  // another rank has it
    giveVdi(*vdi, *volume.shown(), origin, step, output);
    findRanges(output->GetPointData());
    findRanges(output->GetFieldData());
    if (pv::isServer()) output->SetFile(pv::fileOf(*vdi));
  };
}

void vtkVDIGenerator::Prepare() {
  Internals& internal = *this->Internal;
  pv::Regeneration& regeneration = internal.Regeneration;
  regeneration.drop();
  const std::optional<pv::ViewRequest>& asked = regeneration.asked();
  const auto shown = regeneration.madeOf() ? internal.ShownOf(*regeneration.madeOf()) : nullptr;
  bool can = !regeneration.isCurrent(this->CurrentMTime()) && (asked || shown) && !this->PictureOnly;
  FrameInputs frame;
  if (pv::onAllRanks(this->Controller, can)) {
    try {
      frame = asked ? this->AskedFrame() : this->ShownFrame(*shown);
    } catch (const vdi::Error&) {
      can = false;  // the next update reports why
    }
  } else {
    can = false;
  }
  if (!pv::onAllRanks(this->Controller, can)) {
    regeneration.setInPlace(asked.has_value());
    return;
  }
  std::optional<pv::Load> load;  // blocks that the volume doesn't show yet
  if (asked) load = asked->load;
  const pv::Origin origin = load ? load->of : *regeneration.madeOf();
  if (load) internal.Volume->setTarget(origin);
  regeneration.prepare(internal.Volume, origin, this->CurrentMTime(),
                       internal.Maker(std::move(frame), std::move(load), origin, this->TimeStep));
}

/// The frame that a view has asked for. Also chooses its volume. Collective.
vtkVDIGenerator::FrameInputs vtkVDIGenerator::AskedFrame() {
  const pv::ViewRequest& asked = *this->Internal->Regeneration.asked();
  this->ChooseVolume(asked.load.of);
  // A thread must not make a communicator of several ranks.
  if (this->Internal->Volume->hasRanks()) this->Internal->Volume->make();
  this->Internal->NoteChoice(asked.load.of.choice);
  return this->CurrentFrame(asked.bounds, asked.load.voxelVolume, {0.0, 1.0});
}

vtkVDIGenerator::FrameInputs vtkVDIGenerator::ShownFrame(const pv::Shown& shown) {
  return this->CurrentFrame(shown.bounds, shown.voxelVolume, this->StandInRange(shown));
}

/// Ends the use of the volume by this filter's thread. Returns whether the thread has made exactly this
/// output. An update that can't wait for its turn, such as a writer's, waits here. Collective.
bool vtkVDIGenerator::TakePreparation(const pv::Origin& origin, vtkImageData* output) {
  const auto goesOn = [this](double share) {
    this->UpdateProgress(share);
    return !this->CheckAbort();
  };
  if (!this->Internal->Regeneration.take(origin, this->Controller, output, goesOn)) return false;
  if (output->GetNumberOfPoints() > 0) setTime(output, origin.time);
  this->TakeReport();
  return true;
}

void vtkVDIGenerator::TakeReport() {
  this->SetReport(pv::reportOf(this->Internal->Reports, this->Internal->Device).c_str());
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
  internal.Regeneration.dropOther(origin);
  this->ShowBlocks(input, origin);
  this->UpdateProgress(0.1);
  const std::shared_ptr<const pv::Shown> shown = volume.shown();
  const auto [camera, function, settings] = this->ShownFrame(*shown);
  const auto progress = [this](double done) {
    this->UpdateProgress(0.1 + 0.9 * done);
    return !this->CheckAbort();
  };
  std::optional<vdi::Image> picture;
  std::optional<vdi::Vdi> vdi;
  if (this->PictureOnly) {
    picture = generator.renderVolume(camera, function, settings, progress);
  } else {
    vdi = generator.generate(camera, function, settings, progress);
  }
  // Only one rank has the result. If it can't pass that on, all ranks fail.
  generator.communicator().together([&, &from = camera] {
    internal.TakeReports(generator);
    this->TakeReport();
    if (picture) {
      pv::setPicture(output, *picture, true);
      pv::setPlace(output->GetFieldData(), from, shown->bounds);
    }
    if (vdi) giveVdi(*vdi, *shown, origin, this->TimeStep, output);
    if (vdi || this->PictureOnly) setTime(output, origin.time);
  });
}
