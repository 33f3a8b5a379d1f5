// The fragment shader that shows a VDI from a new viewpoint. Twin of shaders/render.comp,
// line.glsl, traverse.glsl and intersect.glsl, whose comments give the reasons. A ray is straight
// in V_O's picture and crosses it column by column, or row by row. Here rays don't share work as
// the invocations of a workgroup do. Each ray finds its own tiles, the large ones first. A first
// pass finds the regions whose rays meet nothing (cull.js).

import {ON_FACE} from "./slopes.js";

/**
 * @typedef {object} Variant the constants of a shader
 * @property {boolean} compact supersegments are codes of two words, otherwise expanded to four
 *     words
 * @property {boolean} sheared Reconstruction::Sheared; needs smooth
 * @property {boolean} smooth Reconstruction::Smooth, otherwise Constant
 * @property {number} rowShift element i of an array lies at x = i mod 2^rowShift in row i >>
 *     rowShift
 * @property {number} layerShift row r lies at y = r mod 2^layerShift in layer r >> layerShift
 */

/** One more than a user sets. */
export const MOST_CLIP_PLANES = 7;

/** Regions of a picture have 2^REGION_SHIFT pixels a side. */
export const REGION_SHIFT = 4;

const COMPACT_SEGMENTS = `
#define Words uvec2

Words wordsAt(int i) { return texelFetch(segments, placeOf(i), 0).xy; }

vec2 depthsOf(Words words) { return vec2(ivec2(words.x & 0x3fffu, (words.x >> 14) & 0x3fffu)); }

float densityOf(Words words) {
  int optical = int(words.x >> 28 | (words.y >> 24) << 4);
  float depth = optical == 0 ? exp2(-20.0) : (exp2(float(optical) * (16.0 / 4095.0)) - 1.0) * (1.0 / 16.0);
  return depth / float(int((words.x >> 14) & 0x3fffu) - int(words.x & 0x3fffu));
}

vec3 colorOf(Words words) { return vec3(ivec3(words.y & 0xffu, (words.y >> 8) & 0xffu, (words.y >> 16) & 0xffu)); }
const vec3 colorUnit = vec3(1.0 / 255.0);
`;

const FULL_SEGMENTS = `
#define Words uvec4

Words wordsAt(int i) { return texelFetch(segments, placeOf(i), 0); }

vec2 depthsOf(Words words) { return uintBitsToFloat(words.xy); }

float densityOf(Words words) { return uintBitsToFloat(words.z); }

vec3 colorOf(Words words) { return vec3(ivec3(words.w & 0x7ffu, (words.w >> 11) & 0x7ffu, words.w >> 22)); }
const vec3 colorUnit = vec3(1.0 / 2040.0, 1.0 / 2040.0, 1.0 / 1020.0);
`;

/** Rays, their paths through V_O's picture, and masks of depths. */
export const RAYS = `
const float infinity = 3.0e38;
const float opaqueAcross = 1.0 - 1.0 / 512.0;

struct Ray { vec3 origin; vec3 direction; };

float depthAt(Ray ray, float t) { return ray.origin.z + t * ray.direction.z; }
float divisorOf(float depth) { return parallel ? 1.0 : depth; }

vec2 pictureAt(Ray ray, float t) {
  vec3 p = ray.origin + t * ray.direction;
  return p.xy / (pixelSize * divisorOf(p.z)) + 0.5 * vec2(lists);
}

void clip(inout vec2 stretch, float value, float slope) {
  float crossing = -value / slope;
  if (slope > 0.0) stretch.x = max(stretch.x, crossing);
  else if (slope < 0.0) stretch.y = min(stretch.y, crossing);
  else if (value < 0.0) stretch.y = stretch.x;
}

vec2 insideFrustum(Ray ray) {
  vec2 stretch = vec2(0.0, infinity);
  vec2 halfSize = 0.5 * vec2(lists) * pixelSize;
  vec2 value = halfSize * (parallel ? 1.0 : ray.origin.z);
  vec2 slope = halfSize * (parallel ? 0.0 : ray.direction.z);
  clip(stretch, value.x - ray.origin.x, slope.x - ray.direction.x);
  clip(stretch, value.x + ray.origin.x, slope.x + ray.direction.x);
  clip(stretch, value.y - ray.origin.y, slope.y - ray.direction.y);
  clip(stretch, value.y + ray.origin.y, slope.y + ray.direction.y);
  clip(stretch, ray.origin.z - nearest, ray.direction.z);
  clip(stretch, farthest - ray.origin.z, -ray.direction.z);
  return stretch;
}

// A ray's path through V_O's picture (line.glsl), from column to column. A column may be a row of
// lists.
struct Line {
  bool byColumns;
  float start;
  float columns;
  float direction;
  float row;
  float rows;
  float gain;
  float bend;
  // Depth at the start, and the change to the end, in codes. Both are negated if the ray comes nearer
  // to V_O's eye, so that depths ascend along the ray.
  vec2 depths;
  vec2 bins;
  int first;
  int last;
};

int columnCount(bool byColumns) { return byColumns ? lists.x : lists.y; }

Line lineOf(Ray ray, vec2 stretch) {
  Line line;
  vec2 start = pictureAt(ray, stretch.x);
  vec2 whole = pictureAt(ray, stretch.y) - start;
  line.byColumns = 1.001 * abs(whole.x) >= abs(whole.y);
  line.start = line.byColumns ? start.x : start.y;
  line.row = line.byColumns ? start.y : start.x;
  float along = line.byColumns ? whole.x : whole.y;
  line.columns = max(abs(along), 1e-4);
  line.direction = along < 0.0 ? -1.0 : 1.0;
  float perColumn = 1.0 / line.columns;
  line.rows = (line.byColumns ? whole.y : whole.x) * perColumn;
  vec2 depths = vec2(depthAt(ray, stretch.x), depthAt(ray, stretch.y));
  float divisors = divisorOf(depths.x) / divisorOf(depths.y);
  line.gain = divisors * perColumn;
  line.bend = (divisors - 1.0) * perColumn;
  float change = depths.y - depths.x;
  vec2 units = vec2(depths.x - code.x, change) / code.y;
  line.depths = change < 0.0 ? -units : units;
  line.bins = vec2(depths.x - nearest, change) * binScale;
  int maximum = columnCount(line.byColumns) - 1;
  line.first = clamp(int(floor(line.start)), 0, maximum);
  line.last = clamp(int(floor(line.start + line.direction * line.columns)), 0, maximum);
  return line;
}

float columnsTo(Line line, float along) { return clamp((along - line.start) * line.direction, 0.0, line.columns); }
float fractionAfter(Line line, float columns) { return columns * line.gain / (1.0 + columns * line.bend); }
float at(vec2 range, float fraction) { return range.x + fraction * range.y; }

// 2^n for n from 0 to 30. A CPU that runs WebGL can shift all lanes only by the same number.
ivec4 powersOf2(vec4 n) { return ivec4(intBitsToFloat((ivec4(n) + 127) << 23)); }

// The bits between two bins, given in any order.
uvec2 maskBetween(vec2 bins) {
  const float spare = 0.01;
  float low = floor(clamp(min(bins.x, bins.y) - spare, 0.0, 59.0));
  float high = floor(clamp(max(bins.x, bins.y) + spare, 0.0, 59.0)) + 1.0;
  ivec4 powers = powersOf2(vec4(min(vec2(low, high), 30.0), max(vec2(low, high) - 30.0, 0.0)));
  return uvec2(powers.yw - powers.xz);
}

bool sharesBit(uvec2 mask, uvec2 other) { return (mask.x & other.x | mask.y & other.y) != 0u; }
`;

const INTERSECT = `
bool ascends;    // the ray meets a list's supersegments in their order; otherwise backwards
float raySlant;  // the ray's length per change of depth; its whole length if depth hardly changes

bool changesDepth(Line line) { return line.depths.y * code.y > 0.01 * farthest; }

float shorteningAt(vec2 place) {
  if (parallel) return 1.0;
  vec2 offset = (place - 0.5 * vec2(lists)) * pixelSize;
  return inversesqrt(1.0 + dot(offset, offset));
}

struct Part {
  float low;
  float high;
  float slant;
  vec2 begin;  // places in V_O's picture, from the list's centre; for sheared pictures
  vec2 end;
};

Part partOf(Line line, vec2 fractions, float shortening) {
  Part part = Part(at(line.depths, fractions.x), at(line.depths, fractions.y), raySlant * shortening, vec2(0.0), vec2(0.0));
  if (!changesDepth(line)) {
    part.high = max(part.high, part.low + 1e-6 * farthest / code.y);
    part.slant *= (fractions.y - fractions.x) / (part.high - part.low);
  }
  return part;
}

vec2 metDepths(Words words) {
  vec2 depths = depthsOf(words);
  return ascends ? depths : -depths.yx;
}

#if SHEARED
uniform usampler2DArray slopes;
uniform float slopeUnit;    // depth per list at a slope of 1, in codes or depths
uniform vec4 boxFaces[6];   // the box is where dot(xyz, p) >= w, in V_O's view space

// Slopes of front and back, along x and y each.
vec4 slopesAt(int i) {
  int bits = int(texelFetch(slopes, placeOf(i), 0).x);
  return vec4(ivec4(bits << 24, bits << 16, bits << 8, bits) >> 24);
}

// Depths of the faces at an offset from the list's centre. A face of the box ends the ray itself.
vec2 leaningDepths(Words words, vec4 leaning, vec2 offset) {
  vec2 depths = depthsOf(words) + slopeUnit * vec2(dot(leaning.xy, offset), dot(leaning.zw, offset));
  bvec4 onFace = equal(leaning, vec4(${ON_FACE}.0));
  if (onFace.x && onFace.y) depths.x = -infinity;
  if (onFace.z && onFace.w) depths.y = infinity;
  return ascends ? depths : -depths.yx;
}

// Keeps the fractions of a part where a value that changes evenly is at least 0.
void keepWhere(vec2 value, inout vec2 fractions) {
  float crossing = value.x / (value.x - value.y);
  if (value.x < 0.0) fractions.x = value.y < 0.0 ? 2.0 : max(fractions.x, crossing);
  else if (value.y < 0.0) fractions.y = min(fractions.y, crossing);
}

// The change of depth along the part of the ray that lies within a supersegment.
float leaningLength(Words words, int i, Part part) {
  vec4 leaning = slopesAt(i);
  vec2 begin = leaningDepths(words, leaning, part.begin);
  vec2 end = leaningDepths(words, leaning, part.end);
  vec2 fractions = vec2(0.0, 1.0);
  keepWhere(vec2(part.low - begin.x, part.high - end.x), fractions);
  keepWhere(vec2(begin.y - part.low, end.y - part.high), fractions);
  return (fractions.y - fractions.x) * (part.high - part.low);
}
#endif

// The light of the part of a list that a part of the ray meets, premultiplied. The list has at
// least one supersegment. 'hint' is the place where the last intersection with a neighbouring list
// ended, counted along the ray. Each supersegment is read once.
vec4 intersectList(uvec4 head, Part part, inout int hint) {
  int last = int(head.y & 0xffffffu) - 1;
#if SHEARED
  float reach = float(head.y >> 24) * 2.0 * slopeUnit;
#else
  const float reach = 0.0;
#endif
  float low = part.low - reach;
  float high = part.high + reach;
  int step = ascends ? 1 : -1;
  int begin = int(head.x) + (ascends ? 0 : last);
  int place = min(hint, last);
  Words words = wordsAt(begin + place * step);
  vec2 depths = metDepths(words);
  while (place > 0 && depths.x > low) {
    --place;
    words = wordsAt(begin + place * step);
    depths = metDepths(words);
  }
  vec3 light = vec3(0.0);
  float transmittance = 1.0;
  for (;;) {
#if SHEARED
    float length = leaningLength(words, begin + place * step, part);
#else
    float length = min(depths.y, part.high) - max(depths.x, part.low);
#endif
    if (length > 0.0) {
      float behind = transmittance * exp2(-length * part.slant * densityOf(words));
      light += (transmittance - behind) * colorOf(words);
      transmittance = behind;
    }
    if (depths.y >= high || place >= last) break;
    ++place;
    words = wordsAt(begin + place * step);
    depths = metDepths(words);
  }
  hint = place;
  return vec4(light * colorUnit, 1.0 - transmittance);
}
`;

const TRAVERSE = `
uvec4 headAt(ivec2 list) { return texelFetch(heads, placeOf(list.y * lists.x + list.x), 0); }

float shareOfNext(float beyond) {
  const float onCentre = 1.0 / 256.0;
  return clamp((beyond - onCentre) / (1.0 - 2.0 * onCentre), 0.0, 1.0);
}

// The light on a ray that hardly moves in V_O's picture, from the four lists around its place.
vec4 alongLists(Ray ray, Line line, vec2 stretch) {
  vec2 place = 0.5 * (pictureAt(ray, stretch.x) + pictureAt(ray, stretch.y)) - 0.5;
  vec2 first = floor(place);
  vec2 share = vec2(shareOfNext(place.x - first.x), shareOfNext(place.y - first.y));
  uvec2 mask = maskBetween(vec2(line.bins.x, at(line.bins, 1.0)));
  vec4 sum = vec4(0.0);
  for (int i = 0; i < 4; ++i) {
    ivec2 side = ivec2(i & 1, i >> 1);
    float weight = (side.x == 0 ? 1.0 - share.x : share.x) * (side.y == 0 ? 1.0 - share.y : share.y);
    ivec2 pixel = clamp(ivec2(first) + side, ivec2(0), lists - 1);
    uvec4 head = headAt(pixel);
    if (!(weight > 0.0) || !sharesBit(head.zw, mask)) continue;
    int hint = 0;
    Part part = partOf(line, vec2(0.0, 1.0), shorteningAt(vec2(pixel) + 0.5));
    part.begin = pictureAt(ray, stretch.x) - 0.5 - vec2(pixel);
    part.end = pictureAt(ray, stretch.y) - 0.5 - vec2(pixel);
    sum += weight * intersectList(head, part, hint);
  }
  return sum;
}

ivec2 listOf(bool byColumns, int column, int row) { return byColumns ? ivec2(column, row) : ivec2(row, column); }

// The light of a column. 'edges' are the distances from the ray's start, in columns, at which the
// ray enters and leaves it.
vec4 intersectColumn(Line line, int column, vec2 edges, vec2 fractions, inout ivec2 hints) {
  int maxRow = columnCount(!line.byColumns) - 1;
  uvec2 mask = maskBetween(vec2(at(line.bins, fractions.x), at(line.bins, fractions.y)));
  fractions = vec2(min(fractions.x, fractions.y), max(fractions.x, fractions.y));
#if SMOOTH
  float centre = line.row + 0.5 * (edges.x + edges.y) * line.rows - 0.5;
  float below = floor(centre);
  float share = shareOfNext(centre - below);
  ivec2 rows = clamp(int(below) + ivec2(0, 1), ivec2(0), ivec2(maxRow));
#else
  vec2 inOut = vec2(min(edges.x, edges.y), max(edges.x, edges.y));
  ivec2 rows = clamp(ivec2(floor(line.row + inOut * line.rows)), ivec2(0), ivec2(maxRow));
  rows.x = clamp(rows.x, rows.y - 1, rows.y + 1);  // a diagonal through corners may touch a third row
  float share = rows.x == rows.y ? 0.0 : 0.5;
#endif
  ivec2 list = listOf(line.byColumns, column, rows.x);
  ivec2 other = listOf(line.byColumns, column, rows.y);
  uvec4 head = headAt(list);
  uvec4 otherHead = headAt(other);
  bool meets = share < 1.0 && sharesBit(head.zw, mask);
  bool meetsOther = share > 0.0 && sharesBit(otherHead.zw, mask);
  if (!meets && !meetsOther) return vec4(0.0);
  float shortening = shorteningAt(vec2(list) + 0.5);
#if SMOOTH
  Part part = partOf(line, fractions, shortening);
#if SHEARED
  vec2 inOut = vec2(min(edges.x, edges.y), max(edges.x, edges.y));
  vec2 along = line.start + line.direction * inOut - (float(column) + 0.5);
  vec2 across = line.row + line.rows * inOut - (float(rows.x) + 0.5);
  part.begin = line.byColumns ? vec2(along.x, across.x) : vec2(across.x, along.x);
  part.end = line.byColumns ? vec2(along.y, across.y) : vec2(across.y, along.y);
#endif
  vec4 light = vec4(0.0);
  if (meets) light = (1.0 - share) * intersectList(head, part, hints.x);
#if SHEARED
  vec2 step = float(rows.y - rows.x) * (line.byColumns ? vec2(0.0, 1.0) : vec2(1.0, 0.0));
  part.begin -= step;
  part.end -= step;
#endif
  if (meetsOther) light += share * intersectList(otherHead, part, hints.y);
  return light;
#else
  float split = fractions.y;
  if (rows.x != rows.y) {
    float edge = float(max(rows.x, rows.y));
    split = fractionAfter(line, clamp((edge - line.row) / line.rows, 0.0, line.columns));
    split = clamp(split, fractions.x, fractions.y);
  }
  vec4 light = vec4(0.0);
  if (meets) light = intersectList(head, partOf(line, vec2(fractions.x, split), shortening), hints.x);
  if (meetsOther) {
    light += (1.0 - light.a) * intersectList(otherHead, partOf(line, vec2(split, fractions.y), shortening), hints.y);
  }
  return light;
#endif
}

// Whether the ray may meet material in a column of tiles of 1 << shift lists. A tile's mask
// includes the lists around the tile, which allows for rounding.
bool meetsTiles(Line line, int tile, int shift) {
  vec2 edges = vec2(columnsTo(line, float(tile << shift)), columnsTo(line, float((tile + 1) << shift)));
  vec2 bins = vec2(at(line.bins, fractionAfter(line, edges.x)), at(line.bins, fractionAfter(line, edges.y)));
  vec2 rows = clamp(line.row + edges * line.rows, vec2(0.0), vec2(columnCount(!line.byColumns) - 1));
  int row = int(min(rows.x, rows.y)) >> shift;
  int lastRow = int(max(rows.x, rows.y)) >> shift;
  ivec2 small = (lists + 7) >> 3;
  int across = shift == 3 ? small.x : (lists.x + 63) >> 6;
  int base = shift == 3 ? 0 : small.x * small.y;
  uvec2 mask = uvec2(0u);
  for (; row <= lastRow; ++row) {
    ivec2 place = listOf(line.byColumns, tile, row);
    mask |= texelFetch(tiles, placeOf(base + place.y * across + place.x), 0).xy;
  }
  return sharesBit(mask, maskBetween(bins));
}

void intersectTile(Line line, int tile, inout ivec2 hints, inout vec4 light) {
  bool up = line.direction > 0.0;
  int begin = tile << 3;
  int first = up ? max(begin, line.first) : min(begin + 7, line.first);
  int last = up ? min(begin + 7, line.last) : max(begin, line.last);
  int step = up ? 1 : -1;
  float edge = columnsTo(line, float(up ? first : first + 1));
  float fraction = fractionAfter(line, edge);
  for (int column = first;; column += step) {
    float nextEdge = columnsTo(line, float(up ? column + 1 : column));
    float nextFraction = fractionAfter(line, nextEdge);
    if (nextEdge != edge) {
      vec4 behind = intersectColumn(line, column, vec2(edge, nextEdge), vec2(fraction, nextFraction), hints);
      light += (1.0 - light.a) * behind;
    }
    if (column == last || light.a >= opaqueAcross) break;
    edge = nextEdge;
    fraction = nextFraction;
  }
}

vec4 traverse(Line line) {
  vec4 light = vec4(0.0);
  ivec2 hints = ivec2(0);
  int step = line.direction > 0.0 ? 1 : -1;
  int lastTile = line.last >> 3;
  int large = -1;
  bool meetsLarge = false;
  for (int tile = line.first >> 3;;) {
    if (tile >> 3 != large) {
      large = tile >> 3;
      meetsLarge = meetsTiles(line, large, 6);
    }
    if (!meetsLarge) {
      tile = step > 0 ? (large + 1) << 3 : (large << 3) - 1;
    } else {
      if (meetsTiles(line, tile, 3)) intersectTile(line, tile, hints, light);
      if (light.a >= opaqueAcross) break;
      tile += step;
    }
    if ((lastTile - tile) * step < 0) break;
  }
  return light;
}
`;

const MAIN = `
out vec4 picture;  // premultiplied

void main() {
  picture = vec4(0.0);
  if (texelFetch(regions, ivec2(gl_FragCoord.xy) >> ${REGION_SHIFT}, 0).r == 0.0) return;
  vec2 uv = gl_FragCoord.xy * pixelScale - 0.5 * pictureSize;
  Ray ray = Ray(rayOrigin[0] + uv.x * rayOrigin[1] + uv.y * rayOrigin[2],
                rayDirection[0] + uv.x * rayDirection[1] + uv.y * rayDirection[2]);
  vec2 stretch = insideFrustum(ray);
#if SHEARED
  for (int i = 0; i < 6; ++i) {
    clip(stretch, dot(boxFaces[i].xyz, ray.origin) - boxFaces[i].w, dot(boxFaces[i].xyz, ray.direction));
  }
#endif
  for (int i = 0; i < clipPlaneCount; ++i) {
    clip(stretch, dot(clipPlanes[i].xyz, ray.origin) - clipPlanes[i].w, dot(clipPlanes[i].xyz, ray.direction));
  }
  if (!(stretch.x < stretch.y)) return;
  Line line = lineOf(ray, stretch);
  ascends = line.bins.y >= 0.0;
  raySlant = (stretch.y - stretch.x) * length(ray.direction) / (code.y * (changesDepth(line) ? line.depths.y : 1.0));
#if SMOOTH
  if (line.columns < 1.0) {
    picture = alongLists(ray, line, stretch);
    return;
  }
#endif
  picture = traverse(line);
}
`;

/**
 * The beginning of each shader that reads a VDI.
 * @param {{rowShift: number, layerShift: number}} tiling
 */
export function uniformsOf(tiling) {
  return `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2DArray;
uniform usampler2DArray heads;
uniform usampler2DArray segments;
uniform usampler2DArray tiles;
uniform ivec2 lists;
uniform bool parallel;
uniform float pixelSize;
uniform float nearest;
uniform float farthest;
uniform float binScale;
uniform vec2 code;             // depth of code c: code.x + c * code.y; (0, 1) if supersegments have depths
uniform vec3 rayOrigin[3];     // at the picture's middle, and its change per pixel to the right and up
uniform vec3 rayDirection[3];
uniform vec2 pictureSize;      // in pixels of the canvas
uniform float pixelScale;      // pixels of the canvas per fragment

ivec3 placeOf(int i) {
  int row = i >> ${tiling.rowShift};
  return ivec3(i & ${(1 << tiling.rowShift) - 1}, row & ${(1 << tiling.layerShift) - 1}, row >> ${tiling.layerShift});
}
`;
}

/** @param {Variant} variant */
export function traverseShader(variant) {
  return `${uniformsOf(variant)}#define SMOOTH ${variant.smooth ? 1 : 0}
#define SHEARED ${variant.sheared ? 1 : 0}
uniform int clipPlaneCount;
uniform vec4 clipPlanes[${MOST_CLIP_PLANES}];  // in V_O's view space; the visible side has dot(xyz, position) >= w
uniform sampler2D regions;     // regions of the picture that may show material (cull.js)
${variant.compact ? COMPACT_SEGMENTS : FULL_SEGMENTS}${RAYS}${INTERSECT}${TRAVERSE}${MAIN}`;
}

/** One triangle that covers the picture. */
export const WHOLE_PICTURE = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(4.0 * corner - 1.0, 0.0, 1.0);
}
`;
