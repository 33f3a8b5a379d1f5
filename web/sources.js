// Where frames come from. The viewer knows only `Source`: frames by number, decoded when they are asked for. Frames may be
// inside the page (`embeddedSource`) or files that were opened or dropped (`filesSource`); a connection to a server will be a
// third source, one that calls `onChange` when it has a new frame.

import {FormatError, decodeVdi} from "./format.js";

/** @typedef {import("./format.js").Vdi} Vdi */

/**
 * @typedef {object} Source
 * @property {number} count of frames
 * @property {(frame: number) => string} nameOf
 * @property {(frame: number) => Promise<Vdi>} load throws Error with one line for the user
 * @property {() => void} [onChange] set by the viewer, called by sources whose frames change
 */

/**
 * Lets the page do other things each 12 ms.
 * @returns {() => Promise<void> | undefined}
 */
function politely() {
  let since = performance.now();
  return () => {
    if (performance.now() - since < 12) return undefined;
    return new Promise((resolve) => setTimeout(() => {
      since = performance.now();
      resolve();
    }, 0));
  };
}

/** @param {Uint8Array} bytes */
async function decodePolitely(bytes) {
  try {
    return await decodeVdi(bytes, politely());
  } catch (error) {
    if (error instanceof RangeError) throw new Error("too little memory for this VDI");
    throw error;
  }
}

/**
 * Keeps the last few decoded frames, as far as they fit into `mostBytes`.
 * @param {(frame: number) => Promise<Vdi>} load
 * @param {number} mostBytes
 */
function keepingSome(load, mostBytes) {
  /** @type {Map<number, Vdi>} */
  const kept = new Map();
  const bytesOf = (/** @type {Vdi} */ vdi) => vdi.words.byteLength + vdi.offsets.byteLength;
  return async (/** @type {number} */ frame) => {
    const vdi = kept.get(frame) ?? await load(frame);
    kept.delete(frame);
    kept.set(frame, vdi);
    let total = 0;
    for (const [number, other] of [...kept].reverse()) {
      total += bytesOf(other);
      if (total > mostBytes && number !== frame) kept.delete(number);
    }
    return vdi;
  };
}

const MOST_BYTES = 512 << 20;

/** @param {string} text base64 @returns {Uint8Array} */
function bytesOfBase64(text) {
  let binary;
  try {
    binary = atob(text);
  } catch {
    throw new FormatError("the data in this page are damaged: they are not base64");
  }
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

const MOST_INFLATED = 1032;  // bytes that a byte of deflate data stands for

/**
 * Expands data that `vdi export` packed, and never more than it said.
 * @param {Uint8Array} packed
 * @param {number} size
 */
async function inflate(packed, size) {
  if (typeof DecompressionStream === "undefined")
    throw new Error("this browser is too old to unpack the data (no DecompressionStream)");
  if (!(size > 0 && size <= packed.length * MOST_INFLATED))
    throw new FormatError("the data in this page are damaged: their size is wrong");
  const bytes = new Uint8Array(size);
  let at = 0;
  try {
    const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      bytes.set(part.value, at);  // throws beyond the end
      at += part.value.length;
    }
  } catch {
    throw new FormatError("the data in this page are damaged: they don't unpack");
  }
  if (at !== size) throw new FormatError("the data in this page are damaged: they end too early");
  return bytes;
}

/**
 * The frames inside the page: elements with the packed file as text, and attributes data-name and data-size.
 * @param {HTMLElement[]} elements
 * @returns {Source}
 */
export function embeddedSource(elements) {
  return {
    count: elements.length,
    nameOf: (frame) => elements[frame].dataset.name ?? "",
    load: keepingSome(async (frame) => {
      const packed = bytesOfBase64(elements[frame].textContent ?? "");
      return decodePolitely(await inflate(packed, Number(elements[frame].dataset.size)));
    }, MOST_BYTES),
  };
}

/**
 * Files in the order of the numbers in their names.
 * @param {File[]} files
 * @returns {Source}
 */
export function filesSource(files) {
  const order = new Intl.Collator("en", {numeric: true});
  const sorted = [...files].sort((a, b) => order.compare(a.name, b.name));
  return {
    count: sorted.length,
    nameOf: (frame) => sorted[frame].name,
    load: keepingSome(async (frame) => decodePolitely(new Uint8Array(await sorted[frame].arrayBuffer())), MOST_BYTES),
  };
}
