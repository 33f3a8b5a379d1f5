#include "VDIVolume.h"

#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>
#include <vtkTimeStamp.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "VDISession.h"
#include "VDIValues.h"
#include "vdi/core/Error.h"
#include "vdi/core/SamplingRate.h"

namespace pv {

namespace {

constexpr std::chrono::milliseconds patience{10};

bool isAlone(vtkMultiProcessController* controller) {
  return controller == nullptr || controller->GetNumberOfProcesses() == 1;
}

/// Collective: the first of rank 0's volumes that every rank has among its own; null if there is none.
std::shared_ptr<Volume> firstOfAll(vtkMultiProcessController* controller,
                                   const std::vector<std::shared_ptr<Volume>>& mine) {
  if (isAlone(controller)) return mine.empty() ? nullptr : mine.front();
  std::vector<unsigned long long> identities;
  identities.reserve(mine.size());
  for (const std::shared_ptr<Volume>& volume : mine) identities.push_back(volume->identity());
  unsigned long long count = identities.size();
  controller->Broadcast(&count, 1, 0);
  if (count == 0) return nullptr;
  identities.resize(count);
  controller->Broadcast(identities.data(), static_cast<vtkIdType>(count), 0);
  const auto find = [&](unsigned long long identity) {
    return std::ranges::find(mine, identity, [](const auto& volume) { return volume->identity(); });
  };
  std::vector<int> here;
  here.reserve(count);
  for (const unsigned long long identity : identities) here.push_back(find(identity) != mine.end() ? 1 : 0);
  std::vector<int> everywhere(count);
  controller->AllReduce(here.data(), everywhere.data(), static_cast<vtkIdType>(count),
                        vtkCommunicator::MIN_OP);
  const auto first = std::ranges::find(everywhere, 1);
  if (first == everywhere.end()) return nullptr;
  return *find(identities[static_cast<std::size_t>(first - everywhere.begin())]);
}

/// Collective: refuses blocks without a volume. A VDI of them would be empty, and look like a failure.
void requireVolume(const vdi::VdiGenerator& generator, const Load& load) {
  if (!generator.scene().bounds.empty()) return;
  if (!generator.communicator().anyTogether([&] { return !load.blocks.empty(); })) return;
  throw vdi::Error(vdi::ErrorCode::InvalidArgument,
                   "the input shows nothing: vtkGhostType hides all of its cells");
}

}  // namespace

std::uint64_t newIdentity(vtkMultiProcessController* controller) {
  vtkTimeStamp now;
  now.Modified();
  unsigned long long identity = now.GetMTime();
  if (!isAlone(controller)) controller->Broadcast(&identity, 1, 0);
  return identity;
}

Volume::Volume(vtkMultiProcessController* controller, std::uint64_t identity)
    : controller_(controller), hasRanks_(!isAlone(controller)), identity_(identity) {}

Volume::~Volume() = default;

bool Volume::isMade() const {
  const std::scoped_lock lock(mutex_);
  return device_ != nullptr;
}

bool Volume::isLost() const {
  const std::scoped_lock lock(mutex_);
  return hasFailed_ || (device_ != nullptr && device_->isLost());
}

std::shared_ptr<const Shown> Volume::shown() const {
  const std::scoped_lock lock(mutex_);
  return shown_;
}

bool Volume::targets(const Origin& origin) const {
  const std::scoped_lock lock(mutex_);
  return target_ == origin;
}

void Volume::setTarget(const Origin& origin) {
  const std::scoped_lock lock(mutex_);
  target_ = origin;
}

void Volume::join(const void* user, std::function<bool(const Origin&)> wants) {
  users_[user] = std::move(wants);
}

void Volume::leave(const void* user) {
  users_.erase(user);
}

bool Volume::isWantedBesides(const void* user) const {
  std::optional<Origin> origin;
  {
    const std::scoped_lock lock(mutex_);
    origin = target_;
  }
  return origin && std::ranges::any_of(users_, [&](const auto& other) {
           return other.first != user && other.second(*origin);
         });
}

void Volume::connect() {
  if (isConnected_) return;
  comm_ = hasRanks_ ? communicatorOf(controller_) : vdi::comm::Communicator::serial();
  isConnected_ = true;
}

void Volume::make() {
  if (this->isMade()) return;
  if (!comm_)
    throw vdi::Error(vdi::ErrorCode::DeviceFailure, "an earlier VDI of this volume couldn't be begun");
  std::shared_ptr<vdi::gpu::Device> device;
  comm_->together([&] { device = sharedDevice(comm_->localRank()); });
  const vdi::GeneratorOptions options = vdi::generatorOptionsFromEnvironment(*comm_);
  try {
    generator_ =
        std::make_unique<vdi::VdiGenerator>(device, std::exchange(comm_, std::nullopt).value(), options);
  } catch (...) {
    const std::scoped_lock lock(mutex_);
    hasFailed_ = true;
    throw;
  }
  const std::scoped_lock lock(mutex_);
  device_ = std::move(device);
}

void Volume::show(const Load& load) {
  const vdi::comm::Communicator& comm = generator_->communicator();
  const auto isMissing = [&] {
    const std::shared_ptr<const Shown> now = this->shown();
    return !now || !(now->of == load.of);
  };
  if (!comm.anyTogether(isMissing)) return;
  {
    const std::scoped_lock lock(mutex_);
    shown_.reset();
  }
  try {
    generator_->setBlocks(load.blocks, load.of.fillGhosts);
    requireVolume(*generator_, load);
    const vdi::ScalarRange& range = generator_->scalarRange();
    const std::optional<vdi::ScalarRange> part = generator_->crowdedPart();
    auto now = std::make_shared<const Shown>(Shown{.of = load.of,
                                                   .bounds = generator_->scene().bounds,
                                                   .range = range,
                                                   .crowded = part ? vdi::describeCrowded(range, *part) : "",
                                                   .voxelVolume = load.voxelVolume,
                                                   .stretch = load.stretch,
                                                   .array = load.array,
                                                   .values = sampleOf(load.blocks, range, comm)});
    const std::scoped_lock lock(mutex_);
    shown_ = std::move(now);
  } catch (...) {
    const std::scoped_lock lock(mutex_);
    if (target_ == load.of) target_.reset();
    throw;
  }
}

void Volume::requireShown(const Origin& origin) {
  generator_->communicator().together([&] {
    const std::shared_ptr<const Shown> now = this->shown();
    if (!now || !(now->of == origin))
      throw vdi::Error(vdi::ErrorCode::InvalidArgument, "the volume now shows other blocks");
  });
}

Turn::Turn(Volume& volume) : volume_(volume) {
  const std::scoped_lock lock(volume_.mutex_);
  number_ = ++volume_.lastTurn_;
  volume_.turns_.insert(number_);
}

bool Turn::awaitFor(std::chrono::milliseconds most) {
  std::unique_lock lock(volume_.mutex_);
  return volume_.turnEnded_.wait_for(lock, most, [this] { return *volume_.turns_.begin() == number_; });
}

void Turn::await() {
  if (!volume_.hasRanks()) {
    while (!this->awaitFor(patience)) {
    }
    return;
  }
  while (!this->awaitFor(std::chrono::milliseconds(0))) volume_.serve(patience);
}

bool Turn::awaitUnless(const std::function<bool()>& isUnwanted) {
  while (!this->awaitFor(patience)) {
    if (isUnwanted()) return false;
  }
  return true;
}

void Turn::end() {
  const std::scoped_lock lock(volume_.mutex_);
  volume_.turns_.erase(number_);
  volume_.turnEnded_.notify_all();
}

std::shared_ptr<Volume> Volumes::choose(vtkMultiProcessController* controller, const Origin& origin,
                                        const std::shared_ptr<Volume>& own, const void* user) {
  const bool isOwnUsable = own && own->controller() == controller && !own->isLost();
  if (onAllRanks(controller, isOwnUsable && own->targets(origin))) return own;
  std::vector<std::shared_ptr<Volume>> fitting;
  for (const std::weak_ptr<Volume>& known : volumes_) {
    const std::shared_ptr<Volume> volume = known.lock();
    if (volume && volume->controller() == controller && !volume->isLost() && volume->targets(origin))
      fitting.push_back(volume);
  }
  if (std::shared_ptr<Volume> found = firstOfAll(controller, fitting)) return found;
  if (onAllRanks(controller, isOwnUsable && !own->isWantedBesides(user))) return own;
  std::erase_if(volumes_, [](const std::weak_ptr<Volume>& known) { return known.expired(); });
  auto created = std::make_shared<Volume>(controller, newIdentity(controller));
  volumes_.push_back(created);
  return created;
}

std::shared_ptr<Volumes> sharedVolumes() {
  static std::mutex mutex;
  static std::weak_ptr<Volumes> existing;
  const std::scoped_lock lock(mutex);
  std::shared_ptr<Volumes> volumes = existing.lock();
  if (!volumes) existing = volumes = std::make_shared<Volumes>();
  return volumes;
}

}  // namespace pv
