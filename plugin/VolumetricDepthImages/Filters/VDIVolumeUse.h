// A filter's use of a volume that it may share with other filters.
#ifndef VDIVolumeUse_h
#define VDIVolumeUse_h

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "VDIVolume.h"

class vtkMultiProcessController;

namespace pv {

/// Only the main thread changes it. It must stay where it is while the volume knows it as a user.
class VolumeUse {
 public:
  /// `wants` is as Volume::join takes it.
  explicit VolumeUse(std::function<bool(const Origin&)> wants) : wants_(std::move(wants)) {}
  VolumeUse(const VolumeUse&) = delete;
  VolumeUse& operator=(const VolumeUse&) = delete;
  VolumeUse(VolumeUse&&) = delete;
  VolumeUse& operator=(VolumeUse&&) = delete;
  ~VolumeUse() = default;  // `leave` comes first, on the main thread

  /// Null before the first `choose`.
  const std::shared_ptr<Volume>& volume() const { return volume_; }
  /// Uses the volume in which another filter shows this input, or a volume that can show it. Collective.
  void choose(vtkMultiProcessController* controller, const Origin& origin);
  /// Ends this use, but keeps the volume alive.
  void leave();
  /// Gives up the volume.
  void giveUp() { this->use(nullptr); }
  /// Gives up the volume and the filter's identity.
  void startAnew();

  /// The filter's name, the same on all ranks whose filters belong together.
  std::string name() const;
  /// The shown blocks if the volume shows this origin and no later turn changes it; else null.
  std::shared_ptr<const Shown> shownOf(const Origin& origin) const;
  /// Whether a rank has lost its device. Collective: with a generator, all ranks fail together, whatever the
  /// cause on each.
  bool hasLostDevice() const;

 private:
  void use(const std::shared_ptr<Volume>& volume);

  std::shared_ptr<Volumes> volumes_ = sharedVolumes();
  std::function<bool(const Origin&)> wants_;
  std::shared_ptr<Volume> volume_;
  std::uint64_t identity_ = 0;  // from the first `choose` on; the same on all ranks
};

}  // namespace pv

#endif
