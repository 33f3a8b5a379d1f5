#include "VDIPreparation.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

#include "VDISession.h"

namespace pv {

Preparation::Preparation(std::shared_ptr<Volume> volume, vtkMTimeType time, Make make)
    : Of(std::move(volume)),
      Mine(*Of),
      Time(time),
      Worker([this, given = std::move(make)] { this->work(given); }) {}

Preparation::~Preparation() {
  this->giveUp();
  while (this->hasRanks() && !this->Done) this->serve(std::chrono::milliseconds(10));
}

void Preparation::work(const Make& make) {
  // Either all ranks begin or none does.
  const auto isInVain = [this] { return this->Unwanted && !this->hasRanks(); };
  if (this->Mine.awaitUnless(isInVain)) {
    std::optional<vdi::comm::Funnel::Entry> carried;
    if (this->hasRanks()) carried.emplace(this->Of->funnel());
    try {
      make(
          *this->Of,
          [this](double done) {
            this->Share = done;
            return !this->Unwanted;
          },
          this->Output);
      this->Good = true;
    } catch (const std::exception&) {
      this->Good = false;  // the update tries again, and reports the reason if it fails, too
    }
  }
  this->Mine.end();
  this->Done = true;
}

int Preparation::percent() const {
  if (this->Done) return this->Good ? 100 : -1;
  return std::clamp(static_cast<int>(100.0 * this->Share), 0, 99);
}

Preparation::End Preparation::wait(const std::function<void()>& whileWaiting) {
  while (!this->Done) {
    if (this->hasRanks()) {
      this->serve(std::chrono::milliseconds(10));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    whileWaiting();
  }
  if (onAllRanks(this->Of->controller(), this->Good)) return End::Good;
  return onAllRanks(this->Of->controller(), !this->Unwanted) ? End::Failed : End::GivenUp;
}

}  // namespace pv
