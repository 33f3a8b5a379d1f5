// Shows the state of a connection to a server, and has the button that pauses it.

import {Live} from "./live.js";
import {SUBPROTOCOL} from "./messages.js";
import {reasonOf} from "./reach.js";

/** @typedef {import("./decoder.js").Decoder} Decoder */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */
/** @typedef {import("./live.js").Arrived} Arrived */

/**
 * The outcome of a request for a frame. "shown": the page shows the frame, in full or at the level
 * that came in time; "missed": its file is damaged or gone; "failed": the connection is lost, or
 * the user wants another frame by now.
 * @typedef {"shown" | "missed" | "failed"} Outcome
 */

/**
 * @typedef {object} LiveView the part of the page that shows the frames
 * @property {(vdi: PreparedVdi, level: Arrived) => Promise<boolean>} show LiveOptions.onLevel
 * @property {(message: string) => void} tell
 * @property {(index: number) => void} onSeries called if the server has a series; `index` is on
 *     show
 * @property {() => void} onChange called when the server reports something new
 */

const PATIENCE_MS = 700;   // time that a playing series waits for a frame's finer levels
const REFRESH_MS = 500;    // interval between updates of the line
const STALE_S = 10;        // from this age on, the line shows whole seconds

/**
 * Removes the token from the URL, where a screenshot or an onlooker would reveal it. This tab's
 * entry of the session's history keeps it, so reloading still works. The rest of the fragment
 * stays.
 * @returns {string} empty without a token
 */
export function takeToken() {
  const words = new URLSearchParams(location.hash.slice(1));
  const token = words.get("token") ?? "";
  const kept = history.state?.token;
  if (token === "") return typeof kept === "string" ? kept : "";
  const rest = location.hash.slice(1).split("&").filter((word) => !word.startsWith("token="));
  const url = rest.length > 0 ? `#${rest.join("&")}` : location.pathname + location.search;
  history.replaceState({...history.state, token}, "", url);
  return token;
}

/** @param {number} seconds */
function ageText(seconds) {
  if (seconds < STALE_S) return `${seconds.toFixed(1)} s old`;
  if (seconds < 120) return `${Math.round(seconds)} s old`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min old`;
  return `${Math.round(seconds / 3600)} h old`;
}

/**
 * Whether the run has ended as it should and its server is gone. The page looks for another run.
 * @param {Live} live
 */
function isGone(live) {
  return live.hasEnded && (live.state === "lost" || live.state === "connecting");
}

/** @param {number} received bytes @param {number} bytes of all */
function arrivedText(received, bytes) {
  const [unit, name, digits] = bytes < 1e6 ? [1e3, "kB", 0] : [1e6, "MB", 1];
  return `${(received / unit).toFixed(digits)} of ${(bytes / unit).toFixed(digits)} ${name}`;
}

/**
 * The state of a connection in one line.
 * @param {Live} live
 * @param {number} now milliseconds
 */
export function liveText(live, now) {
  const {shown, state} = live;
  const words = {connecting: "Connecting", waiting: "Waiting for a frame", live: "Live", ended: "Ended", lost: "Not connected",
                 refused: "Refused", closed: "Off"};
  const isOn = state === "live" || state === "waiting" || state === "ended";
  const isSeries = live.series !== null && state === "ended";
  const isOver = isGone(live);
  const parts = [isOn && live.isPaused ? "Paused" : isSeries ? "Series" : words[isOver ? "ended" : state]];
  if (state === "lost" && !isOver) parts.push(live.cause, `next attempt in ${Math.max(Math.ceil((live.retryAt - now) / 1000), 0)} s`);
  else if (live.cause && !isOver) parts.push(live.cause);
  if (live.trouble) parts.push(live.trouble);
  const pending = live.pending.text(now);
  if (pending) parts.push(pending);
  if (live.steering?.paused) parts.push("the simulation is paused");
  if (shown) {
    if (live.series && live.wanted !== null) parts.push(`frame ${shown.frame + 1} of ${live.series.steps.length}`);
    if (shown.step !== null) parts.push(`step ${shown.step}`);
    if (shown.time !== null) parts.push(`t = ${Number(shown.time.toPrecision(10))}`);
    if (!isSeries && live.wanted === null) parts.push(ageText((now - shown.madeAt) / 1000));
    if (shown.levels > 1) parts.push(shown.level + 1 < shown.levels ? `level ${shown.level + 1} of ${shown.levels}` : "full");
  }
  const {level, received} = live.assembler;
  if (isOn && level && (!shown || (live.wanted ?? shown.frame) !== shown.frame)) parts.push(arrivedText(received, level.bytes));
  if (isOn && shown) parts.push(`${(live.rate() / 1048576).toFixed(1)} MiB/s`);
  if (isOn && shown && shown.dropped > 0 && !isSeries) parts.push(`${shown.dropped} dropped`);
  return parts.join(" · ");
}

/** @param {string} id */
const byId = (id) => /** @type {HTMLElement} */ (document.getElementById(id));

export class LivePanel {
  /** @param {string} token @param {Decoder} decoder @param {LiveView} view */
  constructor(token, decoder, view) {
    this.view = view;
    const url = new URL("stream", location.href);
    url.hash = url.search = "";
    const plain = new URL(url);
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    /** @type {(() => void)[]} called at each change of `live` */
    this.listeners = [];
    this.live = new Live({
      token,
      open: () => new WebSocket(url, SUBPROTOCOL),
      reason: () => reasonOf(plain, location.origin),
      decode: (file) => decoder.decode({file}),
      onLevel: (vdi, level) => view.show(vdi, level),
      onChange: () => this.onChange(),
    });
    this.hadSeries = false;
    this.said = "";
    window.addEventListener("online", () => this.hurry());
    document.addEventListener("visibilitychange", () => this.hurry());
    setInterval(() => this.refresh(), REFRESH_MS);
  }

  /** @param {number | undefined} index of the series' first frame to show; undefined: the newest */
  start(index) {
    this.live.wanted = index ?? null;
    byId("live").hidden = byId("pause").hidden = false;
    this.live.restart();
  }

  /** @param {string} token */
  restart(token) {
    this.live.restart(token);
  }

  close() {
    this.live.close();
  }

  /** Reconnects at once when an attempt may succeed now. */
  hurry() {
    if (this.live.state === "lost" && document.visibilityState === "visible") this.live.connect();
  }

  /** The button's label. */
  label() {
    const {live} = this;
    if (["closed", "refused", "lost"].includes(live.state)) return "Connect";
    return live.isPaused ? "Resume" : live.wanted !== null ? "Newest" : "Pause";
  }

  /** Handles a press of the button. */
  toggle() {
    const {live} = this;
    const label = this.label();
    if (label === "Connect") live.restart();
    else if (label === "Pause") live.pause();
    else live.follow();
  }

  /** Number of frames to choose from. */
  count() {
    return this.live.state === "closed" ? 0 : this.live.series?.steps.length ?? 0;
  }

  /** The series' frame that the user wants: the newest unless they chose another. */
  index() {
    return this.live.wanted ?? Math.max(this.count() - 1, 0);
  }

  /** Whether the user chose a frame. */
  isChosen() {
    return this.live.wanted !== null;
  }

  /**
   * Shows a frame of a series.
   * @param {number} index
   * @returns {Promise<Outcome>}
   */
  show(index) {
    const {live} = this;
    const isOnShow = () => live.shown?.frame === index;
    const isFull = () => live.shown?.frame === index && live.shown.level + 1 === live.shown.levels;
    live.show(index);
    if (isFull()) return Promise.resolve("shown");
    return new Promise((resolve) => {
      /** @type {ReturnType<typeof setTimeout> | undefined} */
      let patience;
      const end = (/** @type {Outcome} */ outcome) => {
        clearTimeout(patience);
        this.listeners = this.listeners.filter((one) => one !== listener);
        resolve(outcome);
      };
      const listener = () => {
        if (live.wanted !== index || (live.state !== "live" && live.state !== "ended")) end("failed");
        else if (isFull()) end("shown");
        else if (live.missed === index) end(isOnShow() ? "shown" : "missed");
        else if (isOnShow()) patience ??= setTimeout(() => end("shown"), PATIENCE_MS);
      };
      this.listeners.push(listener);
    });
  }

  onChange() {
    for (const listener of [...this.listeners]) listener();
    const hasSeries = this.count() > 0;
    if (hasSeries || this.hadSeries) this.view.onSeries(this.index());
    this.hadSeries = hasSeries;
    this.view.onChange();
    this.refresh();
  }

  /** @param {string} message shown over the picture; empty removes only this panel's own message */
  say(message) {
    if (message !== this.said) this.view.tell(message);
    this.said = message;
  }

  refresh() {
    const {live} = this;
    const {state} = live;
    const text = liveText(live, performance.now());
    // A final failure covers the picture with its message. Attempts to reconnect leave it visible.
    this.say(state === "refused" ? live.cause : live.shown || state === "closed" ? "" : text);
    byId("live").dataset.state = live.isPaused && state === "live" ? "paused" : isGone(live) ? "ended" : state;
    byId("livetext").textContent = text;
    byId("pause").textContent = this.label();
    byId("pause").hidden = state === "ended" && !live.isPaused;
  }
}
