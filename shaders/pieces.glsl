// Supersegments as render.comp reads them: RenderSegment.
//
// Needs: shared/render.h.

// Straight colour in 11, 11 and 10 bits; those of codes, in 8 bits, stay as they are.
const uvec3 mostPieceColor = uvec3(2040u, 2040u, 1020u);

uint packedPieceColor(vec3 straight) {
  uvec3 codes = uvec3(round(clamp(straight, 0.0, 1.0) * vec3(mostPieceColor)));
  return codes.r | codes.g << 11 | codes.b << 22;
}

// In units of pieceColorUnit. Integers become floats as mantissas, where they are: that takes a GPU less time than a conversion.
const vec3 pieceColorUnit = 1.0 / (vec3(mostPieceColor) * vec3(1.0, 2048.0, 1.0));

vec3 pieceColor(RenderSegment piece) {
  uvec3 codes = uvec3(piece.color & 0x7ffu, piece.color & 0x3ff800u, piece.color >> 22);
  return uintBitsToFloat(codes | 0x4b000000u) - 8388608.0;
}
