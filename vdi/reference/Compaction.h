// Lists of floats to lists of codes: what generation stores, sends and writes unless full precision is asked
// for. The shaders' twin is shaders/store.glsl.
#pragma once

#include <span>
#include <vector>

#include "vdi/core/Supersegment.h"
#include "vdi/reference/Segmenter.h"

namespace vdi::reference {

/// Front to back. What rounding a supersegment changed is carried to the next:
///   * the optical depth in front of everything later, at most 1/16 of it, and at most a quarter of the next
///     one's own changed for it;
///   * the light that V_O sees, by a change of the next one's colour of at most 3/255.
/// So V_O sees each list within 1/255, however many supersegments it has, and no supersegment differs much
/// from what it stands for, which is what V_N sees. Depths are rounded to the nearest code; an interval that
/// would vanish gets the length of one.
std::vector<CompactSupersegment> compacted(std::span<const Interval> list, const DepthCode& code);

CompactLists compacted(const SupersegmentLists& lists, const DepthCode& code);

}  // namespace vdi::reference
