#include "vdi/core/SlabTable.h"

#include <algorithm>
#include <cmath>

#include "shaders/shared/slab.h"
#include "vdi/core/Half.h"
#include "vdi/core/Parallel.h"
#include "vdi/core/Supersegment.h"

namespace vdi {

namespace {

using gpu::shared::slabParts;
using gpu::shared::slabSide;
using gpu::shared::slabStripStep;
using gpu::shared::slabThin;

/// Premultiplied colour and opacity of material with that mean entry along `length`.
glm::dvec4 accumulated(const glm::dvec4& mean, double length) {
  const double depth = std::max(mean.a, 0.0) * length;
  if (!(depth > 0.0)) return glm::dvec4(0.0);
  const double opacity = -std::expm1(-depth * 0.69314718055994531);
  return glm::max(mean / mean.a, 0.0) * opacity;
}

}  // namespace

namespace {

/// A distance between positions below which rounding spoils the difference of two sums over entries.
constexpr double nearlyNothing = 1e-6;

}  // namespace

SlabIntegral::SlabIntegral(const TransferTable& table)
    : pieces_(table.pieces), sums_(std::max(table.entries.size(), table.pieces.size())) {
  // The entries give the distribution between them, and the mean its sum.
  for (std::size_t i = 0; i + 1 < table.entries.size(); ++i) {
    const glm::dvec4 mean = table.means[i];
    Gap gap{table.entries[i].vector(), table.entries[i + 1].vector()};
    const glm::dvec4 ends = 0.5 * (gap.front + gap.back);
    for (int k = 0; k < 4; ++k) {
      gap.front[k] = ends[k] > 0.0 ? gap.front[k] / ends[k] * mean[k] : mean[k];
      gap.back[k] = ends[k] > 0.0 ? gap.back[k] / ends[k] * mean[k] : mean[k];
    }
    gaps_.push_back(gap);
    sums_[i + 1] = sums_[i] + mean;
  }
  if (!table.entries.empty()) ends_ = {table.entries.front().vector(), table.entries.back().vector()};
  // The first piece has no end in front.
  for (std::size_t i = 2; i < pieces_.size(); ++i) {
    const TransferPiece& piece = pieces_[i - 1];
    const double width = static_cast<double>(pieces_[i].start) - piece.start;
    sums_[i] = sums_[i - 1] + 0.5 * width * (glm::dvec4(piece.front) + glm::dvec4(piece.back));
  }
}

glm::dvec4 SlabIntegral::upTo(double position) const {
  const double inside = std::clamp(position, 0.0, static_cast<double>(gaps_.size()));
  const auto below = std::min(static_cast<std::size_t>(inside), gaps_.size() - 1);
  const double share = inside - static_cast<double>(below);
  const Gap& gap = gaps_[below];
  return sums_[below] + share * (gap.front + 0.5 * share * (gap.back - gap.front)) +
         (position - inside) * (position < inside ? ends_.front : ends_.back);
}

double SlabIntegral::endOf(std::size_t piece) const {
  return piece + 1 < pieces_.size() ? pieces_[piece + 1].start : farPosition;
}

glm::dvec4 SlabIntegral::inPiece(std::size_t piece, double position) const {
  const TransferPiece& it = pieces_[piece];
  const double share = std::clamp((position - it.start) / (endOf(piece) - it.start), 0.0, 1.0);
  return glm::mix(glm::dvec4(it.front), glm::dvec4(it.back), share);
}

glm::dvec4 SlabIntegral::meanOfPieces(double low, double high) const {
  const std::size_t first = pieceAt(pieces_, low);
  const std::size_t last = pieceAt(pieces_, high);
  if (first == last) return inPiece(first, 0.5 * (low + high));
  const double begin = endOf(first);
  const double end = pieces_[last].start;
  const glm::dvec4 inFirst = inPiece(first, low) + glm::dvec4(pieces_[first].back);
  const glm::dvec4 inLast = glm::dvec4(pieces_[last].front) + inPiece(last, high);
  const glm::dvec4 sum =
      0.5 * (begin - low) * inFirst + (sums_[last] - sums_[first + 1]) + 0.5 * (high - end) * inLast;
  return sum / (high - low);
}

glm::dvec4 SlabIntegral::meanEntry(double front, double back) const {
  if (!pieces_.empty()) return meanOfPieces(std::min(front, back), std::max(front, back));
  if (std::abs(back - front) >= nearlyNothing) return (upTo(back) - upTo(front)) / (back - front);
  const double middle = 0.5 * (front + back);
  return (upTo(middle + 0.5 * nearlyNothing) - upTo(middle - 0.5 * nearlyNothing)) / nearlyNothing;
}

glm::dvec4 SlabIntegral::mean(double front, double back, double length) const {
  return accumulated(meanEntry(front, back), length);
}

// Divides the slab into parts of equal length, front to back. Within a part, light from all places counts the
// same. Their number suffices to separate the transfer function's features.
glm::dvec4 SlabIntegral::between(double front, double back, double length) const {
  constexpr double opaque = 16.0;  // optical depth above which nothing shines through
  constexpr double maxParts = 64.0;
  const glm::dvec4 whole = meanEntry(front, back);
  const double span = back - front;
  const bool isPoint = pieces_.empty() ? std::abs(span) < nearlyNothing : span == 0.0;
  if (whole.a * length <= slabThin || isPoint) return accumulated(whole, length);
  const int parts = !pieces_.empty() ? static_cast<int>(slabParts)
                                     : static_cast<int>(std::clamp(std::abs(span), 1.0, maxParts));
  glm::dvec4 sum(0.0);
  double before = front;
  glm::dvec4 upToBefore = pieces_.empty() ? upTo(front) : glm::dvec4(0.0);
  for (int part = 1; part <= parts && sum.a < 1.0 - std::exp2(-opaque); ++part) {
    const double here = front + span * part / parts;
    glm::dvec4 mean;
    if (pieces_.empty()) {
      const glm::dvec4 upToHere = upTo(here);
      mean = (upToHere - upToBefore) / (here - before);
      upToBefore = upToHere;
    } else {
      mean = meanEntry(before, here);
    }
    sum += (1.0 - sum.a) * accumulated(mean, length / parts);
    before = here;
  }
  return sum;
}

namespace {

/// Limits colours to white, also after rounding to half floats.
glm::u16vec4 texelOf(const glm::dvec4& slab) {
  const glm::u16vec4 half = toHalf(glm::vec4(slab));
  // Compares numbers: a falling slab gives -0 to a channel of 0, and the bits of -0 exceed all others.
  const glm::vec4 rounded = fromHalf(half);
  return toHalf(glm::max(glm::min(rounded, glm::vec4(rounded.a)), glm::vec4(0.0F)));
}

}  // namespace

std::size_t SlabTable::stripRows() const {
  return (positions - 1 + slabStripStep - 1) / slabStripStep;
}

std::size_t SlabTable::levels() const {
  // The last strip's slabs span at least one step of the square.
  const double step = static_cast<double>(positions - 1) / slabStripStep;
  return static_cast<std::size_t>(std::max(std::ceil(std::log2(step)), 0.0)) + 1;
}

std::size_t SlabTable::height() const {
  return slabSide + levels() * stripRows();
}

float slabLength(const DepthLattice& lattice, const TransferTable& table) {
  return lattice.step > 0.0 ? static_cast<float>(lattice.step / table.unitDistance) : 1.0F;
}

SlabTable makeSlabTable(const TransferTable& transfer, float length) {
  SlabTable table;
  table.length = length;
  table.positions = transfer.positions;
  if (!transfer.pieces.empty()) {
    table.integral = std::make_shared<const SlabIntegral>(transfer);
    return table;
  }
  table.texels.resize(table.height() * slabSide);
  const SlabIntegral integral(transfer);
  const auto point = [&](double position) { return accumulated(transfer.at(position).vector(), length); };
  const double last = static_cast<double>(table.positions - 1);
  const auto endOf = [&](double position) {
    const glm::vec4 entry = transfer.at(position).vector();
    return entry.a > 0.0F ? glm::vec4(glm::vec3(entry) / entry.a, std::min(entry.a * length, maxExtinction))
                          : glm::vec4(0.0F);
  };
  table.below = endOf(0.0);
  table.above = endOf(last);
  const auto texelAt = [&](std::size_t x, std::size_t y) -> glm::dvec4 {
    if (y < slabSide) {
      const double front = last * static_cast<double>(x) / slabStripStep;
      const double back = last * static_cast<double>(y) / slabStripStep;
      return x == y ? point(front) : integral.between(front, back, length);
    }
    const std::size_t level = (y - slabSide) / table.stripRows();
    const std::size_t row = (y - slabSide) % table.stripRows();
    const double middle = std::min(static_cast<double>(row * slabStripStep + x), last);
    if (level == 0) return point(middle);
    const double half = 0.5 * std::exp2(static_cast<double>(level));
    return integral.mean(middle - half, middle + half, length);
  };
  inParallel(table.height(), 16, [&](std::size_t first, std::size_t end) {
    for (std::size_t y = first; y < end; ++y) {
      for (std::size_t x = 0; x < slabSide; ++x) table.texels[y * slabSide + x] = texelOf(texelAt(x, y));
    }
  });
  return table;
}

namespace {

/// Interpolates linearly between texels, within one row if y is a whole number.
glm::vec4 texelsAt(const SlabTable& table, double x, double y) {
  const auto column = std::min(static_cast<std::size_t>(x), std::size_t{slabSide} - 2);
  const auto row = std::min(static_cast<std::size_t>(y), table.height() - 2);
  const auto inRow = [&](std::size_t at) {
    return glm::mix(fromHalf(table.texels[at * slabSide + column]),
                    fromHalf(table.texels[at * slabSide + column + 1]),
                    static_cast<float>(x - static_cast<double>(column)));
  };
  return glm::mix(inRow(row), inRow(row + 1), static_cast<float>(y - static_cast<double>(row)));
}

/// The slab of a filtered texel.
Slab slabOf(const glm::vec4& texel) {
  if (!(texel.a > 0.0F)) return {};
  return {glm::vec3(texel) / texel.a, opticalDepthOf(texel.a)};
}

/// The slab between two positions within the transfer table.
glm::vec4 inside(const SlabTable& table, double front, double back) {
  const double last = static_cast<double>(table.positions - 1);
  const double toSquare = slabStripStep / last;
  const double span = std::abs(back - front);
  if (span * toSquare >= 1.0) return texelsAt(table, front * toSquare, back * toSquare);
  const double level = std::max(std::ceil(std::log2(span)), 0.0);
  const double middle = 0.5 * (front + back);
  const double row = std::min(std::floor(middle / slabStripStep), static_cast<double>(table.stripRows() - 1));
  return texelsAt(table, middle - row * slabStripStep,
                  slabSide + level * static_cast<double>(table.stripRows()) + row);
}

}  // namespace

Slab SlabTable::between(double front, double back) const {
  if (std::isnan(front) || std::isnan(back)) {
    if (std::isnan(front)) front = back;
    if (std::isnan(back)) back = front;
    if (std::isnan(back)) return {};
    Slab slab = between(front, back);
    slab.opticalDepth *= 0.5F;
    return slab;
  }
  if (integral) {
    const glm::dvec4 seen = integral->between(front, back, length);
    const float depth =
        static_cast<float>(std::min(integral->meanEntry(front, back).a * length, double{maxExtinction}));
    return seen.a > 0.0 ? Slab{glm::vec3(glm::dvec3(seen) / seen.a), depth} : Slab{};
  }
  const double last = static_cast<double>(positions - 1);
  const double frontInside = std::clamp(front, 0.0, last);
  const double backInside = std::clamp(back, 0.0, last);
  const Slab slab = slabOf(inside(*this, frontInside, backInside));
  const double span = std::abs(back - front);
  const double spanInside = std::abs(backInside - frontInside);
  if (!(spanInside > 0.0 && spanInside < span)) return slab;
  // A part of the slab may lie beyond the table's ends.
  const auto shareOf = [&](double part) { return static_cast<float>(part / span); };
  const float depth = slab.opticalDepth * shareOf(spanInside);
  const float depthBelow = below.a * shareOf(std::max(-std::min(front, back), 0.0));
  const float depthAbove = above.a * shareOf(std::max(std::max(front, back) - last, 0.0));
  const float sum = depth + depthBelow + depthAbove;
  if (!(sum > 0.0F)) return {};
  return {(depth * slab.color + depthBelow * glm::vec3(below) + depthAbove * glm::vec3(above)) / sum, sum};
}

}  // namespace vdi
