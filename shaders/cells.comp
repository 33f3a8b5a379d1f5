// Computes each macrocell's range of values when blocks arrive, and its visibility when blocks or the
// transfer table change. The rays of cast.comp skip macrocells without visible values.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/cast.h"
#include "shared/cells.h"

#include "pages.glsl"

layout(local_size_x = cellsGroup) in;
layout(push_constant, scalar) uniform Push { CellsConstants push; };

uint pieceOf(uint cell) {
  uint low = 0u;
  uint high = push.pieceCount;
  while (high - low > 1u) {
    uint middle = (low + high) / 2u;
    if (push.pieces.at[middle].firstCell <= cell) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

uint ordered(float value) {
  uint bits = floatBitsToUint(value);
  return (bits >> 31) != 0u ? ~bits : bits | 0x80000000u;
}

float unordered(uint bits) { return uintBitsToFloat((bits >> 31) != 0u ? bits & 0x7FFFFFFFu : ~bits); }

// Smallest value, and inverted largest one, that the workgroup's invocations have found.
shared uint minimum;
shared uint minInverted;
shared uint ownMinimum;  // the same for own texels
shared uint ownMinInverted;
shared uint infinite;  // bit 0: +infinity occurs, bit 1: -infinity occurs

// Takes the texels [first, last] into account, and those of them in [ownFirst, ownLast] as own. Each of the
// workgroup's invocations takes a row of texels at a time.
void scan(CellPiece piece, ivec3 first, ivec3 last, ivec3 ownFirst, ivec3 ownLast) {
  const float largest = 3.402823466e38;
  float infiniteTexel = uintBitsToFloat(infiniteTexelBits);
  vec2 range = vec2(largest, -largest);
  vec2 own = vec2(largest, -largest);
  int rows = last.y - first.y + 1;
  int count = rows * (last.z - first.z + 1);
  for (int row = int(gl_LocalInvocationIndex); row < count; row += int(cellsGroup)) {
    ivec3 texel = ivec3(first.x, first.y + row % rows, first.z + row / rows);
    ivec3 at = ivec3(piece.place) + texel;
    bool ownRow = clamp(texel.yz, ownFirst.yz, ownLast.yz) == texel.yz;
    int begin = ownRow ? ownFirst.x : last.x + 1;
    int end = ownLast.x;
    for (int x = first.x; x <= last.x; ++x, ++at.x) {
      float value = texelAt(piece.page, at);
      // NaN is transparent, and so is anything interpolated with it.
      if (abs(value) == infiniteTexel) {
        atomicOr(infinite, value > 0.0 ? 1u : 2u);
      } else if (abs(value) <= largest) {
        range = vec2(min(range.x, value), max(range.y, value));
        if (x >= begin && x <= end) own = vec2(min(own.x, value), max(own.y, value));
      }
    }
  }
  if (range.x <= range.y) {
    atomicMin(minimum, ordered(range.x));
    atomicMin(minInverted, ~ordered(range.y));
  }
  if (own.x <= own.y) {
    atomicMin(ownMinimum, ordered(own.x));
    atomicMin(ownMinInverted, ~ordered(own.y));
  }
}

// Measures a cell with a workgroup.
void measure(CellPiece piece, uint pieceIndex, uint cell) {
  uint index = cell - piece.firstCell;
  uvec3 cellAt = uvec3(index % piece.cellDims.x, (index / piece.cellDims.x) % piece.cellDims.y,
                       index / (piece.cellDims.x * piece.cellDims.y));
  ivec3 first = max(ivec3(cellAt * cellSide) - 1, ivec3(0));
  ivec3 last = min(ivec3((cellAt + 1u) * cellSide) + 1, ivec3(piece.dims) - 1);
  if (gl_LocalInvocationIndex == 0u) {
    minimum = ~0u;
    minInverted = ~0u;
    ownMinimum = ~0u;
    ownMinInverted = ~0u;
    infinite = 0u;
  }
  barrier();
  // The cell with the first box that meets it, then the common texels with each further one.
  bool isFirst = true;
  for (uint i = 0u; i < piece.ownCount; ++i) {
    TexelBox box = push.own.at[piece.firstOwn + i];
    ivec3 ownFirst = max(first, ivec3(box.lo));
    ivec3 ownLast = min(last, ivec3(box.hi) - 1);
    if (any(lessThan(ownLast, ownFirst))) continue;
    if (isFirst) {
      scan(piece, first, last, ownFirst, ownLast);
    } else {
      scan(piece, ownFirst, ownLast, ownFirst, ownLast);
    }
    isFirst = false;
  }
  if (isFirst) scan(piece, first, last, ivec3(0), ivec3(-1));
  barrier();
  if (gl_LocalInvocationIndex != 0u) return;
  const float largest = 3.402823466e38;
  float infiniteTexel = uintBitsToFloat(infiniteTexelBits);
  bool found = minimum != ~0u;
  vec2 all = found ? vec2(unordered(minimum), unordered(~minInverted)) : vec2(largest, -largest);
  if ((infinite & 1u) != 0u) all = vec2(min(all.x, infiniteTexel), max(all.y, infiniteTexel));
  if ((infinite & 2u) != 0u) all = vec2(min(all.x, -infiniteTexel), max(all.y, -infiniteTexel));
  push.ranges.at[cell] = all;
  uint words = pieceRangeWords * pieceIndex;
  if (found) {
    atomicMin(push.pieceRanges.at[words + pieceRangeAll], minimum);
    atomicMin(push.pieceRanges.at[words + pieceRangeAll + 1u], minInverted);
  }
  if (ownMinimum != ~0u) {
    atomicMin(push.pieceRanges.at[words + pieceRangeOwn], ownMinimum);
    atomicMin(push.pieceRanges.at[words + pieceRangeOwn + 1u], ownMinInverted);
  }
  if (infinite != 0u) atomicMin(push.pieceRanges.at[words + pieceRangeInfinite], 0u);
}

uint pieceOfTable(float position) {
  uint low = 0u;
  uint high = push.tableSize;
  while (high - low > 1u) {
    uint middle = (low + high) / 2u;
    if (push.pieceStarts.at[middle] <= position) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

void classify(CellPiece piece, uint cell) {
  vec2 range = push.ranges.at[cell];
  bool visible = false;
  if (range.x <= range.y) {
    vec2 positions = (range - piece.tableOrigin) * piece.tableScale;
    uint begin;
    uint end;
    if (push.hasPieces != 0u) {
      // Interpolated values may exceed the range by rounding.
      vec2 spare = 4.0e-7 * (abs(range) + abs(piece.tableOrigin)) * piece.tableScale;
      begin = pieceOfTable(positions.x - spare.x);
      end = pieceOfTable(positions.y + spare.y) + 1u;
    } else {
      // The table is linear between entries, so the entries on both sides count.
      float last = float(push.tableSize - 1u);
      vec2 places = clamp(positions + vec2(-0.01, 0.01), vec2(0.0), vec2(last));
      begin = uint(places.x);
      end = min(uint(ceil(places.y)) + 1u, push.tableSize);
    }
    visible = push.visibleBefore.at[end] > push.visibleBefore.at[begin];
  }
  push.visible.at[cell] = visible ? 1u : 0u;
}

void main() {
  bool byGroups = push.mode == cellsModeMeasure;
  uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
  uint cell = byGroups ? group : group * cellsGroup + gl_LocalInvocationIndex;
  if (cell >= push.cellCount) return;
  uint index = pieceOf(cell);
  CellPiece piece = push.pieces.at[index];
  if (byGroups) {
    measure(piece, index, cell);
  } else {
    classify(piece, cell);
  }
}
