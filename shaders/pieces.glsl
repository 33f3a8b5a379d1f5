// Supersegments as render.comp reads them: codes as they were stored, or, of a VDI of full precision, RenderSegment.
//
// Needs: shared/render.h, store.glsl.

uvec4 packedPiece(RenderSegmentArray segments, uint i) {
  if (compactForm) return uvec4(CompactArray(segments).at[i], 0u, 0u);
  return segments.at[i];
}

// Front and back.
vec2 pieceDepths(uvec4 packed, StoredForm form) {
  return compactForm ? codedDepths(packed.xy, form) : uintBitsToFloat(packed.xy);
}

// Over the whole interval.
float pieceOpticalDepth(uvec4 packed) {
  return compactForm ? codedOpticalDepth(packed.xy) : unpackHalf2x16(packed.w).y;
}

// Straight.
vec3 pieceColor(uvec4 packed) {
  return compactForm ? codedColor(packed.xy) : vec3(unpackHalf2x16(packed.z), unpackHalf2x16(packed.w).x);
}
