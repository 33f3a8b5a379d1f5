// A driver's requests that the simulation hasn't taken yet. It takes them between its steps, which
// may last minutes.

import {length, minus} from "./vector.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./messages.js").Steering} Steering */
/** @typedef {import("./messages.js").Wish} Wish */

/**
 * A request for one setting. `done` tells whether the settings in force, or the camera of the VDI on
 * show, are as requested.
 * @typedef {{words: string, since: number, done: (steering: Steering, camera: Camera | undefined) => boolean}} Request
 */

const TOLERANCE = 1e-4;  // some settings pass through single precision

/** @param {number} a @param {number} b */
const isClose = (a, b) => Math.abs(a - b) <= TOLERANCE * Math.max(Math.abs(a), Math.abs(b), 1e-30);

/** @param {readonly number[] | null | undefined} a @param {readonly number[]} b */
const areClose = (a, b) => a?.length === b.length && Math.hypot(...b.map((n, i) => n - a[i])) <= TOLERANCE * Math.hypot(...b);

/**
 * @param {Wish} wish
 * @returns {[string, Omit<Request, "since">][]} by setting
 */
function requestsOf(wish) {
  const {camera, resolution, supersegments, sampling_rate, range, preset, period, paused, parameters} = wish;
  /** @type {[string, Omit<Request, "since">][]} */
  const requests = [];
  if (camera) {
    const {position, focalPoint} = /** @type {Camera} */ (camera);
    const reach = length(minus(position, focalPoint));
    const isThere = (/** @type {Camera | undefined} */ at) => at !== undefined &&
      length(minus(position, at.position)) <= TOLERANCE * 10 * reach;
    requests.push(["camera", {words: "new view", done: (_, at) => isThere(at)}]);
  }
  if (resolution) requests.push(["resolution", {words: "resolution", done: ({generator}) => areClose(generator?.resolution, resolution)}]);
  if (supersegments !== undefined)
    requests.push(["supersegments", {words: "supersegments", done: ({generator}) => generator?.supersegments === supersegments}]);
  if (sampling_rate !== undefined)
    requests.push(["sampling_rate", {words: "samples", done: ({generator}) => isClose(generator?.sampling_rate ?? -1, sampling_rate)}]);
  if (range) requests.push(["range", {words: "colours' range", done: ({generator}) => areClose(generator?.range, range)}]);
  if (preset !== undefined) {
    requests.push(["preset", {words: "colours", done: ({generator}) => (generator?.preset ?? preset) === preset}]);
  }
  if (period !== undefined) requests.push(["period", {words: "period", done: (steering) => steering.period === period}]);
  if (paused !== undefined)
    requests.push(["paused", {words: paused ? "pause" : "go on", done: (steering) => steering.paused === paused}]);
  for (const [name, value] of Object.entries(parameters ?? {})) {
    requests.push([`parameter ${name}`, {words: name, done: (steering) => {
      const parameter = steering.parameters.find((one) => one.name === name);
      return parameter === undefined || isClose(parameter.value, value);
    }}]);
  }
  return requests;
}

export class PendingRequests {
  constructor() {
    /** @type {Map<string, Request>} the latest of each setting */
    this.requests = new Map();
    /** @type {string[]} settings of the latest wish */
    this.latest = [];
  }

  /** @param {Wish} wish @param {number} now milliseconds */
  add(wish, now) {
    const requests = requestsOf(wish);
    this.latest = requests.map(([setting]) => setting);
    for (const [setting, request] of requests) this.requests.set(setting, {...request, since: now});
  }

  /**
   * Forgets the requests that are in force.
   * @param {Steering} steering
   * @param {Camera | undefined} camera of the VDI on show
   */
  settle(steering, camera) {
    for (const [setting, {done}] of this.requests) if (done(steering, camera)) this.requests.delete(setting);
  }

  /** Forgets the latest wish, which the server has refused. */
  refuse() {
    for (const setting of this.latest) this.requests.delete(setting);
  }

  clear() {
    this.requests.clear();
  }

  /** @param {string} setting */
  has(setting) {
    return this.requests.has(setting);
  }

  /**
   * The requests in words, with the time since the oldest; empty without any.
   * @param {number} now milliseconds
   */
  text(now) {
    if (this.requests.size === 0) return "";
    const all = [...this.requests.values()];
    const seconds = Math.floor((now - Math.min(...all.map(({since}) => since))) / 1000);
    return `${all.map(({words}) => words).join(", ")} requested${seconds > 0 ? ` ${seconds} s ago` : ""}`;
  }
}
