// Supersegments as render.comp reads them: codes as they were stored, or, of a VDI of full precision, RenderSegment.
//
// Needs: shared/render.h, store.glsl.

uvec4 packedPiece(RenderSegmentArray segments, uint i) {
  if (compactForm) return uvec4(CompactArray(segments).at[i], 0u, 0u);
  return segments.at[i];
}

// Front and back, in units of their own: depth = placeOrigin + placeUnit * place.
vec2 piecePlaces(uvec4 packed) {
  uvec2 codes = depthCodes(packed.xy);
  return compactForm ? vec2(exactFloat(codes.x), exactFloat(codes.y)) : uintBitsToFloat(packed.xy);
}

float placeOrigin(StoredForm form) { return compactForm ? form.depthFirst : 0.0; }
float placeUnit(StoredForm form) { return compactForm ? form.depthStep : 1.0; }

// Over the whole interval.
float pieceOpticalDepth(uvec4 packed) {
  return compactForm ? codedOpticalDepth(packed.xy) : unpackHalf2x16(packed.w).y;
}

// Straight.
vec3 pieceColor(uvec4 packed) {
  return compactForm ? codedColor(packed.xy) : vec3(unpackHalf2x16(packed.z), unpackHalf2x16(packed.w).x);
}
