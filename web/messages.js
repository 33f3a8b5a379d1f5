// Reads a server's messages: control messages as JSON, and levels of frames in parts. A server may
// be damaged or hostile. The reader checks every field, and allocates memory only for bytes that
// have arrived. docs/live.md has the protocol.

export const STREAM_VERSION = 1;
export const SUBPROTOCOL = "pv-vdi.1";

/** Reports a message that breaks the protocol. Its text is one line for the user. */
export class StreamError extends Error {}

/** @param {string} what @param {unknown} [cause] @returns {never} */
function refuse(what, cause) {
  throw new StreamError(`the server's message is damaged: ${what}`, {cause});
}

/**
 * A level of a frame: one whole .vdi file.
 * @typedef {object} Level
 * @property {number} frame
 * @property {number} level 0 is the coarsest
 * @property {number} levels of this frame
 * @property {number} bytes of the file
 * @property {number} width lists per row
 * @property {number} height
 * @property {number | null} step
 * @property {number | null} time
 * @property {number} age seconds from making the frame to sending this level's first byte
 * @property {number} dropped frames that the server didn't send to this viewer
 */

/**
 * Frames that the server offers by number, with the simulation's steps and times. Times may be
 * unknown.
 * @typedef {{times: (number | null)[], steps: number[]}} Series
 */

/**
 * @typedef {{type: "welcome", version: number, session: string, series: Series | null,
 *            viewers: number, steer: boolean, pulse: number}} Welcome `pulse`: the most seconds between
 *     two messages of the server; 0: no limit
 * @typedef {{type: "series", from: number} & Series} SeriesPart a series' further frames, beginning
 *     at `from`
 * @typedef {{type: "error", cause: string}} Refusal
 * @typedef {{type: "state", state: "waiting" | "live" | "ended", viewers: number, cause: string}} ServerState
 *     `cause`: why no frames come although they should; may be empty
 * @typedef {{type: "level"} & Level} LevelBegin
 * @typedef {{name: string, whole: boolean, value: number, low: number, high: number}} Parameter a
 *     parameter of the simulation, with its present value
 * @typedef {object} Generator the settings that make the VDIs
 * @property {[number, number]} resolution 0: not set
 * @property {number} supersegments
 * @property {[number, number] | null} range of the colour map; null without one
 * @property {string[]} presets
 * @property {string} [preset] the colour map in force, "" if it has no name; older servers don't say
 * @property {number} [sampling_rate] samples per voxel, 0: automatic; older servers don't say
 * @typedef {{type: "steering", you: number, driver: number | null, period: number, paused: boolean,
 *            parameters: Parameter[], generator: Generator | null}} Steering what a driver may change,
 *     its present state, and the driver
 * @typedef {{type: "denied", cause: string}} Denied
 * @typedef {{type: "missing", frame: number, cause: string}} Missing the file of a wanted frame is
 *     damaged or gone
 * @typedef {{camera?: object, resolution?: [number, number], supersegments?: number, sampling_rate?: number,
 *            range?: [number, number], preset?: string, period?: number, paused?: boolean,
 *            parameters?: {[name: string]: number}}} Wish a driver's request
 * @typedef {{type: "other"}} Other a message that viewers don't need
 * @typedef {Welcome | SeriesPart | Refusal | ServerState | LevelBegin | Steering | Denied |
 *           Missing | Other} ServerMessage
 */

const MOST_TEXT = 1 << 20;       // characters in a message
const MOST_FRAMES = 1 << 20;     // in a series
const MOST_LEVEL_BYTES = 1 << 30;
const MOST_LEVELS = 16;
const MOST_LISTS = 32768;        // along a side
const MOST_SUPERSEGMENTS = 1024; // in a list, maxSupersegments of vdi/core/Budget.h
const MOST_SAMPLES = 64;         // per voxel, and voxels per sample
const MOST_ENTRIES = 64;         // parameters or presets
const PART_HEADER_BYTES = 16;
const FIRST_ROOM = 1 << 20;
const LONGEST_PULSE = 3600;      // seconds

/** @param {unknown} value @param {number} least @param {number} most */
function isWhole(value, least, most) {
  return Number.isInteger(value) && Number(value) >= least && Number(value) <= most;
}

/** @param {unknown} value @param {number} most characters */
function textOf(value, most) {
  if (typeof value !== "string") refuse("a string is missing");
  return value.slice(0, most);
}

/** @param {unknown} cause @returns {string} one line */
function causeOf(cause) {
  return textOf(cause, 300).replace(/\s+/g, " ");
}

/** @param {unknown} value @param {string} name @returns {number | null} */
function numberOrNull(value, name) {
  if (value === undefined || value === null) return null;
  if (typeof value !== "number" || !Number.isFinite(value)) refuse(`${name} isn't a number`);
  return value;
}

/** @param {unknown} value @returns {number} 0 if it is missing */
function viewersOf(value) {
  return isWhole(value, 0, 1e9) ? Number(value) : 0;
}

/** @param {unknown} value @returns {number} seconds; 0 if it is missing */
function pulseOf(value) {
  const pulse = numberOrNull(value, "a pulse") ?? 0;
  if (pulse < 0 || pulse > LONGEST_PULSE) refuse(`a pulse of ${pulse} s`);
  return pulse;
}

/** @param {any} json @returns {Series} */
function seriesOf(json) {
  const {times, steps} = json;
  const areTimes = Array.isArray(times) && times.every((time) => time === null || Number.isFinite(time));
  const areSteps = Array.isArray(steps) && steps.every((step) => isWhole(step, 0, Number.MAX_VALUE));
  if (!areTimes || !areSteps || times.length !== steps.length) refuse("its series has no times and steps");
  return {times, steps};
}

/**
 * Appends a part to a series. Throws StreamError unless the part follows it.
 * @param {Series | null} series
 * @param {SeriesPart} part
 * @returns {Series}
 */
export function extendedSeries(series, part) {
  const {times, steps} = series ?? {times: [], steps: []};
  if (part.from !== steps.length || steps.length + part.steps.length > MOST_FRAMES)
    refuse(`frames beginning at ${part.from} for a series of ${steps.length}`);
  return {times: [...times, ...part.times], steps: [...steps, ...part.steps]};
}

/** @param {any} json @returns {LevelBegin} */
function levelOf(json) {
  const {frame, level, levels, bytes, width, height, age, dropped} = json;
  if (!isWhole(frame, 0, 0xffffffff)) refuse("a level without a frame");
  if (!isWhole(levels, 1, MOST_LEVELS) || !isWhole(level, 0, levels - 1)) refuse(`level ${level} of ${levels}`);
  if (!isWhole(bytes, 1, MOST_LEVEL_BYTES)) refuse(`a level of ${bytes} bytes`);
  if (!isWhole(width, 1, MOST_LISTS) || !isWhole(height, 1, MOST_LISTS)) refuse(`${width} x ${height} lists`);
  return {
    type: "level", frame, level, levels, bytes, width, height,
    step: numberOrNull(json.step, "a step"), time: numberOrNull(json.time, "a time"),
    age: Math.max(numberOrNull(age, "an age") ?? 0, 0), dropped: isWhole(dropped, 0, Number.MAX_SAFE_INTEGER) ? dropped : 0,
  };
}

/** @param {unknown} list @param {string} name @returns {any[]} */
function fewOf(list, name) {
  if (!Array.isArray(list) || list.length > MOST_ENTRIES) refuse(`${name} aren't a list of at most ${MOST_ENTRIES} entries`);
  return list;
}

/** @param {any} json @returns {Parameter} */
function parameterOf(json) {
  const {whole, value, low, high} = json ?? {};
  if (![value, low, high].every(Number.isFinite) || !(low <= value && value <= high)) refuse("a parameter beyond its bounds");
  return {name: textOf(json.name, MOST_ENTRIES), whole: whole === true, value, low, high};
}

/** @param {any} rate @returns {{sampling_rate?: number}} */
function samplingRateOf(rate) {
  if (rate === undefined || rate === null) return {};
  if (rate !== 0 && !(typeof rate === "number" && rate >= 1 / MOST_SAMPLES && rate <= MOST_SAMPLES)) refuse("a wrong sampling rate");
  return {sampling_rate: rate};
}

/** @param {any} json @returns {Generator} */
function generatorOf({resolution, supersegments, range, presets, preset, sampling_rate}) {
  const isSize = Array.isArray(resolution) && resolution.length === 2 && resolution.every((side) => isWhole(side, 0, MOST_LISTS));
  if (!isSize || !isWhole(supersegments, 0, MOST_SUPERSEGMENTS)) refuse("a wrong resolution");
  const rises = Array.isArray(range) && range.length === 2 && range.every(Number.isFinite) && range[0] < range[1];
  if (!rises && range !== null) refuse("a range whose ends don't ascend");
  return {resolution: [resolution[0], resolution[1]], supersegments, range: rises ? [range[0], range[1]] : null,
          presets: fewOf(presets, "presets").map((name) => textOf(name, MOST_ENTRIES)),
          ...typeof preset === "string" ? {preset: textOf(preset, MOST_ENTRIES)} : {}, ...samplingRateOf(sampling_rate)};
}

/** @param {any} json @returns {Steering} */
function steeringOf(json) {
  const {you, driver, period, paused, parameters, generator} = json;
  if (!isWhole(you, 0, 0xffffffff) || !isWhole(driver ?? 0, 0, 0xffffffff)) refuse("viewers without numbers");
  if (!isWhole(period, 1, 1e6)) refuse("a wrong period");
  return {type: "steering", you, driver: driver ?? null, period, paused: paused === true,
          parameters: fewOf(parameters, "parameters").map(parameterOf),
          generator: generator ? generatorOf(generator) : null};
}

/**
 * Reads a control message. Throws StreamError if it breaks the protocol. Messages that this page
 * doesn't need get the type "other".
 * @param {string} text
 * @returns {ServerMessage}
 */
export function serverMessageOf(text) {
  if (text.length > MOST_TEXT) refuse(`${text.length} characters`);
  let json;
  try {
    json = JSON.parse(text);
  } catch (cause) {
    refuse("it isn't JSON", cause);
  }
  switch (json?.type) {
    case "welcome":
      if (!isWhole(json.version, 0, 0xffffffff)) refuse("a welcome without a version");
      return {type: "welcome", version: json.version, session: textOf(json.session, 200), viewers: viewersOf(json.viewers),
              series: json.series ? seriesOf(json.series) : null, steer: json.steer === true, pulse: pulseOf(json.pulse)};
    case "series":
      return {type: "series", from: Number(json.from), ...seriesOf(json)};
    case "error":
      return {type: "error", cause: causeOf(json.cause)};
    case "state":
      if (!["waiting", "live", "ended"].includes(json.state)) refuse("a state that this page doesn't know");
      return {type: "state", state: json.state, viewers: viewersOf(json.viewers),
              cause: json.cause === undefined ? "" : causeOf(json.cause)};
    case "steering":
      return steeringOf(json);
    case "denied":
      return {type: "denied", cause: causeOf(json.cause)};
    case "missing":
      if (!isWhole(json.frame, 0, 0xffffffff)) refuse("a missing frame without a number");
      return {type: "missing", frame: json.frame, cause: causeOf(json.cause)};
    case "level":
      return levelOf(json);
    default:
      if (typeof json?.type !== "string") refuse("it has no type");
      return {type: "other"};
  }
}

/**
 * Joins the parts of levels. It assembles one level at a time and drops an unfinished one when the
 * next begins. Its buffer grows with the received bytes, up to twice their number.
 */
export class LevelAssembler {
  constructor() {
    /** @type {Level | undefined} */
    this.level = undefined;
    this.received = 0;
    this.room = new Uint8Array(0);
  }

  /** @param {Level} level the next one */
  begin(level) {
    this.level = level;
    this.received = 0;
    this.room = new Uint8Array(Math.min(level.bytes, FIRST_ROOM));
  }

  /** Drops the unfinished level. */
  drop() {
    this.level = undefined;
    this.received = 0;
    this.room = new Uint8Array(0);
  }

  /**
   * Takes a binary message: u32 frame, u32 level, u64 offset, then bytes. Throws StreamError if
   * this part doesn't continue the unfinished level.
   * @param {ArrayBuffer} message
   * @returns {Uint8Array | undefined} the level's file, once it is complete
   */
  add(message) {
    const {level} = this;
    if (message.byteLength <= PART_HEADER_BYTES) refuse("a part without bytes");
    const view = new DataView(message);
    const offset = view.getUint32(8, true) + view.getUint32(12, true) * 0x100000000;
    if (!level) refuse("a part without a level");
    if (view.getUint32(0, true) !== level.frame || view.getUint32(4, true) !== level.level)
      refuse("a part of a level that wasn't announced");
    if (offset !== this.received) refuse(`a part at byte ${offset} after ${this.received} bytes`);
    const part = new Uint8Array(message, PART_HEADER_BYTES);
    const end = this.received + part.length;
    if (end > level.bytes) refuse(`more than the announced ${level.bytes} bytes`);
    if (end > this.room.length) {
      const larger = new Uint8Array(Math.min(level.bytes, Math.max(2 * this.room.length, end)));
      larger.set(this.room.subarray(0, this.received));
      this.room = larger;
    }
    this.room.set(part, this.received);
    this.received = end;
    if (end < level.bytes) return undefined;
    const file = this.room;
    this.drop();
    return file;
  }
}
