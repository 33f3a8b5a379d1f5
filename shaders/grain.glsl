// Grains in memory are two vec4; see GrainArray.

Grain grainOf(vec4 a, vec4 b) { return Grain(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w); }
vec4 firstHalf(Grain g) { return vec4(g.front, g.back, g.red, g.green); }
vec4 secondHalf(Grain g) { return vec4(g.blue, g.opticalDepth, g.before, g.cost); }
