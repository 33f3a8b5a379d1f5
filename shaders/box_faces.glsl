// The depths at which the rays of V_O's picture enter and leave the VDI's box. Twin of passageOf in
// vdi/reference/Slopes.cpp.
//
// Needs: shared/render.h; push.

// A face of the box that a list's ray goes through.
struct FacePassage {
  vec4 face;
  float depth;
  float rate;  // distance from the face per depth; > 0 where the ray enters the box
};

struct BoxPassage {
  FacePassage enter;
  FacePassage leave;
};

// `place` is in lists from the picture's lower left corner.
FacePassage facePassage(vec4 face, vec2 place) {
  vec2 plane = (place - 0.5 * vec2(push.lists)) * push.pixelSize;
  float along = dot(face.xy, plane);
  if (push.perspective != 0u) return FacePassage(face, face.w / (along + face.z), along + face.z);
  return FacePassage(face, (face.w - along) / face.z, face.z);
}

BoxPassage boxPassage(ivec2 pixel) {
  const float infinity = 1.0 / 0.0;
  BoxPassage passage = BoxPassage(FacePassage(vec4(0.0), -infinity, 1.0),
                                  FacePassage(vec4(0.0), infinity, -1.0));
  for (uint i = 0u; i < renderFaces; ++i) {
    FacePassage through = facePassage(push.boxFaces.at[i], vec2(pixel) + 0.5);
    if (through.rate > 0.0 && through.depth > passage.enter.depth) passage.enter = through;
    if (through.rate < 0.0 && through.depth < passage.leave.depth) passage.leave = through;
  }
  return passage;
}

bool isOnFace(float depth, FacePassage passage) {
  return abs(depth - passage.depth) <= push.rounding.depth + push.rounding.distance / abs(passage.rate);
}

// The least and the greatest depth of the face within 1.5 lists of the list's centre; infinite where rays run
// along the face.
vec2 faceDepthsAround(FacePassage passage, ivec2 pixel) {
  vec2 depths = vec2(passage.depth);
  for (uint corner = 0u; corner < 4u; ++corner) {
    vec2 place = vec2(pixel) + 0.5 + 1.5 * vec2(float(corner & 1u) * 2.0 - 1.0, float(corner & 2u) - 1.0);
    FacePassage there = facePassage(passage.face, place);
    bool isThrough = there.rate * passage.rate > 0.0;
    depths.x = min(depths.x, isThrough ? there.depth : -1.0 / 0.0);
    depths.y = max(depths.y, isThrough ? there.depth : 1.0 / 0.0);
  }
  return depths;
}
