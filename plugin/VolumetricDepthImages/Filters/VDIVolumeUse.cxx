#include "VDIVolumeUse.h"

#include <fmt/format.h>

namespace pv {

void VolumeUse::choose(vtkMultiProcessController* controller, const Origin& origin) {
  if (identity_ == 0) identity_ = newIdentity(controller);
  this->use(volumes_->choose(controller, origin, volume_, this));
}

void VolumeUse::leave() {
  if (volume_) volume_->leave(this);
}

void VolumeUse::startAnew() {
  this->giveUp();
  identity_ = 0;
}

std::string VolumeUse::name() const {
  return "VolumetricDepthImage, " + (identity_ != 0 ? fmt::format("{:x}", identity_) : "a new one");
}

std::shared_ptr<const Shown> VolumeUse::shownOf(const Origin& origin) const {
  if (!volume_ || !volume_->targets(origin)) return nullptr;
  std::shared_ptr<const Shown> shown = volume_->shown();
  return shown && shown->of == origin ? shown : nullptr;
}

bool VolumeUse::hasLostDevice() const {
  if (!volume_ || !volume_->isConnected()) return false;
  Turn turn(*volume_);
  turn.await();
  if (!volume_->isMade()) return volume_->isLost();
  const vdi::VdiGenerator& generator = volume_->generator();
  return generator.communicator().anyTogether([&] { return generator.device().isLost(); });
}

void VolumeUse::use(const std::shared_ptr<Volume>& volume) {
  if (volume_ == volume) return;
  this->leave();
  volume_ = volume;
  if (volume_) volume_->join(this, wants_);
}

}  // namespace pv
