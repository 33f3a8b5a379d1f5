// A connection to a server. It shows the newest frame with which network and machine can keep up,
// and reconnects after a failure. docs/live.md has the protocol.

import {LevelAssembler, STREAM_VERSION, StreamError, extendedSeries, serverMessageOf} from "./messages.js";
import {PendingRequests} from "./pending.js";

/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */
/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./messages.js").Level} Level */
/** @typedef {import("./messages.js").Series} Series */
/** @typedef {import("./messages.js").Steering} Steering */
/** @typedef {import("./reach.js").Reason} Reason */
/** @typedef {import("./messages.js").Wish} Wish */
/** @typedef {import("./messages.js").Welcome} Welcome */

/**
 * The members of WebSocket that Live uses.
 * @typedef {Pick<WebSocket, "binaryType" | "readyState" | "send" | "close" |
 *                          "onopen" | "onmessage" | "onclose">} Socket
 */

/**
 * A received level, the time at which its frame was made, in milliseconds of the page's clock, and
 * the server's session.
 * @typedef {Level & {madeAt: number, session: string}} Arrived
 */

/**
 * A level that will be shown. `done` acknowledges its end, unless that has been done.
 * @typedef {{level: Arrived, load: () => Promise<PreparedVdi>, done?: () => void}} Pending
 */

/**
 * "connecting": the server hasn't answered yet; "waiting": the simulation has made no frame yet;
 * "live": frames arrive; "ended": the simulation has ended; "lost": the page will reconnect;
 * "refused": it won't until `restart`; "closed": the user has closed the connection.
 * @typedef {"connecting" | "waiting" | "live" | "ended" | "lost" | "refused" | "closed"} LiveState
 */

/**
 * @typedef {object} LiveOptions
 * @property {() => Socket} open
 * @property {() => Promise<Reason>} [reason] why the last connection didn't open
 * @property {string} token
 * @property {(file: Uint8Array) => Promise<PreparedVdi>} decode
 * @property {(vdi: PreparedVdi, level: Arrived) => Promise<boolean> | boolean} onLevel shows a level,
 *     unless isHeldBack(level) by then; returns whether it did
 * @property {() => void} onChange called when state, cause, series, viewers, steering, `shown`,
 *     `wanted` or `missed` change
 */

const ACK_BYTES = 512 << 10;
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 10000;
const ANSWER_MS = 10000;       // time for a server to answer
const RATE_MS = 4000;          // the rate is a mean over this time
const SILENT_PULSES = 3;       // a server that misses this many counts as lost
const GRACE_MS = 1000;         // after sleep, a page may run timers before it gets messages that have arrived
const WRONG_TOKEN = 4401;
const OTHER_VERSION = 4409;

/** @param {number} now @param {{at: number, bytes: number}[]} arrivals @returns {number} bytes per second */
export function rateOf(now, arrivals) {
  const some = arrivals.filter(({at}) => now - at < RATE_MS);
  if (some.length === 0) return 0;
  const since = Math.max(Math.min(now - some[0].at, RATE_MS), RATE_MS / 4);
  return 1000 * some.reduce((sum, {bytes}) => sum + bytes, 0) / since;
}

export class Live {
  /** @param {LiveOptions} options */
  constructor(options) {
    this.options = options;
    /** @type {LiveState} */
    this.state = "connecting";
    /** The reason for being lost or refused, in one line. */
    this.cause = "";
    /** The reason why the connected server gets no frames: perhaps a relay has lost its source. */
    this.trouble = "";
    /** Whether this connection's server has been live. A finished series never is. */
    this.hasBeenLive = false;
    /** Whether the run has ended. This stays true while the page looks for another run. */
    this.hasEnded = false;
    this.isPaused = false;
    /** Whether this connection's server has been told of the pause. */
    this.isServerPaused = false;
    /** @type {Series | null} */
    this.series = null;
    /** @type {number | null} the frame of the series that the user wants; null: the newest */
    this.wanted = null;
    /** @type {number | null} the wanted frame, if it can't be shown */
    this.missed = null;
    this.viewers = 0;
    /** @type {Steering | null} null: the server has sent none */
    this.steering = null;
    /** This viewer's requests that the simulation hasn't taken yet. */
    this.pending = new PendingRequests();
    /** The reason why the server rejected this viewer's last wish; empty if it didn't. */
    this.denied = "";
    /** @type {Arrived | undefined} the level on show; during a pause it may be a former session's */
    this.shown = undefined;
    /** @type {Camera | undefined} of the VDI on show */
    this.camera = undefined;
    this.session = "";
    /** @type {Socket | undefined} */
    this.socket = undefined;
    this.assembler = new LevelAssembler();
    /** Acknowledged bytes of the level under way. Acknowledging an earlier level's end doesn't change them. */
    this.acknowledged = 0;
    this.madeAt = 0;
    /** @type {{at: number, bytes: number}[]} */
    this.arrivals = [];
    /** @type {Pending | undefined} the newest level that waits for the decoder */
    this.waiting = undefined;
    /**
     * The newest level that a pause, or the choice of another frame, has kept off the screen. The
     * server won't send it again.
     * @type {Pending | undefined}
     */
    this.heldBack = undefined;
    this.isDecoding = false;
    this.failures = 0;
    this.retryAt = 0;
    /** The longest silence of a connected server, in milliseconds; 0: the server promises nothing. */
    this.patience = 0;
    this.heardAt = 0;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /**
   * Connects or reconnects.
   * @param {string} [token] replaces the former one
   */
  restart(token) {
    if (token !== undefined) this.options.token = token;
    this.failures = 0;
    this.connect();
  }

  /** Closes the connection. The last frame stays. */
  close() {
    this.hangUp();
    this.change("closed", "");
  }

  hangUp() {
    clearTimeout(this.timer);
    const socket = this.socket;
    this.socket = undefined;
    this.assembler.drop();
    this.waiting = this.heldBack = undefined;
    this.isServerPaused = false;
    this.trouble = "";
    this.steering = null;
    this.denied = "";
    this.pending.clear();
    socket?.close();
  }

  connect() {
    this.hangUp();
    this.change("connecting", this.cause);
    /** @type {Socket} */
    let socket;
    try {
      socket = this.options.open();
    } catch (error) {  // the browser forbids the URL
      this.refuse(error instanceof Error ? error.message : String(error));
      return;
    }
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    const has = this.shown?.session === this.session && this.isFull();
    let isOpen = false;
    socket.onopen = () => {
      isOpen = true;
      this.send({type: "hello", version: STREAM_VERSION, token: this.options.token,
                 session: this.session || null, have: has ? this.shown?.frame : null});
    };
    socket.onmessage = ({data}) => {
      if (socket === this.socket) this.receive(data);
    };
    socket.onclose = ({code}) => {
      if (socket !== this.socket) return;
      this.onClose(code);
      if (!isOpen && this.state === "lost") this.askForReason();
    };
    this.timer = setTimeout(() => this.lose("the server doesn't answer"), ANSWER_MS);
  }

  /** @param {object} message */
  send(message) {
    if (this.socket?.readyState === 1) this.socket.send(JSON.stringify(message));
  }

  /** @param {LiveState} state @param {string} cause */
  change(state, cause) {
    this.state = state;
    this.cause = cause;
    this.options.onChange();
  }

  /** @param {number} code with which the WebSocket closed */
  onClose(code) {
    if (code === WRONG_TOKEN) this.refuse("the server rejects the token in this link; use the link that it printed last");
    else if (code === OTHER_VERSION) this.refuse(this.cause || "the server uses another protocol version; reload this page");
    else this.lose(this.cause || "the server doesn't answer");
  }

  /** Asks why the connection didn't open, unless the next attempt begins before the answer comes. */
  async askForReason() {
    const {failures} = this;
    const reason = await this.options.reason?.();
    if (!reason || this.state !== "lost" || failures !== this.failures) return;
    if (reason.isFinal) this.refuse(reason.cause);
    else this.change("lost", reason.cause || "the server doesn't answer");
  }

  /** @param {string} cause one that another attempt won't remove */
  refuse(cause) {
    this.hangUp();
    this.change("refused", cause);
  }

  /**
   * Reconnects after a pause, which grows with each attempt.
   * @param {string} cause
   */
  lose(cause) {
    this.hangUp();
    const longest = Math.min(FIRST_WAIT_MS * 2 ** this.failures, LONGEST_WAIT_MS);
    const wait = longest * (0.75 + 0.25 * Math.random());  // spreads out viewers that lost the server together
    ++this.failures;
    this.retryAt = performance.now() + wait;
    this.timer = setTimeout(() => this.connect(), wait);
    this.change("lost", cause);
  }

  /**
   * Notices a server that is silent for too long. No event reports a connection that breaks
   * silently, as when a laptop sleeps or a tunnel hangs.
   * @param {boolean} [isLast] whether this is the second look, after messages had time to come in
   */
  watch(isLast = false) {
    const silence = performance.now() - this.heardAt;
    if (silence < this.patience) this.timer = setTimeout(() => this.watch(), this.patience - silence);
    else if (isLast) this.lose("the server doesn't answer");
    else this.timer = setTimeout(() => this.watch(true), Math.min(GRACE_MS, this.patience));
  }

  /** @param {string | ArrayBuffer} data */
  receive(data) {
    this.heardAt = performance.now();
    try {
      if (typeof data === "string") this.takeText(data);
      else this.takePart(data);
    } catch (error) {
      if (!(error instanceof StreamError)) throw error;
      this.lose(error.message);
    }
  }

  /** @param {string} text */
  takeText(text) {
    const message = serverMessageOf(text);
    if (message.type === "error") {
      this.cause = message.cause;
    } else if (message.type === "welcome") {
      this.takeWelcome(message);
    } else if (message.type === "series") {
      const before = this.series?.steps.length ?? 0;
      this.series = extendedSeries(this.series, message);
      if (this.wanted !== null && this.wanted >= before) this.askForWanted();
      this.change(this.state, this.cause);
    } else if (message.type === "state") {
      this.viewers = message.viewers;
      this.trouble = message.cause;
      if (message.state !== "ended") this.hasBeenLive = true;
      this.hasEnded = message.state === "ended" && this.hasBeenLive;
      this.change(message.state, "");
    } else if (message.type === "steering") {
      this.steering = message;
      this.settle();
      this.change(this.state, this.cause);
    } else if (message.type === "denied") {
      this.denied = message.cause;
      this.pending.refuse();
      this.change(this.state, this.cause);
    } else if (message.type === "missing") {
      if (message.frame === this.wanted) this.miss(message.frame, `frame ${message.frame + 1}: ${message.cause}`);
    } else if (message.type === "level") {
      const {type: _, ...level} = message;
      this.madeAt = performance.now() - 1000 * level.age;
      this.acknowledged = 0;
      this.assembler.begin(level);
      this.pauseServer();
    }
  }

  /** @param {Welcome} welcome */
  takeWelcome(welcome) {
    clearTimeout(this.timer);
    if (welcome.version !== STREAM_VERSION) {
      this.refuse(`the server uses protocol version ${welcome.version}, ` +
                  `but this page uses version ${STREAM_VERSION}; reload it`);
      return;
    }
    // Another run numbers its own frames.
    if (welcome.session !== this.session && !this.isPaused) this.shown = undefined;
    this.session = welcome.session;
    this.isServerPaused = false;
    this.series = welcome.series;
    this.viewers = welcome.viewers;
    this.hasBeenLive = this.hasEnded = false;
    this.change("waiting", "");
    this.askForWanted();
    this.pauseServer();
    this.patience = 1000 * SILENT_PULSES * welcome.pulse;
    if (this.patience > 0) this.watch();
  }

  askForWanted() {
    const known = this.series?.steps.length ?? 0;
    this.missed = null;
    if (this.wanted !== null && this.wanted < known) this.send({type: "show", index: this.wanted});
  }

  /** @param {number} frame a frame that can't be shown @param {string} cause */
  miss(frame, cause) {
    if (frame === this.wanted) this.missed = frame;
    const {heldBack} = this;
    if (heldBack && !this.shown) {  // better than nothing
      this.heldBack = undefined;
      this.enqueue(heldBack);
    }
    this.change(this.state, cause);
  }

  /** @param {ArrayBuffer} part */
  takePart(part) {
    const {assembler} = this;
    const level = assembler.level;
    const file = assembler.add(part);
    this.arrivals = [...this.arrivals.filter(({at}) => performance.now() - at < RATE_MS),
                     {at: performance.now(), bytes: part.byteLength}];
    if (!level) return;
    if ((this.state === "waiting" && this.trouble === "") || this.state === "connecting") this.change("live", "");
    const acknowledge = (/** @type {number} */ bytes) =>
      this.send({type: "ack", frame: level.frame, level: level.level, bytes});
    if (!file) {
      if (assembler.received - this.acknowledged < ACK_BYTES) return;
      this.acknowledged = assembler.received;
      acknowledge(this.acknowledged);
      return;
    }
    const arrived = {...level, madeAt: this.madeAt, session: this.session};
    const load = () => this.options.decode(file);
    if (level.frame === this.wanted) this.heldBack = undefined;  // the server will send the newest one again
    if (this.isUnwanted(level.frame) || this.isHeldBack(arrived)) {
      acknowledge(level.bytes);
      this.heldBack = {level: arrived, load};
      return;
    }
    // The page acknowledges a level's end when the decoder takes the level. A slow machine
    // therefore gets no more than it can show.
    const socket = this.socket;
    const done = () => {
      if (socket === this.socket) acknowledge(level.bytes);
    };
    this.enqueue({level: arrived, load, done});
  }

  /**
   * Whether the user has chosen another frame, which the server has. A server sends the newest one
   * first.
   * @param {number} frame
   */
  isUnwanted(frame) {
    const {wanted} = this;
    const isThere = wanted !== null && wanted < (this.series?.steps.length ?? 0);
    return isThere && this.missed !== wanted && frame !== wanted;
  }

  /**
   * Hands a level to the decoder, and drops one that waits for it.
   * @param {Pending} pending
   */
  enqueue(pending) {
    this.waiting?.done?.();
    this.waiting = pending;
    if (!this.isDecoding) this.showWaiting();
  }

  async showWaiting() {
    this.isDecoding = true;
    while (this.waiting) {
      const {level, load, done} = this.waiting;
      const {socket} = this;  // the connection that the level came by; a new connection starts without waiting levels
      this.waiting = undefined;
      done?.();
      if (this.holdBack(level, load)) continue;
      try {
        const vdi = await load();
        if (this.state === "closed" || level.session !== this.session) continue;
        const again = async () => vdi;
        if (this.holdBack(level, again)) continue;
        if (!await this.options.onLevel(vdi, level)) {
          this.holdBack(level, again);  // the pause began during the upload
          continue;
        }
        this.shown = level;
        this.camera = vdi.camera;
        this.settle();
        if (socket !== this.socket) {  // the cause of the loss stays
          this.options.onChange();
          continue;
        }
        this.failures = 0;
        this.pauseServer();
        this.change(this.state, "");
      } catch (error) {  // only this level is lost
        if (socket !== this.socket) continue;
        const cause = error instanceof Error ? error.message : String(error);
        if (level.level + 1 === level.levels) this.miss(level.frame, cause);
        else this.change(this.state, cause);
      }
    }
    this.isDecoding = false;
  }

  /** Whether the level on show is its frame's finest. */
  isFull() {
    return this.shown !== undefined && this.shown.level + 1 === this.shown.levels;
  }

  /**
   * Whether a pause keeps a level of this session off the screen: another frame is on show.
   * @param {Level} level
   */
  isHeldBack(level) {
    const {shown} = this;
    return this.isPaused && shown !== undefined && (shown.frame !== level.frame || shown.session !== this.session);
  }

  /**
   * Puts a level aside for the end of the pause, unless a newer one waits already.
   * @param {Arrived} level
   * @param {() => Promise<PreparedVdi>} load
   * @returns {boolean} whether the pause keeps the level off the screen
   */
  holdBack(level, load) {
    if (!this.isHeldBack(level)) return false;
    if (level.session === this.session) this.heldBack ??= {level, load};
    return true;
  }

  /** Stops the server during a pause, once it can send nothing more that the page would show. */
  pauseServer() {
    const next = this.assembler.level;
    const isEnough = this.isFull() || (next !== undefined && this.isHeldBack(next));
    if (!this.isPaused || this.isServerPaused || !isEnough) return;
    this.isServerPaused = true;
    this.send({type: "pause"});
  }

  /** Keeps the frame on show, and lets it become full. */
  pause() {
    this.isPaused = true;
    this.pauseServer();
    this.options.onChange();
  }

  /** Shows what the pause has held back, if the user wants that frame. */
  endPause() {
    const {heldBack} = this;
    this.isPaused = this.isServerPaused = false;
    this.heldBack = undefined;
    if (this.shown?.session !== this.session) this.shown = undefined;
    if (heldBack && (this.wanted === null || this.wanted === heldBack.level.frame)) this.enqueue(heldBack);
  }

  /** Follows the newest frames. */
  follow() {
    this.wanted = null;
    this.endPause();
    this.send({type: "resume"});
    this.options.onChange();
  }

  /**
   * Shows a frame of the series and stays there.
   * @param {number} index
   */
  show(index) {
    if (this.isServerPaused) this.send({type: "resume"});
    this.wanted = index;
    this.endPause();
    this.askForWanted();
    this.options.onChange();
  }

  /** Requests control of the simulation. */
  drive() {
    this.denied = "";
    this.send({type: "drive"});
  }

  /** Gives control back. */
  release() {
    this.denied = "";
    this.send({type: "release"});
  }

  /** @param {Wish} wish */
  steer(wish) {
    this.denied = "";
    this.pending.add(wish, performance.now());
    this.settle();
    this.send({type: "steer", ...wish});
    this.options.onChange();
  }

  /** Forgets the requests that have been met. */
  settle() {
    const {steering, pending} = this;
    if (steering === null || steering.driver !== steering.you) pending.clear();
    else pending.settle(steering, this.camera);
  }

  /** @returns {number} bytes per second over the last few seconds */
  rate() {
    return rateOf(performance.now(), this.arrivals);
  }
}
