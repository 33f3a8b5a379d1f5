// Release of objects whose destructors wait for a thread.
#ifndef VDIRetire_h
#define VDIRetire_h

#include <memory>

namespace pv {

/// Releases `thing` on another thread, so that the caller doesn't wait. Before the process ends, it waits for
/// that thread.
void retire(std::shared_ptr<void> thing);

}  // namespace pv

#endif
