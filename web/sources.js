// Sources of existing frames. The page knows only `Source`, which decodes a frame on
// request. Frames may be inside the page (`embeddedSource`), or files that the user opened or
// dropped (`filesSource`). A server sends frames on its own; see live.js.

/** @typedef {import("./decoder.js").Decoder} Decoder */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */

/**
 * @typedef {object} Source
 * @property {number} count number of frames
 * @property {(frame: number) => string} nameOf
 * @property {(frame: number) => Promise<PreparedVdi>} load throws Error with one line for the user
 */

/**
 * Caches the latest decoded frames that fit into `mostBytes`.
 * @param {(frame: number) => Promise<PreparedVdi>} load
 * @param {number} mostBytes
 */
function keepingSome(load, mostBytes) {
  /** @type {Map<number, PreparedVdi>} */
  const kept = new Map();
  const bytesOf = (/** @type {PreparedVdi} */ vdi) =>
    vdi.segments.byteLength + vdi.heads.byteLength +
    (vdi.leaning ? vdi.leaning.slopes.byteLength + vdi.leaning.heads.byteLength : 0);
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
    load: keepingSome((frame) => decoder.decode({packed: elements[frame].textContent ?? "",
                                                 size: Number(elements[frame].dataset.size)}), MOST_BYTES),
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
    load: keepingSome(async (frame) => decoder.decode({file: new Uint8Array(await sorted[frame].arrayBuffer())}), MOST_BYTES),
  };
}
