// Sources of existing frames. The page knows only `Source`, which decodes a frame on
// request. Frames may be inside the page (`embeddedSource`), or files that the user opened or
// dropped (`filesSource`). A server sends frames on its own; see live.js.

import {HEADER_BYTES} from "./format.js";

/** @typedef {import("./decoder.js").Decoder} Decoder */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */

/**
 * @typedef {object} Source
 * @property {number} count number of frames
 * @property {(frame: number) => string} nameOf
 * @property {(frame: number, isWanted: () => boolean) => Promise<PreparedVdi>} load throws Error with one line
 *     for the user; may give up a frame that isn't wanted any more
 */

/**
 * Caches the latest decoded frames that fit into `mostBytes`.
 * @param {Source["load"]} load
 * @param {number} mostBytes
 */
function keepingSome(load, mostBytes) {
  /** @type {Map<number, PreparedVdi>} */
  const kept = new Map();
  const bytesOf = (/** @type {PreparedVdi} */ vdi) =>
    vdi.segments.byteLength + vdi.heads.byteLength +
    (vdi.leaning ? vdi.leaning.slopes.byteLength + vdi.leaning.heads.byteLength : 0);
  return async (/** @type {number} */ frame, /** @type {() => boolean} */ isWanted) => {
    const vdi = kept.get(frame) ?? await load(frame, isWanted);
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

/**
 * The frames inside the page: elements with the packed file as text, and the attributes data-name
 * and data-size.
 * @param {HTMLElement[]} elements
 * @param {Decoder} decoder
 * @returns {Source}
 */
export function embeddedSource(elements, decoder) {
  return {
    count: elements.length,
    nameOf: (frame) => elements[frame].dataset.name ?? "",
    load: keepingSome((frame, isWanted) => decoder.decode({packed: elements[frame].textContent ?? "",
                                                           size: Number(elements[frame].dataset.size)}, isWanted), MOST_BYTES),
  };
}

/**
 * Files, ordered by the numbers in their names.
 * @param {File[]} files
 * @param {Decoder} decoder
 * @returns {Source}
 */
export function filesSource(files, decoder) {
  const order = new Intl.Collator("en", {numeric: true});
  const sorted = [...files].sort((a, b) => order.compare(a.name, b.name));
  return {
    count: sorted.length,
    nameOf: (frame) => sorted[frame].name,
    load: keepingSome(async (frame, isWanted) => {
      const file = sorted[frame];
      decoder.requireFits(new Uint8Array(await file.slice(0, HEADER_BYTES).arrayBuffer()), file.size);
      const bytes = new Uint8Array(await file.arrayBuffer());
      if (!isWanted()) throw new Error("another file is wanted by now");
      return decoder.decode({file: bytes}, isWanted);
    }, MOST_BYTES),
  };
}
