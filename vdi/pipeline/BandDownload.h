// Copies a band's lists from the device to the host, one band after the other. Not part of the library's
// interface.
#pragma once

#include <memory>

#include "vdi/gpu/Commands.h"
#include "vdi/pipeline/DeviceLists.h"

namespace vdi::detail {

/// Downloads into memory private to this process; once a band's lists are destroyed, the next band reuses
/// their memory.
class BandDownload {
 public:
  explicit BandDownload(std::shared_ptr<gpu::Device> device);
  ~BandDownload();
  BandDownload(const BandDownload&) = delete;
  BandDownload& operator=(const BandDownload&) = delete;
  BandDownload(BandDownload&&) = delete;
  BandDownload& operator=(BandDownload&&) = delete;

  /// The transfer queue copies the lists after the commands that write them, during other work of the device.
  /// The lists are complete when this returns.
  template <typename Segment>
  ListsOf<Segment> get(const DeviceLists& band);

 private:
  std::shared_ptr<HostPool> pool_;
  gpu::Commands transfer_;
};

}  // namespace vdi::detail
