#include "vdi/comm/BeyondDomain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>

#include "vdi/comm/Indices.h"
#include "vdi/comm/LocalValues.h"

namespace vdi::comm {

namespace {

/// The next difference of a parabola whose last two differences are `before` and `last`, limited by both: 0
/// beyond an edge or an extremum, and at most twice the smaller one.
double limitedDifference(double last, double before) {
  if (!(last * before > 0.0)) return 0.0;
  const double bound = std::min(std::abs(last), std::abs(before));
  const double next = 2.0 * std::abs(last) - std::abs(before);
  return std::clamp(next, -bound, 2.0 * bound) * (last > 0.0 ? 1.0 : -1.0);
}

/// Number of values that determine the next one along an axis.
constexpr int deciding = 3;

/// Patches with the values around them, which determine their open places.
struct Window {
  IndexBox box;
  std::array<std::ptrdiff_t, 3> strides{};  // distances between neighbours along each axis
  LocalValues values;
  std::vector<std::uint8_t> known;  // 0: still open, or masked
};

class Continuation {
 public:
  Continuation(const Block& block, const IndexBox& core, const IndexBox& used,
               std::span<const OpenPatch> patches)
      : block_(block), core_(core), patches_(patches) {
    for (const IndexBox& box : windowsOf(block.extended().intersection(used), patches)) addWindow(box);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const IndexBox& window = windowOf(i).box;
      for (const IndexBox& box : patches[i].open) {
        open_.reserve(open_.size() + box.count());
        forEachRow(box, [&](glm::ivec3 at) {
          std::size_t position = window.position(at);
          for (; at.x < box.hi.x; ++at.x) open_.push_back({position++, static_cast<std::uint32_t>(i), at});
        });
      }
    }
    filled_.reserve(open_.size());
  }

  /// Fills the open places next to known values. Returns false if there are none.
  bool advance() {
    filled_.clear();
    const auto fill = [this](const OpenPlace& place) {
      const std::optional<double> value = continuedAt(place);
      if (value) filled_.push_back({place, *value});
      return value.has_value();
    };
    std::erase_if(open_, fill);
    // The values of a step depend on those of the steps before, not on each other.
    for (const auto& [place, value] : filled_) {
      const OpenPatch& patch = patches_[place.patch];
      const std::size_t inPatch = patch.box.position(place.at);
      storeValue(block_.type, patch.values, inPatch, value);
      const double stored = loadValue(block_.type, patch.values, inPatch);
      for (Window& window : windows_) {
        if (!window.box.contains(place.at)) continue;
        const std::size_t position = window.box.position(place.at);
        window.values[position] = stored;
        window.known[position] = 1;
      }
    }
    return !filled_.empty();
  }

 private:
  /// A place still to be filled. It is kept small, because a block may have many.
  struct OpenPlace {
    std::size_t position;  // in the patch's window
    std::uint32_t patch;
    glm::ivec3 at;
  };

  const Window& windowOf(std::size_t patch) const { return windows_[windows_.size() > 1 ? patch : 0]; }

  /// One box for each patch, or one for all of them if that has fewer values. So the memory grows with the
  /// patches, not with the block.
  static std::vector<IndexBox> windowsOf(const IndexBox& all, std::span<const OpenPatch> patches) {
    std::vector<IndexBox> each;
    IndexBox common;
    std::size_t count = 0;
    for (const OpenPatch& patch : patches) {
      const IndexBox around{patch.box.lo - deciding, patch.box.hi + deciding};
      each.push_back(around.intersection(all));
      common.include(each.back());
      count += each.back().count();
    }
    return common.count() <= count ? std::vector<IndexBox>{common} : each;
  }

  void addWindow(const IndexBox& box) {
    const glm::i64vec3 size = box.size();
    Window& window = windows_.emplace_back();
    window.box = box;
    window.strides = {1, size.x, size.x * size.y};
    window.values.gather(block_, box);
    window.known.assign(window.values.size(), 1);
    for (const OpenPatch& patch : patches_) {
      for (const IndexBox& open : patch.open) markUnknown(window, open);
    }
    if (block_.masked) {
      for (const IndexBox& masked : *block_.masked) markUnknown(window, masked);
    }
  }

  static void markUnknown(Window& window, const IndexBox& box) {
    const IndexBox common = box.intersection(window.box);
    if (common.empty()) return;
    forEachRow(common, [&](const glm::ivec3& at) {
      std::memset(window.known.data() + window.box.position(at), 0,
                  static_cast<std::size_t>(common.size().x));
    });
  }

  /// The mean over the axes that lead to known values.
  std::optional<double> continuedAt(const OpenPlace& place) const {
    const Window& window = windowOf(place.patch);
    double sum = 0.0;
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int at = place.at[axis];
      if (at >= core_.lo[axis] && at < core_.hi[axis]) continue;
      const bool below = at < core_.lo[axis];
      const int inward = below ? window.box.hi[axis] - 1 - at : at - window.box.lo[axis];
      const std::ptrdiff_t stride = window.strides[static_cast<std::size_t>(axis)];
      if (const auto value = continuedAlong(window, place.position, below ? stride : -stride, inward)) {
        if (block_.nearest) return value;
        sum += *value;
        ++count;
      }
    }
    return count > 0 ? std::optional(sum / count) : std::nullopt;
  }

  /// `step` leads towards the core, where the window has `inward` more values.
  std::optional<double> continuedAlong(const Window& window, std::size_t position, std::ptrdiff_t step,
                                       int inward) const {
    std::array<double, deciding> values{};
    int count = 0;
    while (count < std::min(inward, block_.nearest ? 1 : deciding)) {
      position += static_cast<std::size_t>(step);
      if (window.known[position] == 0) break;
      values[static_cast<std::size_t>(count++)] = window.values[position];
    }
    if (count == 0) return std::nullopt;
    const auto [nearest, second, third] = values;
    if (count < deciding) return nearest;
    const double difference = limitedDifference(nearest - second, second - third);
    return std::isfinite(difference) ? nearest + difference : nearest;
  }

  const Block& block_;
  const IndexBox core_;
  std::span<const OpenPatch> patches_;
  std::vector<Window> windows_;  // one for all patches, or one for each
  std::vector<OpenPlace> open_;
  std::vector<std::pair<OpenPlace, double>> filled_;  // places that the current step has filled
};

}  // namespace

void continueBeyondDomain(const Block& block, const IndexBox& core, const IndexBox& used,
                          std::span<const OpenPatch> patches) {
  Continuation continuation(block, core, used, patches);
  while (continuation.advance()) {
  }
}

}  // namespace vdi::comm
