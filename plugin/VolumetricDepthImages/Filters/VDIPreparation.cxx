#include "VDIPreparation.h"

#include <vtkCommunicator.h>
#include <vtkMultiProcessController.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

namespace pv {

bool onAllRanks(vtkMultiProcessController* controller, bool here) {
  if (controller == nullptr || controller->GetNumberOfProcesses() == 1) return here;
  const int mine = here ? 1 : 0;
  int all = 0;
  controller->AllReduce(&mine, &all, 1, vtkCommunicator::MIN_OP);
  return all != 0;
}

Preparation::Preparation(vtkMultiProcessController* controller, vtkMTimeType time, Make make)
    : Controller(controller), Time(time), Worker([this, work = std::move(make)] {
        std::optional<vdi::comm::Funnel::Entry> carried;
        if (this->hasRanks()) carried.emplace(this->Funnel);
        try {
          work(
              [this](double done) {
                this->Share = done;
                return !this->Unwanted;
              },
              this->Output);
          this->Good = true;
        } catch (const std::exception&) {
          this->Good = false;  // the update tries again, and says why if it can't either
        }
        this->Done = true;
      }) {}

Preparation::~Preparation() {
  this->giveUp();
  while (this->hasRanks() && !this->Done) this->serve(std::chrono::milliseconds(10));
}

bool Preparation::hasRanks() const {
  return this->Controller != nullptr && this->Controller->GetNumberOfProcesses() > 1;
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
  if (onAllRanks(this->Controller, this->Good)) return End::Good;
  return onAllRanks(this->Controller, !this->Unwanted) ? End::Failed : End::GivenUp;
}

}  // namespace pv
