// The material of a slab, integrated from the pieces of a transfer function that even samples can't resolve. Twin
// of SlabIntegral in vdi/core/SlabTable.cpp.
//
// A part of slab.glsl.
#ifndef VDI_PIECES_GLSL
#define VDI_PIECES_GLSL

// The piece at a position. There is no loop that lanes leave at different times, for lavapipe miscounts there.
uint pieceAt(float position) {
  uint piece = 0u;
  [[unroll]] for (uint stride = 32768u; stride > 0u; stride >>= 1) {
    uint next = piece + stride;
    if (next < params.pieceCount) piece = params.pieceStarts.at[next] <= position ? next : piece;
  }
  return piece;
}

vec4 inPiece(SlabPiece piece, float position) {
  float share = clamp((position - piece.start) / (piece.end - piece.start), 0.0, 1.0);
  return mix(piece.front, piece.back, share);
}

// The piece at the back of the last slab: most slabs lie in one piece, and in that of the slab before.
uint lastPiece = 0u;

// The mean of associated colour and extinction between two positions.
vec4 meanEntry(float front, float back) {
  float low = min(front, back);
  float high = max(front, back);
  SlabPiece before = params.pieces.at[lastPiece];
  if (low >= before.start && high < before.end) return inPiece(before, 0.5 * (low + high));
  uint first = pieceAt(low);
  lastPiece = first;
  SlabPiece begin = params.pieces.at[first];
  if (high <= begin.end) return inPiece(begin, 0.5 * (low + high));
  uint last = pieceAt(high);
  lastPiece = front < back ? last : first;
  SlabPiece behind = params.pieces.at[first + 1u];
  SlabPiece end = params.pieces.at[last];
  vec4 sum = (end.sum - behind.sum) + (end.sumRest - behind.sumRest);
  sum += 0.5 * (begin.end - low) * (inPiece(begin, low) + begin.back);
  sum += 0.5 * (high - end.start) * (end.front + inPiece(end, high));
  return sum / (high - low);
}

// Straight colour and optical depth of a slab as long as the table's.
vec4 slabOfPieces(float front, float back) {
  vec4 whole = meanEntry(front, back);
  float depth = max(whole.a, 0.0) * params.slabLength;
  vec3 color = whole.rgb;
  if (depth > slabThin && front != back) {
    float passes = 1.0;
    color = vec3(0.0);
    // Light that reaches the front, by the opacity of the parts.
    for (uint part = 0u; part < slabParts; ++part) {
      float begin = mix(front, back, float(part) / float(slabParts));
      float end = mix(front, back, float(part + 1u) / float(slabParts));
      vec4 mean = meanEntry(begin, end);
      float opacity = opacityOf(max(mean.a, 0.0) * params.slabLength / float(slabParts));
      color += passes * opacity * mean.rgb / max(mean.a, 1.0e-30);
      passes *= 1.0 - opacity;
    }
    color /= max(1.0 - passes, 1.0e-30);
  } else {
    color /= max(whole.a, 1.0e-30);
  }
  return vec4(clamp(color, vec3(0.0), vec3(1.0)), min(depth, maxOpticalDepth));
}

#endif
