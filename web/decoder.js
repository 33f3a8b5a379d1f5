// Prepares VDIs for the renderer, on a worker, so that the picture keeps moving. The worker runs
// the page's own script, which does nothing else there. If a browser refuses workers, the page
// decodes in short steps.

import {decodeVdi, startOf} from "./format.js";
import {expandedSegments, headsOf} from "./heads.js";
import {leaningOf} from "./slopes.js";
import {unpack} from "./unpack.js";

/** @typedef {import("./format.js").Header} Header */
/** @typedef {import("./heads.js").Heads} Heads */
/** @typedef {import("./slopes.js").Leaning} Leaning */

/**
 * A decoded VDI in the renderer's form.
 * @typedef {Header & Heads & {code: {first: number, step: number}, segments: Uint32Array,
 *     leaning?: Leaning}} PreparedVdi
 */

/**
 * The bytes of a .vdi file, or the text into which `vdi export` packed them.
 * @typedef {{file: Uint8Array} | {packed: string, size: number}} Encoded
 */

/** @typedef {{id: number, encoded?: Encoded, room?: Room, vdi?: PreparedVdi, isAbandoned?: boolean}} Question to decode
 * `encoded` within `room`, to find slopes of `vdi`, or to give up the question of that id */
/** @typedef {{id: number, vdi?: PreparedVdi, leaning?: Leaning, error?: string, cause?: string}} Answer */

/**
 * The room for a VDI: bytes of memory, and elements of a texture.
 * @typedef {{bytes: number, elements: number}} Room
 */

const GIB = 2 ** 30;
const PAGE_BYTES = 1.5 * GIB;   // for a VDI, mostPageBytes of vdi/core/Estimate.h
const MEMORY_SHARE = 0.4;       // of the machine's memory
const USUAL_MEMORY = 4;         // GiB, where the browser doesn't tell
const LIST_BYTES = 4 + 16;      // offset and head
const COMPACT_BYTES = 8;        // of a supersegment
const FULL_BYTES = 24 + 16;     // of a supersegment as decoded, and as prepared

/** @returns {Room} without the limits of the GPU */
export function roomOfPage() {
  const {deviceMemory = USUAL_MEMORY} = /** @type {{deviceMemory?: number}} */ (globalThis.navigator ?? {});
  return {bytes: Math.min(PAGE_BYTES, MEMORY_SHARE * deviceMemory * GIB), elements: Infinity};
}

/**
 * Throws Error with one line for the user if a VDI doesn't fit.
 * @param {Header} header @param {Room} room
 */
export function requireRoom({width, height, supersegmentCount, compact}, room) {
  const lists = width * height;
  const bytes = lists * LIST_BYTES + supersegmentCount * (compact ? COMPACT_BYTES : FULL_BYTES);
  const what = `this VDI has ${lists.toLocaleString("en")} lists and ${supersegmentCount.toLocaleString("en")} supersegments`;
  if (Math.max(lists, supersegmentCount) > room.elements)
    throw new Error(`${what}, but a texture of this GPU holds ${room.elements.toLocaleString("en")}`);
  if (bytes > room.bytes)
    throw new Error(`${what}, which take ${(bytes / GIB).toFixed(1)} GiB; this page has ${(room.bytes / GIB).toFixed(1)} GiB for a VDI`);
}

/**
 * Lets others run, for example events of a page, after each 12 ms or another time.
 * @param {number} [milliseconds]
 * @returns {() => Promise<void> | undefined}
 */
export function politely(milliseconds = 12) {
  let since = performance.now();
  return () => {
    if (performance.now() - since < milliseconds) return undefined;
    return new Promise((resolve) => setTimeout(() => {
      since = performance.now();
      resolve();
    }, 0));
  };
}

/**
 * @param {Encoded} encoded
 * @param {Room} room
 * @param {() => Promise<void> | undefined} pause see decodeVdi
 * @returns {Promise<PreparedVdi>}
 */
async function prepare(encoded, room, pause) {
  try {
    const bytes = "file" in encoded ? encoded.file : await unpack(encoded.packed, encoded.size);
    const {offsets, words, ...rest} = await decodeVdi(bytes, (header) => requireRoom(header, room), pause);
    const vdi = {...rest, offsets, words};
    return {...rest, ...headsOf(vdi), segments: vdi.compact ? words : expandedSegments(vdi)};
  } catch (error) {
    if (error instanceof RangeError) throw new Error("there is too little memory for this VDI", {cause: error});
    throw error;
  }
}

const ABANDONED = "another VDI is wanted by now";

/**
 * Pauses that let the decoder be told to give up.
 * @param {() => boolean} isWanted
 * @param {number} [milliseconds] between pauses
 */
function whileWanted(isWanted, milliseconds) {
  const pause = politely(milliseconds);
  return () => {
    if (!isWanted()) throw new Error(ABANDONED);
    return pause();
  };
}

const LOOK_MS = 100;  // a worker looks after this time whether it shall give up

/** Runs the page's script in a worker. */
export function serveDecoding() {
  const scope = /** @type {any} */ (globalThis);  // its type is in a library that conflicts with the DOM's
  let latest = -1;
  let before = Promise.resolve();  // the questions so far; one is answered at a time
  /** @type {Set<number>} */
  const abandoned = new Set();
  /** @param {Question} question @returns {Promise<[Answer, Transferable[]]>} */
  const answer = async ({id, encoded, room, vdi}) => {
    if (encoded && room) {
      const prepared = await prepare(encoded, room, whileWanted(() => !abandoned.has(id), LOOK_MS));
      return [{id, vdi: prepared}, [prepared.heads.buffer, prepared.tiles.buffer, prepared.segments.buffer]];
    }
    const leaning = vdi && await leaningOf(vdi, politely(), () => latest === id);
    return [{id, leaning}, leaning ? [leaning.slopes.buffer, leaning.heads.buffer, leaning.tiles.buffer] : []];
  };
  /** @param {Question} data */
  const reply = async (data) => {
    try {
      scope.postMessage(...await answer(data));
    } catch (error) {
      const {message, cause} = error instanceof Error ? error : new Error(String(error));
      scope.postMessage({id: data.id, error: message, cause: cause === undefined ? undefined : String(cause)});
    }
    abandoned.delete(data.id);
  };
  scope.onmessage = (/** @type {MessageEvent<Question>} */ {data}) => {
    if (data.isAbandoned) {
      abandoned.add(data.id);
      return;
    }
    latest = data.id;
    before = before.then(() => reply(data));
  };
  scope.postMessage({id: -1});  // ready
}

export class Decoder {
  /** @param {string} script the page's */
  constructor(script) {
    /** @type {Map<number, {resolve: (answer: Answer) => void, reject: (error: Error) => void, isWanted: () => boolean}>} */
    this.asked = new Map();
    this.room = roomOfPage();
    this.next = 0;
    /** Starts a worker and waits for its answer; undefined if the browser refuses workers. */
    this.worker = this.start(script);
  }

  /** @param {string} script @returns {Promise<Worker | undefined>} */
  async start(script) {
    const url = URL.createObjectURL(new Blob([script], {type: "text/javascript"}));
    try {
      const worker = new Worker(url);
      return await new Promise((resolve) => {
        worker.onmessage = ({data}) => data.id < 0 ? resolve(worker) : this.take(data);
        worker.onerror = (event) => {
          console.warn("the worker has failed:", event.message);
          resolve(undefined);
          this.fail(worker, event.message);
        };
      });
    } catch (error) {
      console.warn("the browser refuses a worker:", error);
      return undefined;
    } finally {
      URL.revokeObjectURL(url);
    }
  }

  /** @param {Answer} answer */
  take(answer) {
    const asked = this.asked.get(answer.id);
    this.asked.delete(answer.id);
    if (answer.error === undefined) asked?.resolve(answer);
    else asked?.reject(new Error(answer.error, {cause: answer.cause}));
  }

  /** @param {Worker} worker a worker that has ended @param {unknown} cause */
  fail(worker, cause) {
    worker.terminate();
    this.worker = Promise.resolve(undefined);
    for (const {reject} of this.asked.values()) reject(new Error("the browser stopped decoding this VDI", {cause}));
    this.asked.clear();
  }

  /**
   * Throws Error with one line for the user, before any decoding, if a file is damaged or too large.
   * @param {Uint8Array} start at least the first HEADER_BYTES, if the file has them
   * @param {number} fileBytes
   */
  requireFits(start, fileBytes) {
    requireRoom(startOf(start, fileBytes), this.room);
  }

  /**
   * Throws Error with one line for the user. The call takes over the file's bytes.
   * @param {Encoded} encoded
   * @param {() => boolean} [isWanted] a later question gives up the decoding of what isn't wanted any more
   * @returns {Promise<PreparedVdi>}
   */
  async decode(encoded, isWanted = () => true) {
    const worker = await this.worker;
    const id = this.next++;
    if (!worker) return prepare(encoded, this.room, whileWanted(isWanted));
    const transfer = "file" in encoded ? [encoded.file.buffer] : [];
    const {vdi} = await this.ask(worker, {id, encoded, room: this.room}, transfer, isWanted);
    if (!vdi) throw new Error("the worker sent no VDI");
    return vdi;
  }

  /**
   * Finds how a VDI's supersegments lean. Throws Error.
   * @param {PreparedVdi} vdi
   * @returns {Promise<Leaning | undefined>} undefined if the decoder was asked for something else meanwhile
   */
  async lean(vdi) {
    const worker = await this.worker;
    const id = this.next++;
    if (!worker) return leaningOf(vdi, politely(), () => this.next === id + 1);
    return (await this.ask(worker, {id, vdi}, [])).leaning;
  }

  /**
   * @param {Worker} worker @param {Question} question @param {Transferable[]} transfer @param {() => boolean} [isWanted]
   * @returns {Promise<Answer>}
   */
  ask(worker, question, transfer, isWanted = () => true) {
    for (const [id, other] of this.asked) if (!other.isWanted()) worker.postMessage({id, isAbandoned: true});
    return new Promise((resolve, reject) => {
      this.asked.set(question.id, {resolve, reject, isWanted});
      worker.postMessage(question, transfer);
    });
  }
}
