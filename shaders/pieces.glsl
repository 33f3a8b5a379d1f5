// Supersegments as render.comp reads them: the words of RenderSegment.
//
// Needs: shared/render.h, exact.glsl.

// Straight colour in 11, 11 and 10 bits; those of codes, in 8 bits, stay as they are.
const uvec3 mostPieceColor = uvec3(2040u, 2040u, 1020u);

uint packedPieceColor(vec3 straight) {
  uvec3 codes = uvec3(round(clamp(straight, 0.0, 1.0) * vec3(mostPieceColor)));
  return codes.r | codes.g << 11 | codes.b << 22;
}

// In units of pieceColorUnit; green stays where it is.
const vec3 pieceColorUnit = 1.0 / (vec3(mostPieceColor) * vec3(1.0, 2048.0, 1.0));

vec3 pieceColor(uvec4 piece) {
  return vec3(exactFloat(piece.w & 0x7ffu), exactFloat(piece.w & 0x3ff800u), exactFloat(piece.w >> 22));
}

float pieceDensity(uvec4 piece) { return uintBitsToFloat(piece.z); }

// Front and back.
vec2 pieceDepths(uvec4 piece) { return uintBitsToFloat(piece.xy); }
