// The choice of how rough the frames of a moving VDI are.
#ifndef VDIFramePolicy_h
#define VDIFramePolicy_h

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>

#include "VDIBuffers.h"

namespace vdi {
class View;
}

namespace pv {

/// The size and the lists with which a picture is rendered.
struct PictureForm {
  glm::ivec2 size;                  // pixels
  std::optional<std::size_t> thin;  // level of VDIBuffers::thin; none: all lists
};

/// Chooses the form of frames from the time that earlier ones took. Times are seconds.
class VDIFramePolicy {
 public:
  /// The form that gives `rate` frames a second, with at least one pixel for each 64 of `port`.
  PictureForm interactive(VDIBuffers& buffers, const vdi::View& view, const glm::ivec2& port, double rate);
  /// Whether a window's still frame would wait too long for a picture of all lists.
  bool takesLong(const VDIBuffers& buffers, const glm::ivec2& port) const;
  /// Learns from a frame of an orbit. Rendering the VDI took `renderSeconds` of its time.
  void measure(const PictureForm& form, double seconds, double renderSeconds);
  /// Learns from a picture outside an orbit, if nothing better is known.
  void guess(const PictureForm& form, double renderSeconds);

 private:
  /// The time of a frame: a constant part, and a part per pixel of the VDI's picture.
  class Pace {
   public:
    void measure(double seconds, double renderSeconds, double pixels);
    void guess(double renderSeconds, double pixels);
    /// Pixels that give `rate` frames a second. The VDI gets at least half of the time.
    std::optional<double> pixels(double rate) const;
    std::optional<double> seconds(double pixels) const;

   private:
    std::optional<double> anyway_;
    std::optional<double> perPixel_;
  };

  Pace& paceOf(const PictureForm& form) { return form.thin ? thins_.at(*form.thin) : whole_; }

  Pace whole_;
  std::array<Pace, VDIBuffers::thinLevels> thins_;
  double reduction_ = 1.0;  // side of a pixel of interactive frames, in the viewport's pixels
};

}  // namespace pv

#endif
