#include "vdi/reference/Slopes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "shaders/shared/render.h"
#include "vdi/core/TransferFunction.h"

namespace vdi::reference {

namespace {

using shared::renderLeastOpacity;
using shared::renderMaxSlope;
using shared::renderMostDepth;
using shared::renderNoSlope;
using shared::renderSlopes;
using shared::renderTie;

static_assert(Slopes::onFace == shared::renderOnFace);

constexpr float nowhere = std::numeric_limits<float>::infinity();

float depthOf(const Supersegment& segment) {
  return std::min(opticalDepthOf(segment.opacity), renderMostDepth);
}

float opacityOver(const Supersegment& segment, float length) {
  return opacityOf(depthOf(segment) * length / (segment.back - segment.front));
}

/// Supersegments that touch each other: [first, last] of a list.
struct Run {
  std::size_t first = 0;
  std::size_t last = 0;
  float opticalDepth = 0.0F;
};

Run runFrom(std::span<const Supersegment> list, std::size_t first) {
  Run run{first, first, depthOf(list[first])};
  while (run.last + 1 < list.size() && list[run.last + 1].front <= list[run.last].back)
    run.opticalDepth += depthOf(list[++run.last]);
  return run;
}

/// The run that overlaps [front, back] most, or the nearest one within renderMaxSlope footprints. The search
/// begins at `from`, and sets it to the run's first supersegment. If no run is found, opticalDepth is
/// negative.
Run runBeside(std::span<const Supersegment> list, float front, float back, float footprint,
              std::size_t& from) {
  const float reach = renderMaxSlope * footprint;
  Run best{.opticalDepth = -1.0F};
  float most = -reach;
  for (std::size_t first = from; first < list.size() && list[first].front < back + reach;) {
    const Run run = runFrom(list, first);
    const float overlap = std::min(back, list[run.last].back) - std::max(front, list[first].front);
    if (overlap > most + renderTie * footprint) {
      most = overlap;
      best = run;
    }
    first = run.last + 1;
  }
  if (best.opticalDepth >= 0.0F) from = best.first;
  return best;
}

/// Walks a run to places of ascending optical depth.
class Walk {
 public:
  Walk(std::span<const Supersegment> list, const Run& run) : list_(list), run_(run), at_(run.first) {}

  void restart() {
    at_ = run_.first;
    before_ = 0.0F;
  }
  /// The depth that has this optical depth in front of it; `nowhere` if the run has less.
  float placeOf(float opticalDepth) {
    while (at_ < run_.last && before_ + depthOf(list_[at_]) < opticalDepth) before_ += depthOf(list_[at_++]);
    const Supersegment& segment = list_[at_];
    const float share = (opticalDepth - before_) / depthOf(segment);
    if (share > 1.001F || opticalDepth < -0.001F * depthOf(segment)) return nowhere;
    return segment.front + (segment.back - segment.front) * std::clamp(share, 0.0F, 1.0F);
  }

 private:
  std::span<const Supersegment> list_;
  Run run_;
  std::size_t at_;
  float before_ = 0.0F;  // optical depth in front of at_
};

/// A neighbour on one side of an axis: before the list, or after it.
struct Neighbour {
  std::span<const Supersegment> list;
  bool isAfter = false;
  SlopeUnit unit;
};

/// Combines a face's slope towards a neighbour with `before`, its slope towards the one before the list.
std::int8_t combined(std::int8_t before, float depth, float place, const Neighbour& neighbour) {
  const float change = neighbour.isAfter ? place - depth : depth - place;
  const bool isKnown = std::abs(change) <= renderMaxSlope * neighbour.unit.footprint;
  const int slope =
      isKnown ? static_cast<int>(std::floor(change / neighbour.unit.unit + 0.5F + renderTie)) : renderNoSlope;
  if (!neighbour.isAfter || before == renderNoSlope) return static_cast<std::int8_t>(slope);
  return static_cast<std::int8_t>(isKnown ? (before + slope) / 2 : before);
}

/// `frontOf` and `backOf` select an axis.
void addNeighbour(std::span<const Supersegment> list, const Neighbour& neighbour, std::span<Slopes> slopes,
                  std::int8_t Slopes::*frontOf, std::int8_t Slopes::*backOf) {
  std::size_t from = 0;
  for (std::size_t first = 0; first < list.size();) {
    const Run own = runFrom(list, first);
    const Run other =
        runBeside(neighbour.list, list[own.first].front, list[own.last].back, neighbour.unit.footprint, from);
    const bool hasOther = other.opticalDepth >= 0.0F;
    Walk walk(neighbour.list, other);
    bool isFrontHalf = true;
    float before = 0.0F;  // optical depth in front of the face
    const auto placeOf = [&] {
      if (!hasOther) return nowhere;
      if (isFrontHalf && before > (0.5F + renderTie) * own.opticalDepth) {
        isFrontHalf = false;
        walk.restart();
      }
      return walk.placeOf(isFrontHalf ? before : before + (other.opticalDepth - own.opticalDepth));
    };
    float place = placeOf();
    for (std::size_t i = own.first; i <= own.last; ++i) {
      Slopes& slope = slopes[i];
      slope.*frontOf = combined(slope.*frontOf, list[i].front, place, neighbour);
      before += depthOf(list[i]);
      place = placeOf();
      slope.*backOf = combined(slope.*backOf, list[i].back, place, neighbour);
    }
    first = own.last + 1;
  }
}

std::int8_t faded(std::int8_t slope, float opacity) {
  if (slope == renderNoSlope) return 0;
  const float weight = std::clamp(opacity / renderLeastOpacity - 1.0F, 0.0F, 1.0F);
  return static_cast<std::int8_t>(std::floor(static_cast<float>(slope) * weight + 0.5F + renderTie));
}

void fade(std::span<const Supersegment> list, float footprint, std::span<Slopes> slopes) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const float own = opacityOver(list[i], footprint);
    const bool touchesBefore = i > 0 && list[i].front <= list[i - 1].back;
    const bool touchesAfter = i + 1 < list.size() && list[i + 1].front <= list[i].back;
    const float front = touchesBefore ? std::max(own, opacityOver(list[i - 1], footprint)) : own;
    const float back = touchesAfter ? std::max(own, opacityOver(list[i + 1], footprint)) : own;
    slopes[i] = {faded(slopes[i].frontX, front), faded(slopes[i].frontY, front), faded(slopes[i].backX, back),
                 faded(slopes[i].backY, back)};
  }
}

/// The depths at which a ray enters and leaves the box, and its rates there, as distance from the face per
/// depth.
struct Passage {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  double enterRate = 1.0;
  double leaveRate = 1.0;
};

Passage passageOf(const BoxFaces& faces, const View& original, const glm::ivec2& pixel) {
  const Ray world = original.rayThrough(pixel.x + 0.5, pixel.y + 0.5);
  const glm::dvec3 origin = original.toView(world.origin);
  const glm::dvec3 direction(glm::dot(world.direction, original.right()),
                             glm::dot(world.direction, original.up()),
                             glm::dot(world.direction, original.forward()));
  Passage passage;
  for (const glm::dvec4& face : faces) {
    const double rate = glm::dot(glm::dvec3(face), direction);
    const double depth = (face.w - glm::dot(glm::dvec3(face), origin)) / rate;
    if (rate > 0.0 && depth > passage.enter) {
      passage.enter = depth;
      passage.enterRate = rate;
    } else if (rate < 0.0 && depth < passage.leave) {
      passage.leave = depth;
      passage.leaveRate = -rate;
    }
  }
  return passage;
}

void putOnFaces(std::span<const Supersegment> list, const Passage& passage, const FaceTolerance& tolerance,
                std::span<Slopes> slopes) {
  const auto isNear = [&](float depth, double face, double rate) {
    return std::abs(depth - face) <= tolerance.depth + tolerance.distance / rate;
  };
  if (isNear(list.front().front, passage.enter, passage.enterRate))
    slopes.front().frontX = slopes.front().frontY = Slopes::onFace;
  if (isNear(list.back().back, passage.leave, passage.leaveRate))
    slopes.back().backX = slopes.back().backY = Slopes::onFace;
}

}  // namespace

ListBox listBoxOf(const Vdi& vdi, float farthest) {
  return {facesOf(vdi.bounds, vdi.view()), faceToleranceOf(vdi.depthCode.step, farthest)};
}

SlopeUnit slopeUnitOf(const View& original, float nearest, float farthest) {
  const auto pixel = static_cast<float>(2.0 * original.halfHeight() / original.height());
  const float footprint = original.parallel() ? pixel : pixel * 0.5F * (nearest + farthest);
  return {footprint, footprint * (renderMaxSlope / renderSlopes)};
}

std::vector<Slopes> slopesOf(const SupersegmentLists& lists, const View& original, const SlopeUnit& unit,
                             const ListBox& box) {
  const glm::ivec2 size{original.width(), original.height()};
  std::vector<Slopes> slopes(lists.segments.size());
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const auto indexOf = [&](int column, int row) {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(size.x) +
               static_cast<std::size_t>(column);
      };
      // A list beyond the picture is empty.
      const auto beside = [&](int column, int row, bool isAfter) {
        const bool exists = column >= 0 && row >= 0 && column < size.x && row < size.y;
        return Neighbour{exists ? lists.list(indexOf(column, row)) : std::span<const Supersegment>{}, isAfter,
                         unit};
      };
      const std::size_t index = indexOf(x, y);
      const auto list = lists.list(index);
      const auto own = std::span(slopes).subspan(lists.offsets[index], list.size());
      addNeighbour(list, beside(x - 1, y, false), own, &Slopes::frontX, &Slopes::backX);
      addNeighbour(list, beside(x + 1, y, true), own, &Slopes::frontX, &Slopes::backX);
      addNeighbour(list, beside(x, y - 1, false), own, &Slopes::frontY, &Slopes::backY);
      addNeighbour(list, beside(x, y + 1, true), own, &Slopes::frontY, &Slopes::backY);
      fade(list, unit.footprint, own);
      if (!list.empty()) putOnFaces(list, passageOf(box.faces, original, {x, y}), box.tolerance, own);
    }
  }
  return slopes;
}

}  // namespace vdi::reference
