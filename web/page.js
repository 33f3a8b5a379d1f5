// The page. It connects viewer, controls and sources of frames.

import {drawAxes} from "./axes.js";
import {basisOf, between, cameraOfText, cameraText, centerOf, degreesBetween, halfHeightOf, toView} from "./camera.js";
import {addControls} from "./controls.js";
import {Decoder, serveDecoding} from "./decoder.js";
import {mostElements} from "./gl.js";
import {rangeText, showLegend} from "./legend.js";
import {LivePanel, takeToken} from "./livepanel.js";
import {addPanels} from "./panels.js";
import {cornerOf} from "./renderer.js";
import {SteerPanel} from "./steerpanel.js";
import {embeddedSource, filesSource} from "./sources.js";
import {length, minus} from "./vector.js";
import {addTools} from "./tools.js";
import {Viewer} from "./viewer.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */
/** @typedef {import("./live.js").Arrived} Arrived */
/** @typedef {import("./livepanel.js").Outcome} Outcome */
/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {import("./renderer.js").Color} Color */
/** @typedef {import("./sources.js").Source} Source */

/** @param {string} id */
const element = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @param {string} id */
const input = (id) => /** @type {HTMLInputElement} */ (document.getElementById(id));

/**
 * Shows the user one line; an empty one hides the message.
 * @param {string} message
 */
function tell(message) {
  element("message").textContent = message;
  element("message").hidden = message === "";
}

/** @param {unknown} error */
function messageOf(error) {
  return error instanceof Error ? error.message : String(error);
}

/** @param {string} hex the value of a colour input @returns {Color} */
function colorOf(hex) {
  const n = parseInt(hex.slice(1), 16);
  return [(n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}

const MOTION_MS = 350;
const NOTICE_MS = 5000;   // time for which the message that a file can't be opened covers a server's frames

/** The settings in the URL's fragment. */
function fragment() {
  return new URLSearchParams(location.hash.slice(1));
}

/** Panels that a picture is framed beside. */
const PANELS = ["bar", "legend", "header"];
const LEAST_FRAME = [64, 48];  // CSS pixels; in a smaller one nothing can be seen

/**
 * The box around the scene in a picture of its VDI's own view, in multiples of the picture's height
 * right of and above its middle: left, lower, right and upper end. It isn't finite if the camera is in
 * the scene.
 * @param {PreparedVdi} vdi
 */
function sceneBox({bounds, camera}) {
  const basis = basisOf(camera), half = halfHeightOf(camera);
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
    const [right, up, depth] = toView(cornerOf(bounds, corner, [0, 0, 0]), camera, basis);
    const scale = camera.parallel ? 2 * half : depth > 0 ? 2 * half * depth : 0;
    return [right / scale, up / scale];
  });
  const [x, y] = [0, 1].map((axis) => corners.map((corner) => corner[axis]));
  return [Math.min(...x), Math.min(...y), Math.max(...x), Math.max(...y)];
}

export class Page {
  constructor() {
    this.darkScheme = window.matchMedia("(prefers-color-scheme: dark)");
    this.decoder = new Decoder(document.querySelector("script[type=module]")?.textContent ?? "");
    this.viewer = new Viewer(/** @type {HTMLCanvasElement} */ (element("view").querySelector("canvas")), tell, (vdi) => this.decoder.lean(vdi));
    this.decoder.room.elements = mostElements(this.viewer.renderer.gl);
    /** @type {Source | undefined} */
    this.source = undefined;
    /**
     * The source of which a frame is on show, while another one may be opening.
     * @type {Source | undefined}
     */
    this.shownSource = undefined;
    /** @type {LivePanel | undefined} */
    this.live = undefined;
    /** @type {SteerPanel | undefined} */
    this.steer = undefined;
    /** @type {PreparedVdi | undefined} */
    this.vdi = undefined;
    this.frame = 0;
    this.isPlaying = false;
    /** Counts starts and ends of Play, so that the loop of an earlier start ends. */
    this.plays = 0;
    /** Counts requests for frames. A late answer to an older request is dropped. */
    this.request = 0;
    this.ownBackground = false;
    /** @type {Vec3 | undefined} the point that the user wants to orbit */
    this.pivot = undefined;
    /** @type {Promise<void> | undefined} of files that are being opened */
    this.opening = undefined;
    /** The failure to open a file, shown while a server's frames continue. */
    this.notice = "";
    /** @type {Camera | undefined} the latest camera of an unfinished motion to the VDI's viewpoint */
    this.homeward = undefined;
    this.viewer.frameOf = () => this.framing();
    this.viewer.onRest = () => {
      this.keepInUrl();
      this.steer?.onRest();
    };
    this.connect();
    this.takeTheme();
  }

  connect() {
    const {viewer} = this;
    addControls(element("view"), {
      camera: () => viewer.camera,
      center: () => this.orbitCenter(),
      diagonal: () => this.diagonal(),
      framed: () => viewer.renderer.framedHeight() / viewer.canvas.height,
      move: (camera) => this.setCamera(camera),
    });
    element("home").addEventListener("click", () => this.goHome());
    element("play").addEventListener("click", () => this.play(!this.isPlaying));
    input("frame").addEventListener("input", () => this.show(input("frame").valueAsNumber));
    element("pause").addEventListener("click", () => this.live?.toggle());
    input("outline").addEventListener("change", () => {
      viewer.outline = input("outline").checked;
      viewer.refresh();
    });
    input("triad").addEventListener("change", () => this.showView());
    input("scale").addEventListener("change", () => this.showScale());
    input("smooth").addEventListener("change", () => viewer.setSmooth(input("smooth").checked));
    input("background").addEventListener("input", () => {
      this.ownBackground = true;
      this.takeTheme();
    });
    addTools({
      viewer,
      tell,
      center: () => this.orbitCenter(),
      bounds: () => this.vdi?.bounds,
      move: (camera) => this.setCamera(camera),
      glide: (camera) => this.glide(() => camera),
      orbit: (point) => this.pivot = point,
      token: () => this.live && !this.source ? this.live.live.options.token : "",
      viewText: () => this.viewText(true),
    });
    element("open").addEventListener("click", () => input("files").click());
    input("files").addEventListener("change", () => {
      const files = [...(input("files").files ?? [])];
      input("files").value = "";  // otherwise the choice of the same files again changes nothing
      this.openFiles(files);
    });
    element("view").addEventListener("keydown", (event) => this.onKey(event));
    element("view").addEventListener("pointerdown", () => element("look").removeAttribute("open"));
    // The steering panel stays open while the user drags the picture.
    addPanels([...document.querySelectorAll("details")], () => viewer.redraw());
    const panelSizes = new ResizeObserver(() => viewer.schedule());
    for (const panel of PANELS) panelSizes.observe(element(panel));
    for (const name of ["focus", "pointerdown", "keydown"]) window.addEventListener(name, () => viewer.takeContext(), true);
    document.addEventListener("visibilitychange", () => document.hidden || viewer.takeContext());
    window.addEventListener("hashchange", () => this.onNewUrl());
    this.darkScheme.addEventListener("change", () => this.takeTheme());
    document.addEventListener("dragover", (event) => event.preventDefault());
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      this.openFiles([...(event.dataTransfer?.files ?? [])]);
    });
  }

  /**
   * The part of the view in which the picture is framed, in CSS pixels from its lower left corner:
   * above the bar, and beside the legend and below the header where they would cover the scene.
   * @returns {import("./renderer.js").Frame | undefined} undefined: the whole view
   */
  framing() {
    const {vdi} = this;
    if (!vdi) return undefined;
    const {width, height} = element("view").getBoundingClientRect();
    const boxes = PANELS.map((id) => element(id).getBoundingClientRect());
    const [bar, legend, header] = boxes.map((box) => box.width > 0 && box.height > 0 ? box : undefined);
    const bottom = bar ? Math.max(height - bar.top, 0) : 0, right = legend ? width - legend.left : 0, top = header ? header.bottom : 0;
    const frames = [[0, 0], [0, right], [top, 0], [top, right]]
      .map(([above, beside]) => ({x: 0, y: bottom, width: width - beside, height: height - above - bottom}))
      .filter((frame) => frame.width >= LEAST_FRAME[0] && frame.height >= LEAST_FRAME[1]);
    const [pictureWidth, pictureHeight] = [vdi.width - 2 * vdi.margin[0], vdi.height - 2 * vdi.margin[1]];
    const scene = sceneBox(vdi);
    const isFree = (/** @type {import("./renderer.js").Frame} */ frame) => {
      const framed = Math.min(frame.height, frame.width * pictureHeight / pictureWidth);
      const [x, y] = [frame.x + frame.width / 2, height - frame.y - frame.height / 2];
      const [left, upper, end, lower] = [x + scene[0] * framed, y - scene[3] * framed, x + scene[2] * framed, y - scene[1] * framed];
      return [bar, legend, header].every((box) =>
        !box || end <= box.left || left >= box.right || lower <= box.top || upper >= box.bottom);
    };
    return frames.find(isFree) ?? frames[1] ?? frames[0];
  }

  /** Shows the colour bar of the VDI on show, unless the user hides it. */
  showScale() {
    showLegend(element("legend"), input("scale").checked ? this.vdi?.coloring : undefined);
  }

  /** @param {KeyboardEvent} event */
  onKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Home") this.goHome();
    else if (event.key === " " && this.count() > 1) this.play(!this.isPlaying);
    else if (event.key === "h") document.body.classList.toggle("bare");
    else return;
    event.preventDefault();
  }

  /**
   * The point that the user has chosen. Otherwise the focal point if it lies in the scene, otherwise the scene's middle.
   * @returns {Vec3}
   */
  orbitCenter() {
    const {vdi, viewer} = this;
    if (!vdi || !viewer.camera) return [0, 0, 0];
    if (this.pivot) return this.pivot;
    const focal = viewer.camera.focalPoint;
    const inside = focal.every((f, axis) => f >= vdi.bounds[0][axis] && f <= vdi.bounds[1][axis]);
    const middle = centerOf(vdi.bounds);
    return inside || !middle.every(Number.isFinite) ? focal : middle;
  }

  /** The length of the scene's diagonal; 0 without a scene. */
  diagonal() {
    const {vdi} = this;
    const diagonal = vdi ? length(minus(vdi.bounds[1], vdi.bounds[0])) : 0;
    return Number.isFinite(diagonal) ? diagonal : 0;
  }

  /** @param {File[]} files */
  async openFiles(files) {
    if (files.length === 0) return;
    const opening = this.open(filesSource(files, this.decoder));
    this.opening = opening;
    await opening;
    if (this.opening !== opening) return;
    this.opening = undefined;
    if (this.source || !this.live) return;
    const notice = this.notice = element("message").textContent ?? "";
    setTimeout(() => {
      if (this.notice !== notice) return;
      this.notice = "";
      if (element("message").textContent === notice) tell("");
    }, NOTICE_MS);
  }

  /**
   * Shows a source's first frame from the viewpoint at which it was made, and leaves the server. If
   * that fails, the former frame and the server stay.
   * @param {Source} source
   */
  async open(source) {
    this.play(false);
    const wanted = Number(fragment().get("frame") ?? 0);
    const first = this.source === undefined && wanted > 0 && wanted < source.count ? Math.floor(wanted) : 0;
    this.source = source;
    tell(`Reading ${source.nameOf(first)}…`);
    if (await this.show(first) !== "shown") {
      if (this.source === source) this.source = this.shownSource;
      return;
    }
    const before = this.shownSource;
    this.shownSource = source;
    if (before || this.live) document.title = source.nameOf(first);
    this.live?.close();
    this.showSeries(first);
    if (before === undefined) this.takeUrl();
    else if (this.vdi) this.setCamera(this.vdi.camera, false);
  }

  /** Number of frames to choose from. */
  count() {
    return this.source?.count ?? this.live?.count() ?? 0;
  }

  /** @param {number} frame position of the slider */
  showSeries(frame) {
    element("series").hidden = this.count() < 2;
    input("frame").max = String(Math.max(this.count() - 1, 0));
    input("frame").value = String(frame);
  }

  /**
   * Shows a server's frames.
   * @param {string} token
   */
  goLive(token) {
    this.live = new LivePanel(token, this.decoder, {
      show: (vdi, level) => this.takeLevel(vdi, level),
      tell,
      onSeries: (index) => this.showSeries(index),
      onChange: () => this.steer?.refresh(),
    });
    this.steer = new SteerPanel(this.live.live, {camera: () => this.viewer.camera, angle: () => this.degrees(),
                                                  colors: () => this.vdi?.coloring?.transferFunction.colors ?? []});
    const wanted = fragment().get("frame") ?? "";
    this.live.start(/^\d{1,7}$/.test(wanted) ? Number(wanted) : undefined);
  }

  /**
   * Shows a level of a server's frame.
   * @param {PreparedVdi} vdi
   * @param {Arrived} level
   * @returns {Promise<boolean>} whether the page shows it
   */
  async takeLevel(vdi, level) {
    const {viewer} = this;
    const live = this.live;
    const isWanted = () => this.live === live && !this.source && !live?.live.isHeldBack(level);
    let isShown = false;
    do {
      while (this.opening) await this.opening;  // if no file is sound, the server's frames continue
      if (live?.live.state === "closed") return false;
      this.source = this.shownSource = undefined;
      isShown = await viewer.setVdi(vdi, isWanted);
    } while (!isShown && this.opening);
    if (!isShown) return false;
    const before = this.vdi;
    this.vdi = vdi;
    this.frame = level.frame;
    if (!before) this.takeUrl();
    if (!viewer.isLost && this.notice === "") tell("");
    this.follow(before);
    this.showFacts([]);
    this.showScale();
    this.showView();
    return true;
  }

  /**
   * Moves the camera to the viewpoint of the VDI on show if it was at the former VDI's. Otherwise
   * the camera stays, unless its kind of projection differs.
   * @param {PreparedVdi | undefined} before the former one
   */
  follow(before) {
    const {vdi, viewer} = this;
    if (!vdi) return;
    const {camera} = viewer;
    if (!camera || camera.parallel !== vdi.camera.parallel) return this.setCamera(vdi.camera, false);
    if (camera === this.homeward) return;  // its motion ends at this VDI's viewpoint
    if (before && cameraText(camera) === cameraText(before.camera)) this.setCamera(vdi.camera, false);
  }

  /** @param {number} frame @returns {Promise<Outcome>} */
  async show(frame) {
    const {source, viewer} = this;
    if (!source) return this.live ? this.live.show(frame) : "failed";
    const request = ++this.request;
    const isWanted = () => request === this.request && source === this.source;
    try {
      const vdi = await source.load(frame, isWanted);
      if (!isWanted() || !await viewer.setVdi(vdi, isWanted)) return "failed";
      const before = this.vdi;
      this.vdi = vdi;
      this.frame = frame;
      this.follow(before);
      if (!viewer.isLost) tell("");
      const hasTime = vdi.timeStep !== 0 || vdi.time !== 0;
      this.showFacts([source.nameOf(frame),
                      ...hasTime ? [`step ${vdi.timeStep}`, `t = ${Number(vdi.time.toPrecision(10))}`] : []]);
      this.showScale();
      this.showView();
      return "shown";
    } catch (error) {
      const name = source.count > 1 ? `${source.nameOf(frame)}: ` : "";
      if (request === this.request) tell(name + messageOf(error));
      return "failed";
    }
  }

  /** @param {boolean} on */
  play(on) {
    const wasPlaying = this.isPlaying;
    this.isPlaying = on;
    ++this.plays;
    element("play").textContent = on ? "Pause" : "Play";
    element("play").setAttribute("aria-pressed", String(on));
    if (on) this.playOn();
    else if (wasPlaying) this.keepInUrl();
  }

  async playOn() {
    const {plays} = this;
    let missed = 0;  // consecutive frames after the one on show
    while (plays === this.plays && this.count() > 0) {
      const next = (this.frame + 1 + missed) % this.count();
      const pause = new Promise((resolve) => setTimeout(resolve, 1000 / Number(input("speed").value)));
      const outcome = await this.show(next);
      if (plays !== this.plays) return;
      missed = outcome === "missed" ? missed + 1 : 0;
      if (outcome === "failed" || missed >= this.count()) {
        this.play(false);
        return;
      }
      input("frame").value = String(next);
      await pause;
    }
  }

  /** @param {string[]} facts shown before the others */
  showFacts(facts) {
    const {vdi} = this;
    if (!vdi) return;
    const [width, height] = [vdi.width - 2 * vdi.margin[0], vdi.height - 2 * vdi.margin[1]];
    const range = vdi.coloring?.range;
    const parts = [...facts, `3-D picture of ${width} × ${height} pixels`,
                   range ? `values from ${rangeText(...range)}` : ""];
    element("facts").textContent = parts.filter(Boolean).join(" · ");
    element("facts").title = `A Volumetric Depth Image with ${vdi.supersegmentCount.toLocaleString("en")} supersegments: ` +
      "pieces of the lines of sight, with one colour each";
  }

  /** @param {Camera} camera @param {boolean} [moving] whether further cameras will follow */
  setCamera(camera, moving = true) {
    this.viewer.setCamera(camera, moving);
    this.showView();
  }

  /** The angle between the view and the VDI's viewpoint. */
  degrees() {
    const {vdi, viewer} = this;
    return vdi && viewer.camera ? degreesBetween(centerOf(vdi.bounds), vdi.camera, viewer.camera) : NaN;
  }

  /** Updates the texts that depend on the view. */
  showView() {
    const {vdi, viewer} = this;
    if (!vdi || !viewer.camera) return;
    const angle = this.degrees();
    element("angle").textContent = Number.isFinite(angle) ? `${Math.round(angle)}°` : "";
    element("axes").style.display = input("triad").checked ? "" : "none";
    drawAxes(/** @type {SVGElement} */ (/** @type {unknown} */ (element("axes"))), viewer.camera);
  }

  /**
   * Moves the view in a third of a second, unless the user moves it.
   * @param {() => Camera | undefined} target it may change on the way
   * @param {boolean} [isHomeward] whether it is the VDI's viewpoint
   */
  glide(target, isHomeward = false) {
    const {viewer} = this;
    const from = viewer.camera;
    if (!from) return;
    const start = performance.now();
    let last = from;
    const step = () => {
      const to = target();
      if (!to || viewer.camera !== last) return;  // the user moves the camera again
      const share = Math.min((performance.now() - start) / MOTION_MS, 1);
      last = share < 1 ? between(from, to, share * share * (3 - 2 * share)) : to;
      if (isHomeward) this.homeward = share < 1 ? last : undefined;
      this.setCamera(last);
      if (share < 1) requestAnimationFrame(step);
    };
    step();
  }

  goHome() {
    if (!this.vdi || !this.viewer.camera) return;
    this.pivot = undefined;
    this.glide(() => this.vdi?.camera, true);
  }

  takeTheme() {
    const {viewer} = this;
    const dark = this.darkScheme.matches;
    if (!this.ownBackground) input("background").value = dark ? "#17191d" : "#ffffff";
    viewer.background = colorOf(input("background").value);
    const [r, g, b] = viewer.background;
    const isDark = 0.3 * r + 0.6 * g + 0.1 * b < 0.5;
    viewer.outlineColor = isDark ? [0.75, 0.77, 0.8] : [0.3, 0.33, 0.38];
    viewer.refresh();
  }

  /**
   * The view in words of a fragment.
   * @param {boolean} [isWhole] whether to name the camera even if it is the VDI's own
   */
  viewText(isWhole = false) {
    const {vdi, viewer} = this;
    if (!vdi || !viewer.camera) return "";
    const parts = [];
    const camera = cameraText(viewer.camera);
    if (isWhole || camera !== cameraText(vdi.camera)) parts.push(`camera=${camera}`);
    const isChosen = this.source ? this.frame > 0 : this.live?.isChosen();
    if (isChosen) parts.push(`frame=${this.frame}`);
    return parts.join("&");
  }

  keepInUrl() {
    if (!this.vdi || !this.viewer.camera || this.isPlaying) return;
    const text = this.viewText();
    const hash = text ? `#${text}` : "";
    if (hash === location.hash) return;
    try {
      history.replaceState(history.state, "", hash || location.pathname + location.search);
    } catch {
      // Some browsers allow this only a few times per second. A later view will succeed.
    }
  }

  /** Follows the fragment when the user opens another link to this page. */
  onNewUrl() {
    const token = takeToken();
    if (token && this.live) this.live.restart(token);
    else if (token) this.goLive(token);
    this.takeUrl();
  }

  takeUrl() {
    const {vdi} = this;
    const text = fragment().get("camera");
    const camera = vdi && text ? cameraOfText(text, vdi.camera) : vdi?.camera;
    if (camera) this.setCamera(camera, false);
  }
}

/** Focuses the view, without a focus ring, so that keys move it from the start. */
function takeFocus() {
  const {activeElement} = document;
  const view = element("view");
  if (window.parent !== window || (activeElement && activeElement !== document.body)) return;
  view.classList.add("quiet");
  view.addEventListener("blur", () => view.classList.remove("quiet"), {once: true});
  view.focus({preventScroll: true});
}

function main() {
  let page;
  try {
    page = new Page();
  } catch (error) {
    tell(messageOf(error));
    return;
  }
  takeFocus();
  Object.assign(window, {vdiPage: page});  // for scripts and tests
  /** @type {HTMLElement[]} */
  const frames = [...document.querySelectorAll("script.vdi-frame")].map((frame) => /** @type {HTMLElement} */ (frame));
  const token = takeToken();
  if (frames.length > 0) page.open(embeddedSource(frames, page.decoder));
  else if (token) page.goLive(token);
  else if (location.protocol === "file:") tell("Open .vdi files, or drop them here.");
  else tell("This link has no token. Use the one that the server printed, or open .vdi files.");
}

if (typeof document === "undefined") serveDecoding();
else main();
