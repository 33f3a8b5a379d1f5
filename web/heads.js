// A list's head tells a ray where the list's supersegments are, and which of 60 parts of the VDI's
// depth range they occupy. Tiles of 8 x 8 and of 64 x 64 lists have such masks, too. Twin of
// shaders/expand.comp.

/** @typedef {import("./format.js").Vdi} Vdi */

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
 * Masks of tiles. They include the lists around a tile, because smooth reconstruction blends with
 * these.
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
  // In perspective the frusta of V_O's pixels meet in its eye, where depths say nothing.
  if (!vdi.camera.parallel) nearest = Math.max(nearest, farthest * 1e-6);
  const binScale = farthest > nearest ? BINS / (farthest - nearest) : 0;
  const binOf = (/** @type {number} */ depth) =>
    Math.min(Math.max(Math.floor((depth - nearest) * binScale), 0), BINS - 1);
  const heads = new Uint32Array(4 * lists);
  for (let i = 0; i < lists; ++i) {
    let low = 0, high = 0;
    for (let s = offsets[i]; s < offsets[i + 1]; ++s) {
      const from = binOf(front(s)), to = binOf(back(s)) + 1;
      low |= lowBits(to) & ~lowBits(from);
      high |= lowBits(to - WORD_BINS) & ~lowBits(from - WORD_BINS);
    }
    heads[4 * i] = offsets[i];
    heads[4 * i + 1] = offsets[i + 1] - offsets[i];
    heads[4 * i + 2] = low;
    heads[4 * i + 3] = high;
  }
  return {heads, tiles: tileMasks(heads, width, height), nearest, farthest, binScale};
}

const MAX_OPTICAL_DEPTH = 65504;  // maxExtinction of vdi/core/TransferFunction.h

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
