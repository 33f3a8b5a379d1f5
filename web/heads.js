// A list's head tells a ray where the list's supersegments are, and which of 60 parts of the VDI's
// depth range they occupy. Tiles of 8 x 8 and of 64 x 64 lists have such masks, too. Twin of
// shaders/expand.comp, whose masks have 64 parts. Here a mask is two words of 30 bits.

/** @typedef {import("./format.js").Vdi} Vdi */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */

export const TILE = 8;
export const LARGE_TILE = 64;
export const BINS = 60;
const WORD_BINS = 30;  // bins in a word of a mask; shaders get their bits without shifts

/**
 * @typedef {object} Heads
 * @property {Uint32Array} heads four words per list: first supersegment, count, mask's low and high
 *     half
 * @property {Uint32Array} tiles two words per tile: all small tiles, then all large ones
 * @property {number} nearest least depth of all supersegments
 * @property {number} farthest greatest depth
 * @property {number} binScale bins per unit of depth
 */

/**
 * The depths at which supersegments begin and end, by index.
 * @param {Vdi} vdi
 */
function depthsOf(vdi) {
  const {words, code} = vdi;
  if (vdi.compact) {
    return {
      front: (/** @type {number} */ i) => code.first + (words[2 * i] & 0x3fff) * code.step,
      back: (/** @type {number} */ i) => code.first + ((words[2 * i] >>> 14) & 0x3fff) * code.step,
    };
  }
  const floats = new Float32Array(words.buffer, words.byteOffset, words.length);
  return {
    front: (/** @type {number} */ i) => floats[6 * i],
    back: (/** @type {number} */ i) => floats[6 * i + 1],
  };
}

/** @param {number} bits @returns {number} a word of a mask with that many low bits set, at most all */
function lowBits(bits) {
  return (1 << Math.min(Math.max(bits, 0), WORD_BINS)) - 1;
}

/**
 * Masks of tiles. They include the lists around a tile, with which smooth reconstruction blends.
 * @param {Uint32Array} heads
 * @param {number} width
 * @param {number} height
 */
function tileMasks(heads, width, height) {
  const across = Math.ceil(width / TILE), up = Math.ceil(height / TILE);
  const largeAcross = Math.ceil(width / LARGE_TILE), largeUp = Math.ceil(height / LARGE_TILE);
  const tiles = new Uint32Array(2 * (across * up + largeAcross * largeUp));
  for (let ty = 0; ty < up; ++ty) {
    for (let tx = 0; tx < across; ++tx) {
      let low = 0, high = 0;
      const endY = Math.min((ty + 1) * TILE + 1, height), endX = Math.min((tx + 1) * TILE + 1, width);
      for (let y = Math.max(ty * TILE - 1, 0); y < endY; ++y) {
        for (let x = Math.max(tx * TILE - 1, 0); x < endX; ++x) {
          const at = 4 * (y * width + x);
          low |= heads[at + 2];
          high |= heads[at + 3];
        }
      }
      const small = 2 * (ty * across + tx);
      tiles[small] = low;
      tiles[small + 1] = high;
      const ratio = LARGE_TILE / TILE;
      const large = 2 * (across * up + Math.floor(ty / ratio) * largeAcross + Math.floor(tx / ratio));
      tiles[large] |= low;
      tiles[large + 1] |= high;
    }
  }
  return tiles;
}

/**
 * The least and the greatest depth of a leaning supersegment anywhere in its list's pixel.
 * @typedef {object} Ends
 * @property {number} front
 * @property {number} back
 * @property {number} reach their distance from the supersegment's own depths, in slopes
 */

const REACH_UNIT = 2;         // slopes
export const COUNT_BITS = 24;  // of a head's second word, which has the reach above them

/**
 * Puts a supersegment's bins into a list's mask, which is two words of `heads`.
 * @param {Uint32Array} heads
 * @param {number} list
 * @param {number} from first bin
 * @param {number} to bin after the last
 */
function mark(heads, list, from, to) {
  heads[4 * list + 2] |= lowBits(to) & ~lowBits(from);
  heads[4 * list + 3] |= lowBits(to - WORD_BINS) & ~lowBits(from - WORD_BINS);
}

/**
 * The bins of depths.
 * @param {number} nearest
 * @param {number} farthest
 * @param {number} binScale
 */
function binning(nearest, farthest, binScale) {
  return (/** @type {number} */ depth) =>
    Math.min(Math.floor((Math.min(Math.max(depth, nearest), farthest) - nearest) * binScale), BINS - 1);
}

/** @param {Vdi} vdi @returns {Heads} */
export function headsOf(vdi) {
  const {width, height, offsets} = vdi;
  const {front, back} = depthsOf(vdi);
  const lists = width * height;
  let nearest = Infinity, farthest = 0;
  for (let i = 0; i < lists; ++i) {  // a list is in order of depth, so its two ends suffice
    if (offsets[i] === offsets[i + 1]) continue;
    nearest = Math.min(nearest, front(offsets[i]));
    farthest = Math.max(farthest, back(offsets[i + 1] - 1));
  }
  // In perspective the frusta of V_O's pixels meet at its eye, where depths mean nothing.
  if (!vdi.camera.parallel) nearest = Math.max(nearest, farthest * 1e-6);
  const binScale = farthest > nearest ? BINS / (farthest - nearest) : 0;
  const binOf = binning(nearest, farthest, binScale);
  const heads = new Uint32Array(4 * lists);
  for (let i = 0; i < lists; ++i) {
    for (let s = offsets[i]; s < offsets[i + 1]; ++s) mark(heads, i, binOf(front(s)), binOf(back(s)) + 1);
    heads[4 * i] = offsets[i];
    heads[4 * i + 1] = offsets[i + 1] - offsets[i];
  }
  return {heads, tiles: tileMasks(heads, width, height), nearest, farthest, binScale};
}

/**
 * The heads and tiles of a VDI whose supersegments lean.
 * @param {PreparedVdi} vdi
 * @param {(segment: number, list: number) => Ends} endsOf
 */
export function leaningHeads(vdi, endsOf) {
  const binOf = binning(vdi.nearest, vdi.farthest, vdi.binScale);
  const heads = new Uint32Array(vdi.heads.length);
  for (let i = 0; i < heads.length / 4; ++i) {
    const first = vdi.heads[4 * i], count = vdi.heads[4 * i + 1];
    let most = 0;
    for (let s = first; s < first + count; ++s) {
      const {front, back, reach} = endsOf(s, i);
      most = Math.max(most, reach);
      mark(heads, i, binOf(front), binOf(back) + 1);
    }
    heads[4 * i] = first;
    heads[4 * i + 1] = count + Math.ceil(most / REACH_UNIT) * 2 ** COUNT_BITS;
  }
  return {heads, tiles: tileMasks(heads, vdi.width, vdi.height)};
}

const MAX_OPTICAL_DEPTH = 65504;  // maxExtinction of vdi/core/TransferFunction.h

/**
 * Depths and optical depth of all supersegments in the shader's form.
 * @param {PreparedVdi} vdi
 */
export function supersegmentsOf(vdi) {
  const {segments, code} = vdi;
  const count = segments.length / (vdi.compact ? 2 : 4);
  const [fronts, backs, depths] = [new Float32Array(count), new Float32Array(count), new Float32Array(count)];
  const floats = new Float32Array(segments.buffer, segments.byteOffset, segments.length);
  const ofCode = Float32Array.from({length: 4096}, (_, i) => i === 0 ? 2 ** -20 : (2 ** (i * 16 / 4095) - 1) / 16);
  for (let i = 0; i < count; ++i) {
    if (vdi.compact) {
      const [first, second] = [segments[2 * i], segments[2 * i + 1]];
      fronts[i] = code.first + (first & 0x3fff) * code.step;
      backs[i] = code.first + ((first >>> 14) & 0x3fff) * code.step;
      depths[i] = ofCode[(first >>> 28) | ((second >>> 24) << 4)];
    } else {
      fronts[i] = floats[4 * i];
      backs[i] = floats[4 * i + 1];
      depths[i] = floats[4 * i + 2] * (backs[i] - fronts[i]);
    }
  }
  return {fronts, backs, depths};
}

/**
 * Full supersegments in the shader's form, four words each: front, back, optical depth per unit of
 * depth, and the straight colour in 11, 11 and 10 bits (shaders/render_segment.glsl).
 * @param {Vdi} vdi
 * @returns {Uint32Array}
 */
export function expandedSegments(vdi) {
  const count = vdi.words.length / 6;
  const from = new Float32Array(vdi.words.buffer, vdi.words.byteOffset, vdi.words.length);
  const words = new Uint32Array(4 * count);
  const floats = new Float32Array(words.buffer);
  const bits = (/** @type {number} */ value, /** @type {number} */ most) =>
    Math.round(Math.min(Math.max(value, 0), 1) * most);
  for (let i = 0; i < count; ++i) {
    const at = 6 * i;
    const opacity = from[at + 5];
    const opticalDepth = Math.min(-Math.log1p(-opacity) / Math.LN2, MAX_OPTICAL_DEPTH);
    floats[4 * i] = from[at];
    floats[4 * i + 1] = from[at + 1];
    floats[4 * i + 2] = opticalDepth / (from[at + 1] - from[at]);
    words[4 * i + 3] = bits(from[at + 2] / opacity, 2040) | (bits(from[at + 3] / opacity, 2040) << 11) |
                       (bits(from[at + 4] / opacity, 1020) << 22);
  }
  return words;
}
