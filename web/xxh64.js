// XXH64 with seed 0, the checksum of .vdi files (docs/format.md). It computes with pairs of 32-bit
// halves, because BigInt takes ten times as long.

// The primes, as high and low halves.
const P1H = 0x9e3779b1, P1L = 0x85ebca87;
const P2H = 0xc2b2ae3d, P2L = 0x27d4eb4f;
const P3H = 0x165667b1, P3L = 0x9e3779f9;
const P4H = 0x85ebca77, P4L = 0xc2b2ae63;
const P5H = 0x27d4eb2f, P5L = 0x165667c5;

/** High half of the last result; functions return the low half. */
let high = 0;

/**
 * The high 32 bits of a product of two unsigned 32-bit numbers.
 * @param {number} a
 * @param {number} b
 */
function multiplyHigh(a, b) {
  const a0 = a & 0xffff, a1 = a >>> 16, b0 = b & 0xffff, b1 = b >>> 16;
  const middle = a1 * b0 + ((a0 * b0) >>> 16);
  const rest = a0 * b1 + (middle & 0xffff);
  return (a1 * b1 + (middle >>> 16) + (rest >>> 16)) | 0;
}

/** @param {number} ah @param {number} al @param {number} bh @param {number} bl */
function multiply(ah, al, bh, bl) {
  high = (multiplyHigh(al, bl) + Math.imul(ah, bl) + Math.imul(al, bh)) | 0;
  return Math.imul(al, bl);
}

/** @param {number} ah @param {number} al @param {number} bh @param {number} bl */
function add(ah, al, bh, bl) {
  const low = (al + bl) | 0;
  high = (ah + bh + (low >>> 0 < al >>> 0 ? 1 : 0)) | 0;
  return low;
}

/**
 * Rotates left by `bits` in 1 … 63, other than 32.
 * @param {number} ah
 * @param {number} al
 * @param {number} bits
 */
function rotate(ah, al, bits) {
  if (bits > 32) {
    const swapped = ah;
    ah = al;
    al = swapped;
    bits -= 32;
  }
  high = (ah << bits) | (al >>> (32 - bits));
  return (al << bits) | (ah >>> (32 - bits));
}

/**
 * One step of an accumulator.
 * @param {number} ah
 * @param {number} al
 * @param {number} inH
 * @param {number} inL
 */
function round(ah, al, inH, inL) {
  let low = multiply(inH, inL, P2H, P2L);
  low = add(ah, al, high, low);
  low = rotate(high, low, 31);
  return multiply(high, low, P1H, P1L);
}

/**
 * The hash of the whole stripes of 32 bytes, in `high` and the returned low half.
 * @param {DataView} view
 */
function ofStripes(view) {
  // Accumulators begin with P1 + P2, P2, 0 and -P1.
  let l1 = add(P1H, P1L, P2H, P2L), h1 = high;
  let h2 = P2H | 0, l2 = P2L | 0, h3 = 0, l3 = 0;
  let l4 = -P1L | 0, h4 = ~P1H | 0;
  for (let at = 0; at + 32 <= view.byteLength; at += 32) {
    l1 = round(h1, l1, view.getInt32(at + 4, true), view.getInt32(at, true));
    h1 = high;
    l2 = round(h2, l2, view.getInt32(at + 12, true), view.getInt32(at + 8, true));
    h2 = high;
    l3 = round(h3, l3, view.getInt32(at + 20, true), view.getInt32(at + 16, true));
    h3 = high;
    l4 = round(h4, l4, view.getInt32(at + 28, true), view.getInt32(at + 24, true));
    h4 = high;
  }
  let l = rotate(h1, l1, 1);
  let h = high;
  for (const [ah, al, bits] of [[h2, l2, 7], [h3, l3, 12], [h4, l4, 18]]) {
    const turned = rotate(ah, al, bits);
    l = add(h, l, high, turned);
    h = high;
  }
  for (const [ah, al] of [[h1, l1], [h2, l2], [h3, l3], [h4, l4]]) {
    const mixed = round(0, 0, ah, al);
    l = multiply(h ^ high, l ^ mixed, P1H, P1L);
    l = add(high, l, P4H, P4L);
    h = high;
  }
  return l;
}

/**
 * Mixes the hash's bits, into `high` and the returned low half.
 * @param {number} h
 * @param {number} l
 */
function avalanche(h, l) {
  l ^= (h >>> 1);  // h ^= h >> 33
  l = multiply(h, l, P2H, P2L);
  h = high;
  const shifted = (l >>> 29) | (h << 3);  // h ^= h >> 29
  l = multiply(h ^ (h >>> 29), l ^ shifted, P3H, P3L);
  return l ^ high;  // h ^= h >> 32
}

/** @param {Uint8Array} bytes @returns {{high: number, low: number}} unsigned halves */
export function xxh64(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const length = bytes.length;
  let l = length >= 32 ? ofStripes(view) : P5L | 0;
  let h = length >= 32 ? high : P5H | 0;
  l = add(h, l, 0, length);
  h = high;
  let at = length - length % 32;
  for (; at + 8 <= length; at += 8) {
    const mixed = round(0, 0, view.getInt32(at + 4, true), view.getInt32(at, true));
    l = rotate(h ^ high, l ^ mixed, 27);
    l = multiply(high, l, P1H, P1L);
    l = add(high, l, P4H, P4L);
    h = high;
  }
  if (at + 4 <= length) {
    const mixed = multiply(0, view.getInt32(at, true), P1H, P1L);
    l = rotate(h ^ high, l ^ mixed, 23);
    l = multiply(high, l, P2H, P2L);
    l = add(high, l, P3H, P3L);
    h = high;
    at += 4;
  }
  for (; at < length; ++at) {
    const mixed = multiply(0, bytes[at], P5H, P5L);
    l = rotate(h ^ high, l ^ mixed, 11);
    l = multiply(high, l, P1H, P1L);
    h = high;
  }
  l = avalanche(h, l);
  return {high: high >>> 0, low: l >>> 0};
}
