// Expands LZ4 blocks, as LZ4's "Block Format Description" defines them. It trusts no length in a
// block.

const MORE = 15;  // in a length's four bits: the length continues in bytes, until one isn't 255
const SHORTEST_MATCH = 4;

/**
 * The number of bytes to which a block claims to expand, found without expanding it.
 * @param {Uint8Array} packed
 * @returns {number} -1 if the block is truncated
 */
export function lz4AnnouncedBytes(packed) {
  const end = packed.length;
  let total = 0;
  let at = 0;
  while (at < end) {
    const token = packed[at++];
    let literals = token >> 4;
    if (literals === MORE) {
      for (let byte = 255; byte === 255; literals += byte) {
        if (at >= end) return -1;
        byte = packed[at++];
      }
    }
    if (literals > end - at) return -1;
    at += literals;
    total += literals;
    if (at === end) return total;
    at += 2;
    let match = token & MORE;
    if (match === MORE) {
      for (let byte = 255; byte === 255; match += byte) {
        if (at >= end) return -1;
        byte = packed[at++];
      }
    }
    total += match + SHORTEST_MATCH;
  }
  return -1;
}

/**
 * Expands a block into `plain`.
 * @param {Uint8Array} packed
 * @param {Uint8Array} plain
 * @returns {boolean} whether the block is sound and fills `plain` exactly; otherwise the content of
 *     `plain` is undefined
 */
export function lz4Expand(packed, plain) {
  const end = packed.length;
  const room = plain.length;
  let at = 0;
  let to = 0;
  while (at < end) {
    const token = packed[at++];
    let literals = token >> 4;
    if (literals === MORE) {
      for (let byte = 255; byte === 255; literals += byte) {
        if (at >= end) return false;
        byte = packed[at++];
      }
    }
    if (literals > end - at || literals > room - to) return false;
    if (literals > 32) {
      plain.set(packed.subarray(at, at + literals), to);
      at += literals;
      to += literals;
    } else {
      for (let i = 0; i < literals; ++i) plain[to++] = packed[at++];
    }
    if (at === end) return to === room;
    if (end - at < 2) return false;
    const distance = packed[at] | (packed[at + 1] << 8);
    at += 2;
    if (distance === 0 || distance > to) return false;
    let match = token & MORE;
    if (match === MORE) {
      for (let byte = 255; byte === 255; match += byte) {
        if (at >= end) return false;
        byte = packed[at++];
      }
    }
    match += SHORTEST_MATCH;
    if (match > room - to) return false;
    if (distance === 1) {
      plain.fill(plain[to - 1], to, to + match);
    } else if (distance >= match && match > 32) {
      plain.copyWithin(to, to - distance, to - distance + match);
    } else {
      for (let i = 0; i < match; ++i) plain[to + i] = plain[to + i - distance];
    }
    to += match;
  }
  return false;
}
