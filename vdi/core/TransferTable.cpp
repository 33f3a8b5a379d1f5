// Bakes transfer functions. First the function is cut into stretches that are linear in associated colour and
// extinction, which shows all of it; the table's form then depends on how short they are.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "vdi/core/TransferFunction.h"

namespace vdi {

namespace {

constexpr std::size_t smallestTable = 1024;
constexpr std::size_t tableOfSteps = 4096;
constexpr std::size_t largestTable = 16384;

double extinctionOf(double opacity) {
  if (opacity >= 1.0) return maxExtinction;
  return std::min(-std::log2(1.0 - opacity), static_cast<double>(maxExtinction));
}

/// Associated colour and extinction.
glm::dvec4 entryOf(const glm::dvec3& color, double opacity) {
  const double extinction = extinctionOf(opacity);
  return {color * extinction, extinction};
}

glm::dvec4 entryAt(const TransferFunction& function, double x) {
  return entryOf(function.colorAt(x), function.opacityAt(x));
}

TransferTableEntry stored(const glm::vec4& entry) {
  return {entry.r, entry.g, entry.b, entry.a};
}

/// The nodes between which the function changes: it is constant before `first` and beyond `last`.
struct Changes {
  std::size_t first;
  std::size_t last;
};

template <typename Node, typename ValueOf>
Changes changesOf(const std::vector<Node>& nodes, ValueOf valueOf) {
  Changes changes{0, nodes.size() - 1};
  while (changes.first < changes.last && valueOf(nodes[changes.first]) == valueOf(nodes[changes.first + 1]))
    ++changes.first;
  while (changes.last > changes.first && valueOf(nodes[changes.last]) == valueOf(nodes[changes.last - 1]))
    --changes.last;
  return changes;
}

/// Adds the scalars at which the nodes make steps. Returns the smallest nonzero distance between two nodes.
template <typename Node>
double scanNodes(const std::vector<Node>& nodes, const Changes& changes, std::vector<double>& steps) {
  double closest = std::numeric_limits<double>::infinity();
  for (std::size_t i = changes.first; i < changes.last; ++i) {
    const double distance = nodes[i + 1].x - nodes[i].x;
    if (distance > 0.0) {
      closest = std::min(closest, distance);
    } else {
      steps.push_back(nodes[i].x);
    }
  }
  return closest;
}

/// The value just in front of `x`, where the value at `x` lies behind a step.
template <typename Node, typename ValueOf>
auto inFrontOf(const std::vector<Node>& nodes, double x, ValueOf valueOf) {
  const auto at = std::ranges::lower_bound(nodes, x, {}, &Node::x);
  if (at == nodes.begin()) return valueOf(nodes.front());
  if (at == nodes.end()) return valueOf(nodes.back());
  const auto below = std::prev(at);
  const double share = (x - below->x) / (at->x - below->x);
  return valueOf(*below) * (1.0 - share) + valueOf(*at) * share;
}

/// A part of the function between two scalars, linear in associated colour and extinction.
struct Stretch {
  double from;
  double to;
  glm::dvec4 front;
  glm::dvec4 back;
};

/// A part between two neighbouring nodes: straight colour and opacity are linear.
struct Segment {
  double from;
  double to;
  glm::dvec4 front;  // straight colour and opacity
  glm::dvec4 back;

  /// Rising to opacity 1, extinction has no bound, but its integral does. The limit is high enough for that.
  glm::dvec4 entryAt(double share) const {
    constexpr double limit = 30.0;
    const glm::dvec4 here = glm::mix(front, back, share);
    if (front.a >= 1.0 && back.a >= 1.0) return entryOf(here, 1.0);
    const double extinction = std::min(extinctionOf(here.a), limit);
    return {glm::dvec3(here) * extinction, extinction};
  }
};

/// Cuts the segment where a straight line differs from it by more than `allowed` of the extinction.
void addStretches(const Segment& segment, double first, double last, double allowed, int levels,
                  std::vector<Stretch>& stretches) {
  const glm::dvec4 front = segment.entryAt(first);
  const glm::dvec4 back = segment.entryAt(last);
  const glm::dvec4 middle = segment.entryAt(0.5 * (first + last));
  const glm::dvec4 off = glm::abs(0.5 * (front + back) - middle);
  const bool isStraight = std::max({off.r, off.g, off.b, off.a}) <= allowed * (middle.a + 1e-3);
  if (!isStraight && levels > 0) {
    addStretches(segment, first, 0.5 * (first + last), allowed, levels - 1, stretches);
    addStretches(segment, 0.5 * (first + last), last, allowed, levels - 1, stretches);
    return;
  }
  const auto at = [&](double share) { return segment.from + (segment.to - segment.from) * share; };
  // Neighbouring parts that don't change are one.
  if (!stretches.empty()) {
    Stretch& before = stretches.back();
    if (before.front == before.back && front == back && before.back == front) {
      before.to = at(last);
      return;
    }
  }
  stretches.push_back({at(first), last < 1.0 ? at(last) : segment.to, front, back});
}

/// The function between its outermost nodes, without gaps.
std::vector<Stretch> stretchesOf(const TransferFunction& function) {
  std::vector<double> xs;
  for (const ColorNode& node : function.colors) xs.push_back(node.x);
  for (const OpacityNode& node : function.opacities) xs.push_back(node.x);
  std::ranges::sort(xs);
  xs.erase(std::unique(xs.begin(), xs.end()), xs.end());
  const auto colorOf = [](const ColorNode& node) { return node.color; };
  const auto opacityOf = [](const OpacityNode& node) { return node.opacity; };
  // An error of 0.002 of the extinction is at most 0.0008 of opacity. Functions with very many nodes get
  // fewer parts between nodes.
  constexpr std::size_t most = 60000;
  constexpr int levels = 32;
  std::vector<Stretch> stretches;
  for (int attempt = 0; attempt < 5; ++attempt) {
    const double allowed = 0.002 * std::pow(4.0, attempt);
    stretches.clear();
    for (std::size_t i = 0; i + 1 < xs.size() && stretches.size() <= most; ++i) {
      const Segment segment{xs[i], xs[i + 1], glm::dvec4(function.colorAt(xs[i]), function.opacityAt(xs[i])),
                            glm::dvec4(inFrontOf(function.colors, xs[i + 1], colorOf),
                                       inFrontOf(function.opacities, xs[i + 1], opacityOf))};
      addStretches(segment, 0.0, 1.0, allowed, levels, stretches);
    }
    if (stretches.size() <= most) break;
  }
  return stretches;
}

/// The scalar of an entry.
double scalarOf(const TransferTable& table, std::size_t entry) {
  return table.min + (table.max - table.min) * static_cast<double>(entry) / table.last();
}

/// If two nodes have the same scalar, the later one counts. The table's ramp for a step must end at or before
/// the step, so the entry before the step gets the value behind it.
void fillEntries(const TransferFunction& function, const std::vector<double>& steps, TransferTable& table) {
  const double spacing = (table.max - table.min) / table.last();
  table.entries.resize(table.positions);
  for (std::size_t i = 0; i < table.positions; ++i) {
    double x = scalarOf(table, i);
    const auto step = std::ranges::upper_bound(steps, x);
    if (step != steps.end() && *step < x + spacing) x = *step;
    table.entries[i] = stored(entryAt(function, x));
  }
}

/// The means of the function from each entry to the next. Between entries, extinction may be far from linear:
/// an opacity that rises to nearly 1 has a mean that is much less than that of its ends. Beside an entry of
/// opacity 1, the mean is that of the ends: edges of opaque bands are as sharp at any sampling rate.
void fillMeans(const TransferFunction& function, const std::vector<Stretch>& stretches,
               TransferTable& table) {
  table.means.resize(table.positions - 1);
  const glm::dvec4 below = entryAt(function, stretches.empty() ? table.min : stretches.front().from - 1.0);
  const glm::dvec4 above = entryAt(function, table.max);
  std::size_t at = 0;
  for (std::size_t i = 0; i + 1 < table.positions; ++i) {
    const double from = scalarOf(table, i);
    const double to = scalarOf(table, i + 1);
    glm::dvec4 sum(0.0);
    double place = from;
    if (!stretches.empty() && place < stretches.front().from) {
      const double end = std::min(to, stretches.front().from);
      sum += (end - place) * below;
      place = end;
    }
    while (at < stretches.size() && stretches[at].to <= place) ++at;
    for (std::size_t k = at; place < to && k < stretches.size() && stretches[k].from < to; ++k) {
      const Stretch& stretch = stretches[k];
      const double end = std::min(to, stretch.to);
      const double middle = (0.5 * (place + end) - stretch.from) / (stretch.to - stretch.from);
      sum += (end - place) * glm::mix(stretch.front, stretch.back, middle);
      place = end;
    }
    if (place < to) sum += (to - place) * above;
    table.means[i] = sum / (to - from);
    const glm::vec4 ends = 0.5F * (table.entries[i].vector() + table.entries[i + 1].vector());
    if (ends.a >= 0.5F * maxExtinction) table.means[i] = ends;
  }
}

/// Puts stretches into the device's numbers, which are floats. A plateau between two steps that is about as
/// narrow as their rounding errors, such as one of the labels of an atlas with large ids, becomes wide enough
/// for its scalars; a narrower one that another already occupies is lost. Narrow ramps become steps.
class Pieces {
 public:
  explicit Pieces(TransferTable& table) : table_(table) {}

  void add(const Stretch& stretch, bool betweenSteps) {
    const double from = positionOf(stretch.from);
    const double to = positionOf(stretch.to);
    const double middle = 0.5 * (from + to);
    const double rounding = 0x1p-20 * std::abs(middle);  // of a few operations on the device
    auto start = static_cast<float>(from);
    auto end = static_cast<float>(to);
    const bool isNarrow = betweenSteps && to - from < 2.0 * rounding;
    if (isNarrow) {
      start = static_cast<float>(middle - rounding);
      end = static_cast<float>(middle + rounding);
      if (endOfNarrow_ > start) {
        start = std::max(start, 0.5F * (middleOfNarrow_ + static_cast<float>(middle)));
        if (!(start > startOfNarrow_ && static_cast<float>(middle) >= start &&
              middleOfNarrow_ < static_cast<float>(middle))) {
          table_.lost.push_back(0.5 * (stretch.from + stretch.to));
          return;
        }
      }
      startOfNarrow_ = start;
      endOfNarrow_ = end;
      middleOfNarrow_ = static_cast<float>(middle);
      while (table_.pieces.size() > 1 && table_.pieces.back().start >= start) table_.pieces.pop_back();
    } else {
      start = std::max(start, endOfNarrow_);
      if (!(start < end)) return;
    }
    table_.pieces.push_back({start, stretch.front, stretch.back});
  }

  void addConstant(double start, const glm::dvec4& entry) {
    const auto from = static_cast<float>(start);
    table_.pieces.push_back({std::max(from, endOfNarrow_), entry, entry});
  }

 private:
  double positionOf(double scalar) const {
    return (scalar - table_.min) / (table_.max - table_.min) * table_.last();
  }
  TransferTable& table_;
  float startOfNarrow_ = static_cast<float>(-farPosition);
  float endOfNarrow_ = static_cast<float>(-farPosition);
  float middleOfNarrow_ = static_cast<float>(-farPosition);
};

void fillPieces(const TransferFunction& function, const std::vector<Stretch>& stretches,
                TransferTable& table) {
  table.positions = largestTable;
  const double first = table.min;
  const double last = table.max;
  table.min = std::clamp(0.0, first, last);
  const double span = last > first ? last - first : std::max(std::abs(first), 1e-30);
  table.max = table.min + span;
  Pieces pieces(table);
  pieces.addConstant(-farPosition,
                     entryOf(function.colors.front().color, function.opacities.front().opacity));
  const auto isStep = [](const glm::dvec4& front, const glm::dvec4& back) {
    const glm::dvec4 off = glm::abs(front - back);
    return std::max({off.r, off.g, off.b, off.a}) > 1e-3;
  };
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const Stretch& stretch = stretches[i];
    const bool stepsUp = i == 0 || isStep(stretches[i - 1].back, stretch.front);
    const bool stepsDown = i + 1 == stretches.size() || isStep(stretch.back, stretches[i + 1].front);
    pieces.add(stretch, stepsUp && stepsDown);
  }
  pieces.addConstant((last - table.min) / span * table.last(),
                     entryOf(function.colors.back().color, function.opacities.back().opacity));
}

}  // namespace

TransferTable bake(const TransferFunction& transferFunction) {
  validate(transferFunction);
  const auto& [colors, opacities, unitDistance] = transferFunction;
  const Changes hues = changesOf(colors, [](const ColorNode& node) { return node.color; });
  const Changes opaque = changesOf(opacities, [](const OpacityNode& node) { return node.opacity; });
  TransferTable table;
  table.unitDistance = unitDistance;
  table.min = std::min(colors.front().x, opacities.front().x);
  table.max = std::max(colors.back().x, opacities.back().x);
  std::vector<double> steps;
  const double closest = std::min(scanNodes(colors, hues, steps), scanNodes(opacities, opaque, steps));
  std::ranges::sort(steps);
  const std::vector<Stretch> stretches = stretchesOf(transferFunction);
  const double entriesBetween = steps.empty() ? 2.0 : 8.0;
  const auto resolves = [&](std::size_t size) {
    return closest * static_cast<double>(size - 1) >= entriesBetween * (table.max - table.min);
  };
  if (!resolves(largestTable) || (table.max == table.min && !steps.empty())) {
    fillPieces(transferFunction, stretches, table);
    return table;
  }
  if (!(table.max > table.min)) {
    // A constant. The table is made much wider than the rounding errors of floats.
    const double half = std::max(std::abs(table.min), 1e-30) * 1e-3;
    table.min -= half;
    table.max += half;
  } else if (std::ranges::binary_search(steps, table.min)) {
    table.min -= 4.0 / smallestTable * (table.max - table.min);  // the first entry lies in front of the step
  }
  table.positions = steps.empty() ? smallestTable : tableOfSteps;
  while (table.positions < largestTable && !resolves(table.positions)) table.positions *= 2;
  fillEntries(transferFunction, steps, table);
  fillMeans(transferFunction, stretches, table);
  return table;
}

std::size_t pieceAt(const std::vector<TransferPiece>& pieces, double position) {
  const auto next = std::ranges::upper_bound(pieces, position, {}, &TransferPiece::start);
  return next == pieces.begin() ? 0 : static_cast<std::size_t>(next - pieces.begin()) - 1;
}

std::string describeLoss(const TransferFunction& transferFunction) {
  const std::vector<double> lost = bake(transferFunction).lost;
  if (lost.empty()) return {};
  constexpr std::size_t most = 5;
  std::string scalars;
  for (std::size_t i = 0; i < std::min(lost.size(), most); ++i)
    scalars += fmt::format("{}{:.15g}", i > 0 ? ", " : "", lost[i]);
  if (lost.size() > most) scalars += fmt::format(" and {} more", lost.size() - most);
  return fmt::format(
      "the picture doesn't show the transfer function's own colour at {}: the 32-bit floats on the device "
      "can't "
      "tell these scalars from their neighbours; number the labels anew, from 0",
      scalars);
}

double TransferTable::positionOf(double scalar) const {
  assert(positions >= 2 && max > min);
  return std::clamp((scalar - min) / (max - min) * last(), -farPosition, farPosition);
}

namespace {

/// The two neighbours of a position, and its distance from the first one as a share of theirs.
struct Neighbors {
  glm::vec4 below;
  glm::vec4 above;
  float share;
};

Neighbors neighborsOf(const TransferTable& table, double position) {
  if (!table.pieces.empty()) {
    const std::size_t index = pieceAt(table.pieces, position);
    const TransferPiece& piece = table.pieces[index];
    if (index + 1 == table.pieces.size()) return {piece.front, piece.back, 0.0F};
    const double width = static_cast<double>(table.pieces[index + 1].start) - piece.start;
    const double share = std::clamp((position - piece.start) / width, 0.0, 1.0);
    return {piece.front, piece.back, static_cast<float>(share)};
  }
  const double inside = std::clamp(position, 0.0, table.last());
  const auto below = std::min(static_cast<std::size_t>(inside), table.positions - 2);
  return {table.entries[below].vector(), table.entries[below + 1].vector(),
          static_cast<float>(inside - static_cast<double>(below))};
}

}  // namespace

TransferTableEntry TransferTable::at(double position) const {
  if (std::isnan(position)) return {};
  const Neighbors neighbors = neighborsOf(*this, position);
  return stored(glm::mix(neighbors.below, neighbors.above, neighbors.share));
}

glm::vec4 TransferTable::materialAt(double position) const {
  if (std::isnan(position)) return glm::vec4(0.0F);
  const auto materialOf = [](const glm::vec4& entry) {
    if (!(entry.a > 0.0F)) return glm::vec4(0.0F);
    const auto opacity = static_cast<float>(-std::expm1(-std::numbers::ln2 * entry.a));
    return glm::vec4(glm::vec3(entry) / entry.a * opacity, opacity);
  };
  const Neighbors neighbors = neighborsOf(*this, position);
  return glm::mix(materialOf(neighbors.below), materialOf(neighbors.above), neighbors.share);
}

}  // namespace vdi
