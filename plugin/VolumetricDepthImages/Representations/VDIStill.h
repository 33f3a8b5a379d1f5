// A full picture of a VDI, made on another thread than the views'.
#ifndef VDIStill_h
#define VDIStill_h

#include <atomic>
#include <chrono>
#include <future>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "VDIView.h"
#include "vdi/core/Region.h"
#include "vdi/pipeline/VdiRenderer.h"

namespace pv {

/// The inputs of a full picture of a VDI, besides the VDI.
struct StillView {
  ViewMatrices matrices;
  glm::ivec2 size;
  vdi::Reconstruction reconstruction;
  std::vector<vdi::ClipPlane> planes;
  std::vector<float> window;  // [size.y][size.x], the depth buffer

  bool operator==(const StillView&) const = default;
};

/// A picture that a thread makes row by row, so that `drop` waits for a few rows at most. The views' thread
/// makes all calls. While the picture is being made, nothing else may use its renderer.
class VDIStill {
 public:
  VDIStill() = default;
  ~VDIStill() { this->drop(); }
  VDIStill(const VDIStill&) = delete;
  VDIStill& operator=(const VDIStill&) = delete;
  VDIStill(VDIStill&&) = delete;
  VDIStill& operator=(VDIStill&&) = delete;

  /// Drops the picture and starts another. `renderer` has a VDI and lives until `drop`.
  void start(vdi::VdiRenderer& renderer, StillView view);
  /// Whether the picture shows this view, done or not.
  bool isOf(const StillView& view) const { return has_ && view == view_; }
  bool isBeingMade() const;
  bool isDone() const { return has_ && !this->isBeingMade(); }
  bool isSeen() const { return isSeen_; }  // `picture` was called
  /// Premultiplied colours as renderBytes gives them, and the seconds that they took; waits for the thread.
  /// Rethrows once what rendering threw, and drops the picture then.
  std::span<const glm::u8vec4> picture();
  double seconds() const { return seconds_; }
  void drop();
  /// Pauses the thread for half a second, so that the window gets the processor.
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
