// Grains in memory.
//
// Needs: shared/lists.h.

vec4 lightOf(StoredGrain grain) { return vec4(grain.light.rgb, abs(grain.light.a)); }

bool isCut(StoredGrain grain) { return grain.light.a < 0.0; }

StoredGrain storedGrain(vec2 span, float before, vec4 light, bool cut) {
  return StoredGrain(span, before, 0.0, vec4(light.rgb, cut ? -light.a : light.a));
}
