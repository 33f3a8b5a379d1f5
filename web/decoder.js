// Prepares VDIs for the renderer, on a worker, so that the picture keeps moving. The worker runs
// the page's own script, which does nothing else there. If a browser refuses workers, the page
// decodes in short steps.

import {decodeVdi} from "./format.js";
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

/** @typedef {{id: number, encoded?: Encoded, vdi?: PreparedVdi}} Question to decode `encoded`, or to find slopes of `vdi` */
/** @typedef {{id: number, vdi?: PreparedVdi, leaning?: Leaning, error?: string, cause?: string}} Answer */

/**
 * Lets the page handle events every 12 ms.
 * @returns {() => Promise<void> | undefined}
 */
export function politely() {
  let since = performance.now();
  return () => {
    if (performance.now() - since < 12) return undefined;
    return new Promise((resolve) => setTimeout(() => {
      since = performance.now();
      resolve();
    }, 0));
  };
}

/**
 * @param {Encoded} encoded
 * @param {() => Promise<void> | undefined} [pause] see decodeVdi
 * @returns {Promise<PreparedVdi>}
 */
async function prepare(encoded, pause) {
  try {
    const bytes = "file" in encoded ? encoded.file : await unpack(encoded.packed, encoded.size);
    const {offsets, words, ...rest} = await decodeVdi(bytes, pause);
    const vdi = {...rest, offsets, words};
    return {...rest, ...headsOf(vdi), segments: vdi.compact ? words : expandedSegments(vdi)};
  } catch (error) {
    if (error instanceof RangeError) throw new Error("there is too little memory for this VDI", {cause: error});
    throw error;
  }
}

/** Runs the page's script in a worker. */
export function serveDecoding() {
  const scope = /** @type {any} */ (globalThis);  // its type is in a library that conflicts with the DOM's
  let latest = -1;
  /** @param {Question} question @returns {Promise<[Answer, Transferable[]]>} */
  const answer = async ({id, encoded, vdi}) => {
    if (encoded) {
      const prepared = await prepare(encoded);
      return [{id, vdi: prepared}, [prepared.heads.buffer, prepared.tiles.buffer, prepared.segments.buffer]];
    }
    const leaning = vdi && await leaningOf(vdi, politely(), () => latest === id);
    return [{id, leaning}, leaning ? [leaning.slopes.buffer, leaning.heads.buffer, leaning.tiles.buffer] : []];
  };
  scope.onmessage = async (/** @type {MessageEvent<Question>} */ {data}) => {
    latest = data.id;
    try {
      scope.postMessage(...await answer(data));
    } catch (error) {
      const {message, cause} = error instanceof Error ? error : new Error(String(error));
      scope.postMessage({id: data.id, error: message, cause: cause === undefined ? undefined : String(cause)});
    }
  };
  scope.postMessage({id: -1});  // ready
}

export class Decoder {
  /** @param {string} script the page's */
  constructor(script) {
    /** @type {Map<number, {resolve: (answer: Answer) => void, reject: (error: Error) => void}>} */
    this.asked = new Map();
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
   * Throws Error with one line for the user. The call takes over the file's bytes.
   * @param {Encoded} encoded
   * @returns {Promise<PreparedVdi>}
   */
  async decode(encoded) {
    const worker = await this.worker;
    const id = this.next++;
    if (!worker) return prepare(encoded, politely());
    const {vdi} = await this.ask(worker, {id, encoded}, "file" in encoded ? [encoded.file.buffer] : []);
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

  /** @param {Worker} worker @param {Question} question @param {Transferable[]} transfer @returns {Promise<Answer>} */
  ask(worker, question, transfer) {
    return new Promise((resolve, reject) => {
      this.asked.set(question.id, {resolve, reject});
      worker.postMessage(question, transfer);
    });
  }
}
