#include "vtkVDIGenerator.h"

#include <fmt/format.h>
#include <fmt/ranges.h>  // fmt::join
#include <vtkDataObject.h>
#include <vtkDataSetAttributes.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationVector.h>
#include <vtkMultiProcessController.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkScalarsToColors.h>
#include <vtkStreamingDemandDrivenPipeline.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "VDIDefaultRange.h"
#include "VDIFailure.h"
#include "VDIFrameInputs.h"
#include "VDIImageData.h"
#include "VDIInput.h"
#include "VDILastVdi.h"
#include "VDILoad.h"
#include "VDIMaker.h"
#include "VDIOutput.h"
#include "VDIPlace.h"
#include "VDIPreparation.h"
#include "VDIRegeneration.h"
#include "VDIReport.h"
#include "VDIRetire.h"
#include "VDISession.h"
#include "VDIValues.h"
#include "VDIVolume.h"
#include "VDIVolumeUse.h"
#include "vdi/core/Blending.h"
#include "vdi/core/Error.h"
#include "vdi/pipeline/VdiGenerator.h"
#include "vtkVDIImageData.h"

vtkStandardNewMacro(vtkVDIGenerator);

struct vtkVDIGenerator::Internals {
  explicit Internals(std::function<bool(const pv::Origin&)> wants) : Use(std::move(wants)) {}

  pv::VolumeUse Use;
  /// Reports of the last VDI or picture. A preparation's thread writes them until it ends.
  pv::FrameReports Reports;
  pv::LastVdiNumbers Last{};
  pv::Failure Said;
  pv::DefaultRange Range;
  std::pair<vdi::TransferFunction, std::string> Loss;  // the last frame's function, and what it loses
  std::set<std::string> Crowded;                       // arrays whose range was said to be too wide
  pv::Regeneration Regeneration;                       // last member, because its thread uses the others
};

vtkVDIGenerator::vtkVDIGenerator()
    : Internal(new Internals([this](const pv::Origin& origin) {
        return this->GetNumberOfInputConnections(0) > 0 &&
               this->OriginOf(this->GetInputDataObject(0, 0)) == origin;
      })),
      Controller(vtkMultiProcessController::GetGlobalController()) {
  this->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS,
                               vtkDataSetAttributes::SCALARS);
}

vtkVDIGenerator::~vtkVDIGenerator() {
  this->Internal->Use.leave();
  // The destructor joins the thread only when other ranks take part.
  pv::Regeneration& regeneration = this->Internal->Regeneration;
  if (regeneration.giveUp() && !regeneration.preparesOnRanks()) pv::retire(std::move(this->Internal));
}

bool vtkVDIGenerator::IsRoot() const {
  return this->Controller == nullptr || this->Controller->GetLocalProcessId() == 0;
}

double* vtkVDIGenerator::GetLastVdi() {
  static_assert(std::tuple_size_v<pv::LastVdiNumbers> == 18, "the header's size hint is another number");
  return this->Internal->Last.data();
}

void vtkVDIGenerator::SetController(vtkMultiProcessController* controller) {
  if (this->Controller == controller) return;
  this->Internal->Regeneration.drop();
  this->Internal->Use.startAnew();
  this->Controller = controller;
  this->Modified();
}

vtkMTimeType vtkVDIGenerator::GetMTime() {
  return this->Internal->Regeneration.time(this->CurrentMTime(), this->ServesView());
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
  pv::requestPiece(inputs[0]->GetInformationObject(0), this, this->Controller);
  return 1;
}

namespace {

vdi::Image nothingOf(int width, int height) {
  vdi::Image nothing{.width = width, .height = height, .rgba = {}, .depth = {}};
  nothing.rgba.resize(nothing.pixelCount());
  return nothing;
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
  if (pv::RunningUpdate::exists()) {
    if (isMade) return this->GiveMade(origin, output);
    return this->PutOff(output);
  }
  const pv::RunningUpdate running;
  const pv::Regeneration::Last last = regeneration.begin(this->CurrentMTime());
  std::exception_ptr failure;
  try {
    this->Enter();
    if (pv::onAllRanks(this->Controller, isMade)) {
      regeneration.keep(last);
      regeneration.answer();
      regeneration.giveUpOther(origin);
      return this->GiveMade(origin, output);
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
    vtkWarningMacro(<< pv::whatOf(failure) << "; trying a new device");
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
  this->SayCrowded(origin);
  if (const auto made = pv::madeVdiOf(output, this->CurrentSettings(), this->Internal->Reports.ranks))
    this->Internal->Last = pv::numbersOf(*made);
  regeneration.finish(output, origin, this->CurrentMTime());  // the time has grown: a map has built its table
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  pv::noteFrame({static_cast<vtkObjectBase*>(this), spent.count(), this->Internal->Reports.ranks});
  return 1;
}

int vtkVDIGenerator::GiveMade(const pv::Origin& origin, vtkImageData* output) {
  output->ShallowCopy(this->Internal->Regeneration.made());
  pv::setTime(output, origin.time);
  return 1;
}

/// Ends a request that comes in the middle of an update, for which it would wait for ever. Gives the last
/// picture. Observers of PutOffEvent request the VDI again after the update.
int vtkVDIGenerator::PutOff(vtkImageData* output) {
  this->KeepEarlier(output);
  this->Internal->Regeneration.putOff();
  this->InvokeEvent(PutOffEvent);
  return 1;
}

/// Ends a request without a VDI, and returns RequestData's result.
int vtkVDIGenerator::EndWithout(const std::exception_ptr& failure, vtkImageData* output) {
  output->Initialize();
  if (pv::isCancellation(failure)) {
    // Like ParaView's own filters, this one doesn't try again until something changes.
    this->Internal->Regeneration.cancel();
    this->SetAbortOutput(false);  // or the executive empties the output
    this->KeepEarlier(output);
    return 1;
  }
  this->SayFailure(pv::whatOf(failure));
  return 0;
}

void vtkVDIGenerator::SayFailure(const std::string& what) {
  // Simulations learn from the message that a step has failed, so each step has one.
  const bool isNew = this->Internal->Said.isNew(this, what);
  if (isNew || pv::isWatched(this->Controller)) vtkErrorMacro(<< what);
}

/// If a rank has lost its device, gives up the volume, so that the next one gets another device, and returns
/// true. Collective.
bool vtkVDIGenerator::DropLostDevice() {
  if (!this->Internal->Use.hasLostDevice()) return false;
  this->Internal->Regeneration.drop();
  this->Internal->Use.giveUp();
  return true;
}

/// Gives rank 0 the last picture, or an empty one if that has another size.
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
    pv::setTime(output, origin.time);
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
  pv::Origin origin = pv::originOf(input, this, this->Component, this->FillGhosts);
  origin.choice.missing = this->MissingValues;
  origin.choice.nearest = this->Settings[vdi::indexOfSetting("InterpolationType")] ==
                          static_cast<double>(vdi::Interpolation::Nearest);
  return origin;
}

/// Shows the input in the volume. The filter must have its turn. Uploads nothing if another filter has done
/// so, or if only the camera or the transfer function has changed. Collective.
void vtkVDIGenerator::ShowBlocks(vtkDataObject* input, const pv::Origin& origin) {
  pv::Volume& volume = *this->Internal->Use.volume();
  const vdi::comm::Communicator& comm = volume.generator().communicator();
  // The ranks' next steps depend on these values. The generator compares the others.
  comm.requireEqual([&] {
    pv::requireInput(input);
    static_cast<void>(this->CurrentBlending());  // rejects the blend mode before any values are loaded
    return std::vector<vdi::comm::Communicator::Fingerprint>{
        {std::hash<std::string>()(origin.choice.name), "SelectInputScalars, the array"},
        {origin.choice.cells ? 1U : 0U, "SelectInputScalars, of points or of cells"},
        {static_cast<std::uint64_t>(std::int64_t{this->Component}), "Component"},
        {origin.choice.nearest ? 1U : 0U, "InterpolationType"},
        {std::hash<std::string>()(fmt::format("{}", fmt::join(this->MissingValues, " "))), "MissingValues"},
        {this->FillGhosts ? 1U : 0U, "FillGhosts"},
        {this->PictureOnly ? 1U : 0U, "PictureOnly"},
        {static_cast<std::uint64_t>(this->BlendMode), "BlendMode"}};
  });
  if (!comm.anyTogether([&] { return this->Internal->Use.shownOf(origin) == nullptr; })) return;
  pv::Load load;
  comm.together([&] { load = pv::loadOf(input, this->GetInputAlgorithm(0, 0), origin); });
  pv::complete(load, input, this->Controller);
  this->UpdateProgress(0.05);
  volume.setTarget(origin);
  volume.show(load);
}

/// Enters an update on all ranks. If the ranks' filters don't belong together, all give up their volumes and
/// start again.
void vtkVDIGenerator::Enter() {
  Internals& internal = *this->Internal;
  try {
    pv::enterCollective(this->Controller, internal.Use.name());
  } catch (const vdi::Error&) {
    internal.Regeneration.drop();
    internal.Use.startAnew();
    throw;
  }
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

void vtkVDIGenerator::Prepare() {
  Internals& internal = *this->Internal;
  pv::Regeneration& regeneration = internal.Regeneration;
  regeneration.drop();
  const std::optional<pv::ViewRequest>& asked = regeneration.asked();
  const auto shown = regeneration.madeOf() ? internal.Use.shownOf(*regeneration.madeOf()) : nullptr;
  bool can = !regeneration.isCurrent(this->CurrentMTime()) && (asked || shown) && !this->PictureOnly;
  pv::FrameInputs frame;
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
  if (load) internal.Use.volume()->setTarget(origin);
  regeneration.prepare(
      internal.Use.volume(), origin, this->CurrentMTime(),
      pv::makerOf(std::move(frame), std::move(load), origin, this->TimeStep, internal.Reports));
}

/// The frame that a view has asked for. Also chooses its volume. Collective.
pv::FrameInputs vtkVDIGenerator::AskedFrame() {
  const pv::ViewRequest& asked = *this->Internal->Regeneration.asked();
  this->Internal->Use.choose(this->Controller, asked.load.of);
  this->Internal->Use.volume()->connect();
  this->Internal->Range.noteChoice(asked.load.of.choice);
  return this->Announced(
      this->CurrentFrame(asked.bounds, asked.load.voxelVolume, {0.0, 1.0}, asked.load.stretch));
}

pv::FrameInputs vtkVDIGenerator::ShownFrame(const pv::Shown& shown) {
  return this->Announced(this->CurrentFrame(shown.bounds, shown.voxelVolume,
                                            this->Internal->Range.rangeOf(shown), shown.stretch));
}

/// Warns of what the frame's transfer function loses, once for each function.
pv::FrameInputs vtkVDIGenerator::Announced(pv::FrameInputs frame) {
  auto& [function, loss] = this->Internal->Loss;
  if (frame.function == function) return frame;
  function = frame.function;
  const std::string now = vdi::describeLoss(function);
  if (this->IsRoot() && !now.empty() && now != loss) vtkWarningMacro(<< now);
  loss = now;
  return frame;
}

/// Warns, once for each array, that the map spans all of a range of which nearly all values fill a small
/// part.
void vtkVDIGenerator::SayCrowded(const pv::Origin& origin) {
  const std::shared_ptr<const pv::Shown> shown = this->Internal->Use.shownOf(origin);
  if (!this->IsRoot() || !shown || shown->crowded.empty()) return;
  const std::vector<vdi::ColorNode> colors = this->ShownFrame(*shown).function.colors;
  const bool isWhole = colors.front().x == shown->range.min && colors.back().x == shown->range.max;
  const std::string& array = shown->array.name;
  if (isWhole && this->Internal->Crowded.insert(array).second)
    vtkWarningMacro(<< "'" << array << "': " << shown->crowded << " (Missing Values)");
}

/// Ends the use of the volume by this filter's thread. Returns whether the thread has made exactly this
/// output. An update that can't wait for its turn, such as a writer's, waits here. Collective.
bool vtkVDIGenerator::TakePreparation(const pv::Origin& origin, vtkImageData* output) {
  const auto goesOn = [this](double share) {
    this->UpdateProgress(share);
    return !this->CheckAbort();
  };
  if (!this->Internal->Regeneration.take(origin, this->Controller, output, goesOn)) return false;
  if (output->GetNumberOfPoints() > 0) pv::setTime(output, origin.time);
  this->TakeReport();
  return true;
}

void vtkVDIGenerator::TakeReport() {
  this->Report = pv::textOf(this->Internal->Reports);
}

void vtkVDIGenerator::Generate(vtkDataObject* input, const pv::Origin& origin, vtkImageData* output) {
  if (this->TakePreparation(origin, output)) return;
  Internals& internal = *this->Internal;
  internal.Use.choose(this->Controller, origin);
  pv::Volume& volume = *internal.Use.volume();
  pv::Turn turn(volume);
  turn.await();
  volume.connect();
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
    internal.Reports = pv::reportsOf(generator);
    this->TakeReport();
    if (picture) {
      pv::setPicture(output, *picture, true);
      pv::setPlace(output->GetFieldData(), from, shown->bounds);
    }
    if (vdi) pv::giveVdi(*vdi, *shown, origin, this->TimeStep, output);
    if (vdi || this->PictureOnly) pv::setTime(output, origin.time);
  });
}
