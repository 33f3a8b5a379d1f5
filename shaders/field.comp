// Procedural scalar fields in single precision; twin of vdi/synthetic/Fields.cpp, which describes them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/field.h"

layout(local_size_x = fieldGroup) in;
layout(push_constant, scalar) uniform Push { FieldConstants push; };

const float pi = 3.14159265;

uint mixed(uint h, int at) {
  h ^= uint(at) + 0x7F4A7C15u + (h << 6) + (h >> 2);
  h *= 0x85EBCA6Bu;
  return h ^ (h >> 13);
}

float random(ivec3 at, uint seed) {
  uint h = mixed(mixed(mixed(seed * 0x9E3779B1u, at.x), at.y), at.z) * 0xC2B2AE35u;
  return float(h ^ (h >> 16)) / 4294967296.0;
}

float noise(vec3 p, uint seed) {
  vec3 base = floor(p);
  vec3 f = p - base;
  vec3 s = f * f * (3.0 - 2.0 * f);
  float sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    ivec3 corners = ivec3(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
    vec3 weight = mix(1.0 - s, s, vec3(corners));
    sum += weight.x * weight.y * weight.z * random(ivec3(base) + corners, seed);
  }
  return sum;
}

float octaves(vec3 p, uint count, uint seed) {
  float sum = 0.0;
  float amplitude = 0.5;
  float frequency = 1.0;
  for (uint i = 0u; i < count; ++i) {
    sum += amplitude * noise(p * frequency, seed + i);
    amplitude *= 0.5;
    frequency *= 2.03;
  }
  return clamp(sum / (1.0 - 2.0 * amplitude), 0.0, 1.0);
}

float square(float x) { return x * x; }

float shells(vec3 p) {
  float r = length(p - 0.5);
  return r > 0.5 ? 0.0 : 0.5 + 0.5 * cos(r * 12.0 * pi);
}

float marschnerLobb(vec3 p) {
  vec3 q = 2.0 * p - 1.0;
  float rho = cos(2.0 * pi * 6.0 * cos(pi * length(q.xy) / 2.0));
  return (1.0 - sin(pi * q.z / 2.0) + 0.25 * (1.0 + rho)) / (2.0 * 1.25);
}

float mixing(vec3 p) {
  float front = 0.5 + 0.35 * (octaves(p * vec3(5.0, 5.0, 3.0), 5u, push.seed) - 0.5);
  float layer = (p.z - front) / 0.12;
  float detail = 0.15 * (octaves(p * 24.0, 3u, push.seed + 77u) - 0.5) * exp(-layer * layer);
  return clamp(0.5 + 0.5 * tanh(layer) + detail, 0.0, 1.0);
}

float interfaces(vec3 p) {
  return clamp(0.5 + 0.5 * tanh(18.0 * (octaves(p * 9.0, 6u, push.seed) - 0.5)), 0.0, 1.0);
}

float coil(vec3 p) {
  vec3 q = p - 0.5;
  float angle = atan(q.y, q.x);
  float r = length(q.xy);
  float best = 0.0;
  for (int turn = -1; turn < 3; ++turn) {
    float along = (angle / (2.0 * pi) + float(turn)) / 3.0;
    float spineR = 0.15 + 0.25 * (along + 0.33);
    float spineZ = 0.3 * sin(6.0 * along);
    float d = length(vec2(r - spineR, q.z - spineZ));
    float wall = exp(-square((d - 0.05) / 0.008));
    // The angle is kept small, so that GPUs compute its cosine exactly.
    float ribs = 0.5 + 0.5 * cos(2.0 * pi * fract(along * 60.0));
    best = max(best, max(wall * ribs, exp(-square(d / 0.012))));
  }
  return clamp(best, 0.0, 1.0);
}

float valueAt(vec3 p) {
  if (push.field == 0u) return clamp(1.0 - 2.0 * length(p - 0.5), 0.0, 1.0);
  if (push.field == 1u) return shells(p);
  if (push.field == 2u) return marschnerLobb(p);
  if (push.field == 3u) return octaves(p * 6.0, 5u, push.seed);
  if (push.field == 4u) return mixing(p);
  if (push.field == 5u) return interfaces(p);
  if (push.field == 6u) return coil(p);
  return (p.x + p.y + p.z) / 3.0;
}

void main() {
  uint index = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * fieldGroup;
  if (index >= push.size.x * push.size.y * push.size.z) return;
  uint row = index / push.size.x;
  vec3 at = vec3(index % push.size.x, row % push.size.y, row / push.size.y);
  push.values.at[index] = valueAt((push.first + at) * push.spacing);
}
