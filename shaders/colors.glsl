// Colours of other values than those that give the opacity (Block::colors). Twin of colorAt in
// vdi/reference/Reference.cpp.
//
// A part of raycast.glsl. The program provides params.
#ifndef VDI_COLORS_GLSL
#define VDI_COLORS_GLSL

// The number of these values: 1, which the transfer function colours; 3, red, green and blue; or 0, which
// costs nothing. Their pages follow those of the values, in order.
layout(constant_id = 13) const uint colorCount = 0u;
const uint pagesEach = pageCount / (1u + colorCount);

// NaN has the colour of the first node.
vec3 colorOfNodes(float value) {
  // Lanes make equally many passes, and the last node at or below the value is found without branches.
  uint at = 0u;
  for (uint step = params.colorNodeStep; step > 0u; step /= 2u) {
    uint next = min(at + step, params.colorNodeCount - 1u);
    at = params.colorNodes.at[next].a <= value ? next : at;
  }
  vec4 node = params.colorNodes.at[at];
  vec4 behind = params.colorNodes.at[min(at + 1u, params.colorNodeCount - 1u)];
  float apart = max(behind.a - node.a, 1.2e-38);
  return mix(node.rgb, behind.rgb, value >= node.a ? clamp((value - node.a) / apart, 0.0, 1.0) : 0.0);
}

vec3 colorAt(Brick brick, float place) {
  vec3 coordinate = coordinateOf(brick, place);
  vec3 texels = vec3(texel(brick.page + pagesEach, coordinate));
  if (colorCount > 1u) {
    texels.g = texel(brick.page + 2u * pagesEach, coordinate);
    texels.b = texel(brick.page + 3u * pagesEach, coordinate);
  }
  vec3 values = texels * brick.colorScale + brick.colorOffset;
  if (colorCount == 1u) return colorOfNodes(values.r);
  return mix(vec3(0.0), min(values, 1.0), greaterThan(values, vec3(0.0)));  // NaN is black
}

// A sample, or a part of one, with the colour of its middle.
Sample colored(Brick brick, float middle, Sample it) {
  if (colorCount > 0u && it.opticalDepth > 0.0) it.color = colorAt(brick, middle);
  return it;
}

#endif
