// Decodes .vdi files (docs/format.md). A file may be damaged or hostile. The decoder checks every
// number before it uses it, and allocates only the memory that the file's bytes justify. Twin of
// VdiLayout.cpp, VdiDecoder.cpp, ListCodec.cpp and Metadata.cpp in vdi/io.

import {lz4AnnouncedBytes, lz4Expand} from "./lz4.js";
import {xxh64} from "./xxh64.js";

/** Reports a file that breaks the format. The message is one line for the user. */
export class FormatError extends Error {}

/** @typedef {[number, number, number]} Vec3 */

/**
 * The parameters of vtkCamera that shape a picture.
 * @typedef {object} Camera
 * @property {Vec3} position world
 * @property {Vec3} focalPoint world
 * @property {Vec3} viewUp
 * @property {number} viewAngle vertical, degrees
 * @property {boolean} parallel
 * @property {number} parallelScale half the height of the viewport, world units
 */

/**
 * A VDI without its lists.
 * @typedef {object} Header
 * @property {number} version
 * @property {boolean} compact supersegments are codes (encoding 1) rather than floats (encoding 0)
 * @property {number} width lists per row, including the margin
 * @property {number} height rows; row 0 is at the bottom
 * @property {[number, number]} margin lists beyond each side of the picture that the camera frames
 * @property {number} budget maximum number of supersegments in a list
 * @property {number} listsPerChunk
 * @property {number} chunkCount
 * @property {number} supersegmentCount
 * @property {number} dataBytes
 * @property {number} timeStep
 * @property {number} time of the simulation
 * @property {[Vec3, Vec3]} bounds of the scene: low and high corner in world space; low exceeds
 *     high if the scene is empty
 * @property {Camera} camera V_O
 * @property {Coloring} [coloring] meaning of the colours; absent in files of versions 1 and 2
 */

/**
 * The meaning of a VDI's colours: the fields of the metadata (docs/format.md).
 * @typedef {object} Coloring
 * @property {{name: string, association: string, components: number, component: number}} array
 * @property {[number, number]} [range] of the values shown
 * @property {{colors: number[][], opacities: number[][], unitDistance: number}} transferFunction
 */

/**
 * A decoded VDI. List i holds the supersegments offsets[i] … offsets[i + 1] - 1, front to back. A
 * compact supersegment has the two words of vdi/core/Supersegment.h. A full one has six words: the
 * bit patterns of the floats front, back, red, green, blue (premultiplied) and opacity.
 * @typedef {object} Lists
 * @property {Uint32Array} offsets width * height + 1
 * @property {Uint32Array} words
 * @property {{first: number, step: number}} code code c means depth first + c * step; compact
 *     only
 */
/** @typedef {Header & Lists} Vdi */

export const HEADER_BYTES = 240;
const ENTRY_BYTES = 16;
const MAX_SIDE = 32768;
const MAX_CODE = 16383;
const METADATA_VERSION = 3;
const METADATA_HEADER_BYTES = 16;
const MAX_METADATA_BYTES = 1 << 20;

/** @param {string} what @param {unknown} [cause] @returns {never} */
function fail(what, cause) {
  throw new FormatError(`invalid .vdi file: ${what}`, {cause});
}

/** @param {DataView} view @param {number} at */
function bigCount(view, at) {
  return view.getUint32(at, true) + view.getUint32(at + 4, true) * 0x100000000;
}

/** @param {Uint8Array} bytes @param {DataView} view @param {number} at where their checksum lies */
function checksumHolds(bytes, view, at) {
  const sum = xxh64(bytes);
  return sum.low === view.getUint32(at, true) && sum.high === view.getUint32(at + 4, true);
}

/** @param {DataView} view @param {number} at @returns {Vec3} */
function vectorAt(view, at) {
  return [view.getFloat64(at, true), view.getFloat64(at + 8, true), view.getFloat64(at + 16, true)];
}

/**
 * Throws FormatError unless a picture can have this camera.
 * @param {Camera} camera
 */
function requireCamera(camera) {
  const numbers = [...camera.position, ...camera.focalPoint, ...camera.viewUp];
  if (!numbers.every(Number.isFinite)) fail("its camera isn't finite");
  const distance = Math.hypot(...camera.position.map((p, i) => p - camera.focalPoint[i]));
  if (!(distance > 0 && Number.isFinite(distance))) fail("its camera's position equals its focal point");
  const good = camera.parallel ? camera.parallelScale > 0 && Number.isFinite(camera.parallelScale)
                               : camera.viewAngle > 0 && camera.viewAngle < 180;
  if (!good) fail("its camera has no extent");
}

/**
 * Throws FormatError if the fields contradict each other or the file's size.
 * @param {Header} header
 * @param {number} fileBytes
 */
function requireSizes(header, fileBytes) {
  const {width, height, margin, listsPerChunk} = header;
  const goodSide = (/** @type {number} */ side) => side >= 1 && side <= MAX_SIDE;
  if (!goodSide(width) || !goodSide(height) || listsPerChunk === 0)
    fail(`it has ${width} x ${height} lists in chunks of ${listsPerChunk}`);
  if (2 * margin[0] >= width || 2 * margin[1] >= height) fail("its margin leaves no picture");
  if (header.budget < 1) fail("its lists can't hold any supersegments");
  const chunks = Math.ceil(width * height / listsPerChunk);
  if (chunks !== header.chunkCount) fail(`it has ${header.chunkCount} chunks instead of ${chunks}`);
  const before = HEADER_BYTES + chunks * ENTRY_BYTES;
  const rest = fileBytes - before - header.dataBytes;
  const hasMetadata = header.version === METADATA_VERSION;
  if (rest < 0 || (!hasMetadata && rest !== 0))
    fail(`it has ${fileBytes} bytes instead of ${before + header.dataBytes}`);
  if (hasMetadata && (rest < METADATA_HEADER_BYTES || rest > METADATA_HEADER_BYTES + MAX_METADATA_BYTES))
    fail(`the ${rest} bytes after its chunks can't be metadata`);
}

/**
 * Tells whether these are the nodes of a function: rows of a position and of `length - 1` shares, in
 * ascending order.
 * @param {unknown} rows @param {number} length
 */
function areNodes(rows, length) {
  const isShare = (/** @type {number} */ value) => value >= 0 && value <= 1;
  return Array.isArray(rows) && rows.length > 0 && rows.every((row, i) =>
    Array.isArray(row) && row.length === length && row.every(Number.isFinite) && row.slice(1).every(isShare) &&
    (i === 0 || rows[i - 1][0] <= row[0]));
}

/**
 * @param {any} json the parsed metadata
 * @returns {Coloring}
 */
function coloringOf(json) {
  const array = json?.array, map = json?.transferFunction, range = json?.range;
  const whole = (/** @type {unknown} */ value, /** @type {number} */ least) => Number.isInteger(value) && Number(value) >= least;
  if (typeof array?.name !== "string" || !["points", "cells"].includes(array.association) || !whole(array.components, 1) ||
      !whole(array.component, -2) || array.component >= array.components || (array.component === -2 && array.components !== 2))
    fail("its metadata don't describe the array");
  if (range !== undefined && !(Array.isArray(range) && range.length === 2 && range.every(Number.isFinite)))
    fail("the range in its metadata isn't two numbers");
  if (range !== undefined && range[0] > range[1]) fail("the range in its metadata doesn't ascend");
  if (!areNodes(map?.colors, 4) || !areNodes(map?.opacities, 2) || !(map.unitDistance > 0 && map.unitDistance < Infinity))
    fail("its metadata don't describe the transfer function");
  return {array, range, transferFunction: map};
}

/**
 * Decodes the metadata, which follow the chunks.
 * @param {Uint8Array} bytes @param {DataView} view @param {number} at
 */
function decodeMetadata(bytes, view, at) {
  const text = bytes.subarray(at + METADATA_HEADER_BYTES);
  if (String.fromCharCode(...bytes.subarray(at, at + 4)) !== "JSON") fail("its metadata aren't JSON");
  if (view.getUint32(at + 4, true) !== text.length) fail("its metadata have the wrong length");
  if (!checksumHolds(text, view, at + 8)) fail("the metadata's checksum is wrong");
  let json;
  try {
    json = JSON.parse(new TextDecoder("utf-8", {fatal: true}).decode(text));
  } catch (cause) {
    fail("its metadata aren't JSON", cause);
  }
  return coloringOf(json);
}

/**
 * Reads the header without the metadata. It checks version and encoding before the checksum, so that
 * the message for a file of a later version names the version.
 * @param {Uint8Array} bytes at least the file's first HEADER_BYTES, if it has them
 * @param {number} fileBytes
 * @returns {Header}
 */
export function startOf(bytes, fileBytes) {
  if (bytes.length < HEADER_BYTES) fail(`${fileBytes} bytes are too few for a header`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const word = (/** @type {number} */ at) => view.getUint32(at, true);
  if (String.fromCharCode(...bytes.subarray(0, 8)) !== "VDI-FILE") fail("it doesn't start with VDI-FILE");
  const version = word(8);
  if (version < 1 || version > METADATA_VERSION)
    fail(`it has version ${version}, but this page reads versions 1 to ${METADATA_VERSION}`);
  if (word(12) !== HEADER_BYTES) fail(`its header has ${word(12)} bytes`);
  if (!checksumHolds(bytes.subarray(0, 232), view, 232)) fail("the header's checksum is wrong");
  const encoding = word(16);
  if (encoding > 1) fail(`its supersegments have encoding ${encoding}, but this page reads encodings 0 and 1`);
  /** @type {[number, number]} */
  const margin = [view.getUint16(44, true), view.getUint16(46, true)];
  const flags = word(20);
  if ((flags & ~1) !== 0 || (version === 1 && (margin[0] !== 0 || margin[1] !== 0)))
    fail("it uses flags that this page doesn't know");
  /** @type {Header} */
  const header = {
    version, margin,
    compact: encoding === 1,
    width: word(24),
    height: word(28),
    budget: word(32),
    listsPerChunk: word(36),
    chunkCount: word(40),
    supersegmentCount: bigCount(view, 48),
    dataBytes: bigCount(view, 56),
    timeStep: bigCount(view, 64),
    time: view.getFloat64(72, true),
    bounds: [vectorAt(view, 88), vectorAt(view, 112)],
    camera: {
      position: vectorAt(view, 136),
      focalPoint: vectorAt(view, 160),
      viewUp: vectorAt(view, 184),
      viewAngle: view.getFloat64(208, true),
      parallelScale: view.getFloat64(216, true),
      parallel: (flags & 1) !== 0,
    },
  };
  requireSizes(header, fileBytes);
  if (!Number.isFinite(header.time) || header.bounds.flat().some(Number.isNaN)) fail("its time or bounds aren't numbers");
  requireCamera(header.camera);
  return header;
}

/**
 * Reads the header and the metadata.
 * @param {Uint8Array} bytes the whole file
 * @returns {Header}
 */
export function decodeHeader(bytes) {
  const header = startOf(bytes, bytes.length);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (!checksumHolds(bytes.subarray(HEADER_BYTES, HEADER_BYTES + header.chunkCount * ENTRY_BYTES), view, 224))
    fail("the chunk table's checksum is wrong");
  if (header.version === METADATA_VERSION) {
    const behind = HEADER_BYTES + header.chunkCount * ENTRY_BYTES + header.dataBytes;
    header.coloring = decodeMetadata(bytes, view, behind);
  }
  return header;
}

/**
 * @typedef {object} Chunk
 * @property {Uint8Array} packed
 * @property {number} firstList
 * @property {number} listCount
 * @property {number} first index of its first supersegment
 * @property {number} count number of supersegments
 * @property {number} plainBytes
 */

/**
 * The table's chunks. Throws FormatError unless the file can hold what they claim.
 * @param {Uint8Array} bytes
 * @param {Header} header
 */
function chunksOf(bytes, header) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const lists = header.width * header.height;
  let at = HEADER_BYTES + header.chunkCount * ENTRY_BYTES;
  let first = 0;
  /** @type {Chunk[]} */
  const chunks = [];
  for (let c = 0; c < header.chunkCount; ++c) {
    const entry = HEADER_BYTES + c * ENTRY_BYTES;
    const count = view.getUint32(entry, true);
    const packedBytes = view.getUint32(entry + 4, true);
    const firstList = c * header.listsPerChunk;
    const listCount = Math.min(header.listsPerChunk, lists - firstList);
    const plainBytes = header.compact ? 8 + 4 * listCount + 9 * count : 4 * listCount + 24 * count;
    const packed = bytes.subarray(at, at + packedBytes);
    if (packed.length !== packedBytes) fail("its chunks' sizes don't add up to the header's size of the data");
    if (count > listCount * header.budget || plainBytes > 0x7e000000 || lz4AnnouncedBytes(packed) !== plainBytes)
      fail(`the chunk from list ${firstList} on doesn't hold ${count} supersegments`);
    chunks.push({packed, firstList, listCount, first, count, plainBytes});
    at += packedBytes;
    first += count;
  }
  if (at !== HEADER_BYTES + header.chunkCount * ENTRY_BYTES + header.dataBytes)
    fail("its chunks' sizes don't add up to the header's size of the data");
  if (first !== header.supersegmentCount || first >= 0x100000000)
    fail("its chunks' supersegments don't add up to the header's number");
  return chunks;
}

/** @param {number} folded */
function unfold(folded) {
  return (folded >>> 1) ^ -(folded & 1);
}

/**
 * Walks the lists of a chunk and calls `restore(index, reference, previous)` for each supersegment.
 * `reference` is the supersegment that predicts it, `previous` the preceding one in its list; -1
 * means none.
 * @param {Chunk} chunk
 * @param {Uint8Array} plain
 * @param {number} lengthsAt place of the lists' lengths in `plain`
 * @param {Header} header
 * @param {Uint32Array} offsets of all lists
 * @param {(index: number, reference: number, previous: number) => void} restore
 */
function walk(chunk, plain, lengthsAt, header, offsets, restore) {
  const {listCount, count} = chunk;
  let beforeFirst = 0, beforeCount = 0, index = 0;
  for (let i = 0; i < listCount; ++i) {
    const p = lengthsAt + i;
    const length = plain[p] + plain[p + listCount] * 0x100 + plain[p + 2 * listCount] * 0x10000 +
                   plain[p + 3 * listCount] * 0x1000000;
    if (length > count - index || length > header.budget)
      fail(`list ${chunk.firstList + i} holds ${length} supersegments`);
    const listFirst = index;
    for (let j = 0; j < length; ++j, ++index) {
      const reference = beforeCount > 0 ? beforeFirst + Math.min(j, beforeCount - 1) : index - 1;
      restore(index, reference, j > 0 ? index - 1 : -1);
    }
    beforeFirst = listFirst;
    beforeCount = length;
    offsets[chunk.firstList + i + 1] = chunk.first + index;
  }
  if (index !== count) fail(`the chunk from list ${chunk.firstList} on holds fewer supersegments than announced`);
}

/** @param {Chunk} chunk @param {number} index @returns {never} */
function failOrder(chunk, index) {
  fail(`supersegment ${chunk.first + index} overlaps another one or has no extent`);
}

/** @param {Chunk} chunk @param {Uint8Array} plain @param {Vdi} vdi */
function decodeCompact(chunk, plain, vdi) {
  const n = chunk.count;
  const words = vdi.words.subarray(2 * chunk.first, 2 * (chunk.first + n));
  const lengthsAt = 8;
  const front = lengthsAt + 4 * chunk.listCount;
  const back = front + 2 * n, depth = back + 2 * n, red = depth + 2 * n, green = red + n, blue = green + n;
  walk(chunk, plain, lengthsAt, vdi, vdi.offsets, (i, reference, previous) => {
    const d = reference < 0 ? 0 : words[2 * reference];
    const m = reference < 0 ? 0 : words[2 * reference + 1];
    const least = previous < 0 ? 0 : (words[2 * previous] >>> 14) & 0x3fff;
    const from = previous < 0 ? d & 0x3fff : least;
    const f = (from + unfold(plain[front + i] | (plain[front + n + i] << 8))) & 0x3fff;
    const b = (f + (plain[back + i] | (plain[back + n + i] << 8))) & 0x3fff;
    if (f < least || f >= b) failOrder(chunk, i);
    const o = (((d >>> 28) | ((m >>> 24) << 4)) + unfold(plain[depth + i] | (plain[depth + n + i] << 8))) & 0xfff;
    const r = (m + unfold(plain[red + i])) & 0xff;
    const g = ((m >>> 8) + unfold(plain[green + i])) & 0xff;
    const l = ((m >>> 16) + unfold(plain[blue + i])) & 0xff;
    words[2 * i] = f | (b << 14) | (o << 28);
    words[2 * i + 1] = r | (g << 8) | (l << 16) | ((o >>> 4) << 24);
  });
}

/** @param {Uint8Array} plain @param {number} at @param {number} n */
function planeWord(plain, at, n) {
  return plain[at] | (plain[at + n] << 8) | (plain[at + 2 * n] << 16) | (plain[at + 3 * n] << 24);
}

const FRONT = 0, BACK = 1, RED = 2, OPACITY = 5;

/** @param {Chunk} chunk @param {Uint8Array} plain @param {Vdi} vdi */
function decodeFull(chunk, plain, vdi) {
  const n = chunk.count;
  const words = vdi.words.subarray(6 * chunk.first, 6 * (chunk.first + n));
  const floats = new Float32Array(words.buffer, words.byteOffset, words.length);
  const column = (/** @type {number} */ c) => 4 * chunk.listCount + 4 * n * c;
  walk(chunk, plain, 0, vdi, vdi.offsets, (i, reference, previous) => {
    const of = (/** @type {number} */ field) => reference < 0 ? 0 : words[6 * reference + field];
    const from = previous < 0 ? of(FRONT) : words[6 * previous + BACK];
    const at = 6 * i;
    words[at + FRONT] = from + unfold(planeWord(plain, column(0) + i, n));
    words[at + BACK] = words[at + FRONT] + planeWord(plain, column(1) + i, n);
    words[at + OPACITY] = of(OPACITY) + unfold(planeWord(plain, column(2) + i, n));
    for (let c = 0; c < 3; ++c) {
      const color = of(RED + c);
      const predicted = color === 0 ? 0 : color + words[at + OPACITY] - of(OPACITY);
      words[at + RED + c] = predicted + unfold(planeWord(plain, column(3 + c) + i, n));
    }
    const least = previous < 0 ? 0 : floats[6 * previous + BACK];
    if (!(floats[at] >= least && floats[at] < floats[at + 1] && floats[at + 1] < Infinity)) failOrder(chunk, i);
    const opacity = floats[at + OPACITY];
    const colored = Number.isFinite(floats[at + 2] + floats[at + 3] + floats[at + 4]);
    if (!(opacity > 0 && opacity <= 1 && colored)) fail(`supersegment ${chunk.first + i} has no colour or opacity`);
  });
}

/**
 * Reads the depth code of a chunk. All chunks of a file have the same one.
 * @param {Uint8Array} plain
 * @param {Chunk} chunk
 * @param {Vdi} vdi
 */
function takeCode(plain, chunk, vdi) {
  const view = new DataView(plain.buffer, plain.byteOffset, 8);
  const code = {first: view.getFloat32(0, true), step: view.getFloat32(4, true)};
  if (chunk.firstList === 0) {
    vdi.code = code;
    const last = Math.fround(code.first + Math.fround(MAX_CODE * code.step));
    const beforeLast = Math.fround(code.first + Math.fround((MAX_CODE - 1) * code.step));
    if (!(code.step > 0 && code.first >= 0 && last < Infinity && last > beforeLast))
      fail(`its depths begin at ${code.first} in steps of ${code.step}`);
  } else if (code.first !== vdi.code.first || code.step !== vdi.code.step) {
    fail("its chunks have different depth codes");
  }
}

/**
 * Decodes a whole file.
 * @param {Uint8Array} bytes
 * @param {(header: Header) => void} [accept] called before memory is allocated; it may throw
 * @param {() => Promise<void> | undefined} [pause] the decoder calls it between chunks, and awaits
 *     the promise if it returns one. It may throw to stop the decoder.
 * @returns {Promise<Vdi>}
 */
export async function decodeVdi(bytes, accept = () => {}, pause = () => undefined) {
  const header = decodeHeader(bytes);
  const chunks = chunksOf(bytes, header);
  accept(header);
  /** @type {Vdi} */
  const vdi = {
    ...header,
    code: {first: 0, step: 0},
    offsets: new Uint32Array(header.width * header.height + 1),
    words: new Uint32Array(header.supersegmentCount * (header.compact ? 2 : 6)),
  };
  const plainBytes = chunks.reduce((most, chunk) => Math.max(most, chunk.plainBytes), 0);
  const room = new Uint8Array(plainBytes);
  const table = new DataView(bytes.buffer, bytes.byteOffset + HEADER_BYTES, header.chunkCount * ENTRY_BYTES);
  for (let c = 0; c < chunks.length; ++c) {
    const chunk = chunks[c];
    if (!checksumHolds(chunk.packed, table, c * ENTRY_BYTES + 8))
      fail(`the checksum of the chunk from list ${chunk.firstList} on is wrong`);
    const plain = room.subarray(0, chunk.plainBytes);
    if (!lz4Expand(chunk.packed, plain)) fail(`the chunk from list ${chunk.firstList} on doesn't decompress to the size that it should have`);
    if (header.compact) {
      takeCode(plain, chunk, vdi);
      decodeCompact(chunk, plain, vdi);
    } else {
      decodeFull(chunk, plain, vdi);
    }
    const wait = pause();
    if (wait) await wait;
  }
  return vdi;
}
