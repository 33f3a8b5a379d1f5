// Schedules drawing. While the view moves, a picture has as many pixels as the frame rate allows.
// At rest the whole picture is drawn in strips, so that a new motion never waits for it. A VDI that
// replaces another at rest is drawn in strips, too, and with as many pixels as its time on show
// allows. The former VDI's picture stays meanwhile.

import {cameraText} from "./camera.js";
import {politely} from "./decoder.js";
import {pictureOf} from "./picture.js";
import {Renderer} from "./renderer.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */
/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {import("./renderer.js").ClipPlane} ClipPlane */
/** @typedef {import("./renderer.js").Color} Color */
/** @typedef {import("./renderer.js").Frame} Frame */
/** @typedef {import("./slopes.js").Leaning} Leaning */

const FRAME_MS = 33;       // time for a picture in motion
const STRIP_MS = 40;       // time for a strip of a picture at rest
const REST_MS = 150;       // the view rests after this time without motion
const LEAN_MS = 300;       // a VDI on show for this time is worth a sheared picture
const LATE_MS = 400;       // at rest, a VDI waits for this time at most until its picture replaces the former one
const PACE_SHARE = 0.6;    // share of a VDI's time on show in which its first picture at rest is drawn
const LARGEST_SCALE = 8;
const RECOVERY_MS = 1000;  // a driver that can recover needs less

export class Viewer {
  /**
   * Throws Error without WebGL2.
   * @param {HTMLCanvasElement} canvas
   * @param {(message: string) => void} tell
   * @param {(vdi: PreparedVdi) => Promise<Leaning | undefined>} lean Decoder.lean
   */
  constructor(canvas, tell, lean) {
    this.renderer = new Renderer(canvas);
    this.canvas = canvas;
    this.tell = tell;
    this.lean = lean;
    this.shownAt = -Infinity;
    this.isLeaning = false;
    /** VDIs without sheared pictures, because the browser has too little memory for these. */
    this.unleanable = new WeakSet();
    /** @type {Camera | undefined} */
    this.camera = undefined;
    /** @type {Color} */
    this.background = [0, 0, 0];
    /** @type {Color} */
    this.outlineColor = [0.5, 0.5, 0.5];
    this.outline = true;
    this.isLost = false;
    /** @type {(bounds: [Vec3, Vec3]) => ClipPlane[]} */
    this.planesFor = () => [];
    /** Measured milliseconds per canvas pixel. */
    this.cost = 1e-4;
    this.movedAt = -Infinity;
    /**
     * The missing part of the picture: everything, or detail.
     * @type {"all" | "detail" | "nothing"}
     */
    this.missing = "nothing";
    this.nextRow = 0;
    /** Canvas pixels per pixel of the strips, each way. */
    this.detailScale = 1;
    /**
     * The time since which the picture on show is a former VDI's. It is undefined while the picture
     * is the present VDI's.
     * @type {number | undefined}
     */
    this.outdatedAt = undefined;
    /** Milliseconds for which the former VDI, and the one before, were on show. */
    this.stays = [Infinity, Infinity];
    /** @type {{sync: WebGLSync, since: number, pixels: number} | undefined} */
    this.pending = undefined;
    this.isScheduled = false;
    /**
     * Called once the camera has rested for REST_MS: after each motion, after a jump, and for each
     * VDI that comes at rest. Pictures may be incomplete.
     */
    this.onRest = () => {};
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.restTimer = undefined;
    /**
     * Gives the part of the canvas in which the camera's extent is framed, in CSS pixels from its
     * lower left corner; undefined: the whole canvas.
     * @type {() => Frame | undefined}
     */
    this.frameOf = () => undefined;
    this.lostAt = 0;
    this.watchDriver();
  }

  /**
   * Tells users when the graphics driver loses the picture, and draws it again when the driver
   * recovers. A browser also takes the context of a page from it when others open too many, and may
   * never give it back; see takeContext.
   */
  watchDriver() {
    const {canvas} = this;
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      if (canvas !== this.canvas) return;
      this.isLost = true;
      this.lostAt = performance.now();
      this.pending = undefined;
      this.tellLost();
    });
    canvas.addEventListener("webglcontextrestored", () => {
      if (canvas === this.canvas) this.recover(() => this.renderer.restore());
    });
  }

  tellLost() {
    this.tell("The graphics driver has lost the picture. It will return when the driver recovers, or with a click.");
  }

  /** @param {() => void} restore makes the renderer draw again; may throw */
  recover(restore) {
    try {
      restore();
      this.isLost = false;
      this.tell("");
    } catch (error) {
      this.tell(/** @type {Error} */ (error).message);
    }
    this.redraw();
  }

  /** Replaces a context that was lost for a while by one of a new canvas. Call it when the user turns to the page. */
  takeContext() {
    if (!this.isLost || performance.now() - this.lostAt < RECOVERY_MS) return;
    this.lostAt = performance.now();
    this.recover(() => {
      const canvas = document.createElement("canvas");
      this.renderer.moveTo(canvas);
      this.canvas.replaceWith(canvas);
      this.canvas = canvas;
      this.watchDriver();
    });
  }

  /**
   * Shows a VDI. Throws Error if the GPU can't hold it.
   * @param {PreparedVdi} vdi
   * @param {() => boolean} isWanted called after the upload; false drops the VDI
   * @returns {Promise<boolean>} whether the VDI replaced the former one
   */
  async setVdi(vdi, isWanted) {
    const isShown = await this.renderer.setVdi(vdi, politely(), isWanted);
    if (isShown) {
      const now = performance.now();
      this.stays = [now - this.shownAt, this.stays[0]];
      this.shownAt = now;
      this.setPlanes();
      this.renew();
      this.awaitRest();
    }
    return isShown;
  }

  /** Draws the picture of a new VDI. At rest, the former picture stays until the new one is detailed. */
  renew() {
    const now = performance.now();
    this.outdatedAt ??= now;
    if (!this.isResting() || this.missing === "all" || now - this.outdatedAt > LATE_MS) return this.redraw();
    [this.missing, this.nextRow] = ["detail", 0];
    this.schedule();
  }

  /** @param {boolean} smooth */
  setSmooth(smooth) {
    this.renderer.smooth = smooth;
    this.redraw();
  }

  /** @param {Camera} camera @param {boolean} [moving] whether further cameras will follow */
  setCamera(camera, moving = true) {
    const isSame = !moving && this.camera !== undefined && cameraText(camera) === cameraText(this.camera);
    this.camera = camera;
    if (moving) this.movedAt = performance.now();
    this.awaitRest();
    if (!isSame) this.redraw();
  }

  /** Whether the camera has rested for REST_MS, or has jumped. */
  isResting() {
    return performance.now() - this.movedAt >= REST_MS;
  }

  /** Redraws the picture. */
  redraw() {
    this.missing = "all";
    this.schedule();
  }

  /** Redraws background and outline around the same picture. */
  refresh() {
    if (!this.camera || this.isLost) return;
    this.renderer.present(this.camera, this.background, this.outline ? this.outlineColor : undefined);
  }

  schedule() {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame(() => {
      this.isScheduled = false;
      this.step();
    });
  }

  /**
   * Gives the canvas the screen's number of pixels, or as many as the GPU allows, and frames the
   * picture anew. The browser stretches a smaller canvas.
   * @returns {boolean} whether the number or the frame changed
   */
  fitCanvas() {
    const {clientWidth, clientHeight} = this.canvas;
    const [mostWidth, mostHeight] = this.renderer.most;
    const ratio = Math.min(window.devicePixelRatio || 1, 2, mostWidth / Math.max(clientWidth, 1), mostHeight / Math.max(clientHeight, 1));
    const width = Math.max(1, Math.round(clientWidth * ratio));
    const height = Math.max(1, Math.round(clientHeight * ratio));
    const wanted = this.frameOf();
    const frame = wanted && {x: wanted.x * ratio, y: wanted.y * ratio, width: wanted.width * ratio, height: wanted.height * ratio};
    const isSame = JSON.stringify(frame) === JSON.stringify(this.renderer.framing);
    this.renderer.framing = frame;
    if (this.canvas.width === width && this.canvas.height === height) return !isSame;
    this.canvas.width = width;
    this.canvas.height = height;
    return true;
  }

  /** Whether the GPU is still drawing the last picture or strip. Measures its time when it ends. */
  isBusy() {
    const {gl} = this.renderer;
    if (!this.pending) return false;
    const state = gl.clientWaitSync(this.pending.sync, 0, 0);
    if (state === gl.TIMEOUT_EXPIRED) return true;
    const took = performance.now() - this.pending.since;
    const cost = took / Math.max(this.pending.pixels, 1);
    this.cost = cost > this.cost ? cost : 0.7 * this.cost + 0.3 * cost;
    gl.deleteSync(this.pending.sync);
    this.pending = undefined;
    return false;
  }

  /** @param {number} pixels number of pixels just drawn */
  watch(pixels) {
    const {gl} = this.renderer;
    const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    if (sync) this.pending = {sync, since: performance.now(), pixels};
  }

  step() {
    if (this.isLost || !this.camera) return;
    if (this.isBusy()) {
      setTimeout(() => this.schedule(), 2);
      return;
    }
    if (this.fitCanvas()) this.missing = "all";
    const isResting = this.isResting();
    if (this.missing === "all") this.drawWhole(isResting);
    else if (this.missing === "detail" && isResting) this.drawStrip();
    else if (this.awaitsLeaning()) void this.askLeaning(isResting);
    else if (this.missing === "nothing") return;
    this.schedule();
  }

  /** Whether a sheared picture will replace the present one. */
  awaitsLeaning() {
    const {loaded, smooth} = this.renderer;
    return smooth && loaded !== undefined && !this.renderer.canShear() && !this.unleanable.has(loaded.vdi);
  }

  /** @param {boolean} isResting */
  async askLeaning(isResting) {
    const {renderer} = this;
    const vdi = renderer.loaded?.vdi;
    if (!vdi || this.isLeaning || !isResting || performance.now() - this.shownAt < LEAN_MS) return;
    this.isLeaning = true;
    try {
      vdi.leaning ??= await this.lean(vdi);
      if (renderer.loaded?.vdi === vdi) await renderer.setLeaning(politely());
      // Begins at the first row, even if a smooth picture is drawn in part.
      if (renderer.canShear() && this.missing !== "all") [this.missing, this.nextRow] = ["detail", 0];
    } catch (error) {
      console.warn("the picture stays smooth rather than sheared:", error);
      this.unleanable.add(vdi);
    }
    this.isLeaning = false;
    this.schedule();
  }

  /** @param {boolean} isResting */
  drawWhole(isResting) {
    const {renderer} = this;
    if (!this.camera) return;
    const scale = this.scaleFor(FRAME_MS);
    const {width, height} = renderer.pictureSize(scale);
    const sheared = isResting && scale === 1 && renderer.canShear();
    renderer.drawPicture(this.camera, scale, 0, height, sheared);
    renderer.finishPicture();
    this.refresh();
    this.watch(width * height);
    this.nextRow = 0;
    this.outdatedAt = undefined;
    this.missing = scale > 1 || (renderer.canShear() && !sheared) ? "detail" : "nothing";
  }

  /** Schedules onRest for when the camera has rested. Further calls until then change nothing. */
  awaitRest() {
    clearTimeout(this.restTimer);
    this.restTimer = setTimeout(() => this.onRest(), Math.max(REST_MS - (performance.now() - this.movedAt), 0));
  }

  /**
   * The finest scale at which a whole picture takes this time or less.
   * @param {number} milliseconds
   */
  scaleFor(milliseconds) {
    const all = this.canvas.width * this.canvas.height * this.cost;
    return all <= milliseconds ? 1 : Math.min(Math.ceil(Math.sqrt(all / milliseconds) * 4) / 4, LARGEST_SCALE);
  }

  /**
   * The scale of strips that begin now. A VDI that has no picture yet gets one that is complete
   * before the next VDI comes. Levels of a frame come in quick succession, so the longer of the two
   * times counts.
   */
  stripScale() {
    if (this.outdatedAt === undefined) return 1;
    return this.scaleFor(Math.max(Math.min(PACE_SHARE * Math.max(...this.stays), LATE_MS), FRAME_MS));
  }

  drawStrip() {
    const {renderer} = this;
    if (!this.camera) return;
    if (this.nextRow === 0) this.detailScale = this.stripScale();
    const {width, height} = renderer.pictureSize(this.detailScale);
    const most = Math.max(8, Math.floor(STRIP_MS / (this.cost * width)));
    const left = height - this.nextRow;
    const rows = Math.ceil(left / Math.ceil(left / most));  // equal strips: a small one would seem slow for its size
    const end = this.nextRow + rows;
    renderer.drawPicture(this.camera, this.detailScale, this.nextRow, end, renderer.canShear());
    this.watch(width * (end - this.nextRow));
    this.nextRow = end;
    if (end < height) return;
    renderer.finishPicture();
    this.refresh();
    this.nextRow = 0;
    this.outdatedAt = undefined;
    if (this.detailScale === 1) this.missing = "nothing";
  }

  /** Whether the picture on show is whole. */
  isWhole() {
    if (this.fitCanvas()) this.redraw();
    return !this.isLost && this.missing === "nothing" && !this.pending;
  }

  /** Whether the picture on show is whole, and no sheared one will replace it. */
  isFinal() {
    return this.isWhole() && !this.awaitsLeaning();
  }

  /**
   * Clips the scene, now and when another VDI comes.
   * @param {(bounds: [Vec3, Vec3]) => ClipPlane[]} planesFor the planes for a scene
   */
  clip(planesFor) {
    this.planesFor = planesFor;
    this.setPlanes();
    this.redraw();
  }

  setPlanes() {
    const vdi = this.renderer.loaded?.vdi;
    this.renderer.clipPlanes = vdi && vdi.bounds[0].every((low, axis) => low <= vdi.bounds[1][axis]) ? this.planesFor(vdi.bounds) : [];
  }

  /**
   * The picture as PNG; see pictureOf.
   * @param {[number, number]} [size]
   * @param {boolean} [isTransparent]
   */
  screenshot(size, isTransparent) {
    return pictureOf(this, size, isTransparent);
  }

  /**
   * Call when a whole picture has been drawn.
   * @param {boolean} isOther whether it had another size
   */
  onPicture(isOther) {
    // Otherwise strips would go on in the former picture, without redrawing its first rows.
    this.nextRow = 0;
    this.outdatedAt = undefined;
    this.missing = isOther ? "all" : "nothing";
  }
}
