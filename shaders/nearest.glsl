// Samples of nearest values. Twin of nearestMaterial in vdi/reference/Reference.cpp.
//
// A part of raycast.glsl.
#ifndef VDI_NEAREST_GLSL
#define VDI_NEAREST_GLSL

// A sample is at most two voxels long, along each axis.
const uint maxPartsOfSample = 10u;

// Sample k. The faces between voxels cut it into parts, and each part is a slab of one scalar, so that no
// mixture of two voxels' scalars is ever classified.
Sample nearestSample(Brick brick, uint k, float length) {
  float begin = beginOf(k);
  float end = endOf(k);
  vec3 texels = pageSize(brick);
  vec3 from = (positionAt(begin) * brick.texelScale + brick.texelOffset) * texels;
  vec3 way = (positionAt(end) * brick.texelScale + brick.texelOffset) * texels - from;
  bvec3 still = lessThan(abs(way), vec3(1.0e-6));
  vec3 perTexel = 1.0 / mix(way, vec3(1.0), still);
  vec3 face = mix(ceil(from) - 1.0, floor(from) + 1.0, greaterThan(way, vec3(0.0)));
  // The share of the sample before the next face across each axis, and between two faces.
  vec3 next = mix((face - from) * perTexel, vec3(2.0), still);
  vec3 apart = mix(abs(perTexel), vec3(2.0), still);
  vec4 sum = vec4(0.0);
  float opticalDepth = 0.0;
  float share = 0.0;
  // Further passes change nothing: lavapipe may give an invocation the result of later ones.
  for (uint i = 0u; i < maxPartsOfSample && share < 1.0; ++i) {
    float stop = max(min(min(min(next.x, next.y), next.z), 1.0), share);
    next += mix(vec3(0.0), apart, lessThanEqual(next, vec3(stop)));
    float middle = mix(begin, end, 0.5 * (share + stop));
    float position = tablePosition(brick, middle);
    vec4 slab = slabOf(slabTexel(position, position), position, position);
    Sample part = lit(brick, middle, sampleOf(slab, (stop - share) * length));
    sum += (1.0 - sum.a) * part.opacity * vec4(part.color, 1.0);
    opticalDepth += part.opticalDepth;
    share = stop;
  }
  float perSlab = opticalDepth / (params.slabsPerDepth * rayLengthOfDepth * length);
  return sampleOf(vec4(sum.rgb / max(sum.a, 1.0e-30), perSlab), length);
}

#endif
