#include "vdi/pipeline/Frames.h"

#include <algorithm>
#include <utility>

namespace vdi::detail {

Frames::Frames(const std::shared_ptr<gpu::Device>& device, const comm::Communicator& comm,
               comm::Transport transport, int root) {
  const auto opened = std::make_shared<OpenedMemory>(device);
  for (Flight& flight : flights) {
    flight.gather = std::make_unique<Gather>(device, comm, transport, root, opened);
    flight.downloads = std::make_unique<DownloadMemory>(device);
  }
}

bool Frames::underWay() const {
  return std::ranges::any_of(flights, &Flight::underWay);
}

Flight& Frames::next() {
  const auto found = std::ranges::find_if_not(flights, &Flight::underWay);
  Flight& flight = found != flights.end() ? *found : flights[older_];
  older_ = &flight == &flights.front() ? 1 : 0;
  return flight;
}

void Frames::addLastBands() {
  for (const Flight& flight : flights) {
    if (flight.underWay() && flight.frame->addLastBand) std::exchange(flight.frame->addLastBand, {})();
  }
}

void Frames::drop(const std::exception_ptr& error) noexcept {
  for (Flight& flight : flights) {
    flight.gather->drop();
    flight.downloads->commands.drop();
    if (!flight.underWay()) continue;
    flight.frame->sink.reset();
    flight.frame->addLastBand = {};
    flight.frame->error = error;
  }
}

}  // namespace vdi::detail
