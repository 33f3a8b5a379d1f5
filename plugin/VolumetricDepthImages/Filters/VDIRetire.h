// Things that wait for a thread when they're destroyed, let go without waiting.
#ifndef VDIRetire_h
#define VDIRetire_h

#include <memory>

namespace pv {

/// Lets go of `thing` on a thread of its own. The process waits for that when it ends.
void retire(std::shared_ptr<void> thing);

}  // namespace pv

#endif
