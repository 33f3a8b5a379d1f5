// The picture of a VDI in full, made beside the window's thread.
#ifndef VDIStill_h
#define VDIStill_h

#include <atomic>
#include <chrono>
#include <future>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "VDIView.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace pv {

/// What a picture is of.
struct StillView {
  ViewMatrices matrices;
  glm::ivec2 size;
  vdi::Reconstruction reconstruction;
  std::vector<float> window;  // [size.y][size.x], the depth buffer

  bool operator==(const StillView&) const = default;
};

/// A picture that is made row by row on a thread: `drop` waits for a few rows at most. Of one thread, that of
/// the views. The renderer is the picture's as long as it's being made.
class VDIStill {
 public:
  VDIStill() = default;
  ~VDIStill() { this->drop(); }
  VDIStill(const VDIStill&) = delete;
  VDIStill& operator=(const VDIStill&) = delete;
  VDIStill(VDIStill&&) = delete;
  VDIStill& operator=(VDIStill&&) = delete;

  /// Starts to make it, in place of any other. `renderer` has a VDI, and lives until `drop`.
  void start(vdi::VdiRenderer& renderer, StillView view);
  /// Whether it's the one of this view, done or not.
  bool isOf(const StillView& view) const { return has_ && view == view_; }
  bool isBeingMade() const;
  bool isDone() const { return has_ && !this->isBeingMade(); }
  bool isSeen() const { return isSeen_; }  // `picture` was asked for
  /// Of one that's done: premultiplied colours as renderBytes gives them, and how long they took. Throws what
  /// rendering threw, once; then there's none any more.
  std::span<const glm::u8vec4> picture();
  double seconds() const { return seconds_; }
  void drop();
  /// Leaves the processor to the window for half a second, where it's being made.
  void rest();

 private:
  void make(vdi::VdiRenderer& renderer);

  bool has_ = false;
  bool isSeen_ = false;
  StillView view_{};
  std::vector<glm::u8vec4> pixels_;
  double seconds_ = 0.0;
  std::atomic<bool> isDropped_{false};
  std::atomic<std::chrono::steady_clock::time_point> restEnd_{};
  std::future<void> job_;
};

}  // namespace pv

#endif
