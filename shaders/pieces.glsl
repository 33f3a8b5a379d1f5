// Supersegments as render.comp reads them: codes as they were stored, or, of a VDI of full precision, RenderSegment.
//
// Needs: shared/render.h, store.glsl.

vec2 pieceDepths(RenderSegmentArray segments, uint i, StoredForm form) {
  if (compactForm) return codedDepths(uvec2(CompactArray(segments).at[i].x, 0u), form);
  return uintBitsToFloat(segments.at[i].xy);
}

struct Piece {
  vec2 depths;  // front, back
  vec3 color;   // straight
  float opticalDepth;
};

Piece pieceAt(RenderSegmentArray segments, uint i, StoredForm form) {
  if (compactForm) {
    uvec2 packed = CompactArray(segments).at[i];
    return Piece(codedDepths(packed, form), codedColor(packed), codedOpticalDepth(packed));
  }
  uvec4 packed = segments.at[i];
  vec2 blueOpticalDepth = unpackHalf2x16(packed.w);
  return Piece(uintBitsToFloat(packed.xy), vec3(unpackHalf2x16(packed.z), blueOpticalDepth.x), blueOpticalDepth.y);
}
