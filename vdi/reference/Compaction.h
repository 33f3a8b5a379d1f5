// Converts lists of floats to lists of codes, which generation stores, sends and writes unless full precision
// is requested. The shaders' twin is shaders/store.glsl.
#pragma once

#include <span>
#include <vector>

#include "vdi/core/Supersegment.h"
#include "vdi/reference/Segmenter.h"

namespace vdi::reference {

/// Encodes a list front to back. Rounding errors of a supersegment are carried to the next one:
///   * the error of the optical depth in front of everything later, at most 1/16, and by changing at
///     most a quarter of the next supersegment's own optical depth;
///   * the error of the light that V_O sees, by changing the next supersegment's colour by at most 3/255.
/// So V_O sees each list within 1/255, however many supersegments it has, and each supersegment stays close
/// to its original, which matters to V_N. Depths are rounded to the nearest code; an interval that would
/// vanish gets the length of one code.
std::vector<CompactSupersegment> compacted(std::span<const Interval> list, const DepthCode& code);

CompactLists compacted(const SupersegmentLists& lists, const DepthCode& code);

}  // namespace vdi::reference
