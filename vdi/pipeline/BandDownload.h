// A band's lists, from the device to the host, for those who take them there one band after the other. Not
// part of the library's interface.
#pragma once

#include <memory>

#include "vdi/gpu/Commands.h"
#include "vdi/pipeline/DeviceLists.h"

namespace vdi::detail {

/// In memory of this process alone, which the next band's lists take when these have gone.
class BandDownload {
 public:
  explicit BandDownload(std::shared_ptr<gpu::Device> device);
  ~BandDownload();
  BandDownload(const BandDownload&) = delete;
  BandDownload& operator=(const BandDownload&) = delete;
  BandDownload(BandDownload&&) = delete;
  BandDownload& operator=(BandDownload&&) = delete;

  /// By the transfer queue, behind what writes them, beside what the device does meanwhile. They're there
  /// when this returns.
  template <typename Segment>
  ListsOf<Segment> get(const DeviceLists& band);

 private:
  std::shared_ptr<HostPool> pool_;
  gpu::Commands transfer_;
};

}  // namespace vdi::detail
