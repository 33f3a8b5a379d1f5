// A grain in memory: 24 bytes, two accesses. Front and back; premultiplied colour over all of it and optical depth, which is
// negative if the grain must not be merged with the one before it.
//
// Needs: shared/lists.h.

struct StoredGrain {
  vec2 span;
  vec4 light;
};

vec4 lightOf(StoredGrain grain) { return vec4(grain.light.rgb, abs(grain.light.a)); }

bool isCut(StoredGrain grain) { return grain.light.a < 0.0; }

void storeGrain(GrainSpans spans, GrainLights lights, uint i, vec2 span, vec4 light, bool cut) {
  spans.at[i] = span;
  lights.at[i] = vec4(light.rgb, cut ? -light.a : light.a);
}

StoredGrain loadGrain(GrainSpans spans, GrainLights lights, uint i) { return StoredGrain(spans.at[i], lights.at[i]); }
