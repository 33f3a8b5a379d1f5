#include "VDIPreparation.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "VDISession.h"

namespace pv {

Preparation::Preparation(std::shared_ptr<Volume> volume, vtkMTimeType time, Make make)
    : volume_(std::move(volume)),
      turn_(*volume_),
      time_(time),
      thread_([this, given = std::move(make)] { work(given); }) {}

Preparation::~Preparation() {
  giveUp();
  while (hasRanks() && !isDone_) serve(std::chrono::milliseconds(10));
}

void Preparation::work(const Make& make) {
  // Either all ranks begin or none does.
  const auto isInVain = [this] { return isUnwanted_ && !hasRanks(); };
  if (turn_.awaitUnless(isInVain)) {
    std::optional<vdi::comm::Funnel::Entry> carried;
    if (hasRanks()) carried.emplace(volume_->funnel());
    try {
      make(
          *volume_,
          [this](double done) {
            share_ = done;
            return !isUnwanted_;
          },
          output_);
      isGood_ = true;
    } catch (const std::exception&) {
      isGood_ = false;  // the update tries again, and reports the reason if it fails, too
    }
  }
  turn_.end();
  isDone_ = true;
}

int Preparation::percent() const {
  if (isDone_) return isGood_ ? 100 : -1;
  return std::clamp(static_cast<int>(100.0 * share_), 0, 99);
}

Preparation::End Preparation::wait(const std::function<void()>& whileWaiting) {
  while (!isDone_) {
    if (hasRanks()) {
      serve(std::chrono::milliseconds(10));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    whileWaiting();
  }
  if (onAllRanks(volume_->controller(), isGood_)) return End::Good;
  return onAllRanks(volume_->controller(), !isUnwanted_) ? End::Failed : End::GivenUp;
}

}  // namespace pv
