// What users do with the view besides moving it: look along axes, choose the point that it orbits,
// clip, turn, record, save pictures, share a link, fill the screen, and read the help.

import {lookingFrom} from "./axes.js";
import {addClipping, planesOf} from "./clip.js";
import {pointAt} from "./pick.js";
import {save} from "./picture.js";
import {Recorder, Turntable, canRecord} from "./record.js";
import {addSharing} from "./share.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {import("./viewer.js").Viewer} Viewer */

/**
 * @typedef {object} Tooled the page
 * @property {Viewer} viewer
 * @property {() => Vec3} center that the view orbits
 * @property {() => [Vec3, Vec3] | undefined} bounds of the scene
 * @property {(camera: Camera) => void} move
 * @property {(camera: Camera) => void} glide moves the view there in a third of a second
 * @property {(point: Vec3) => void} orbit sets the point that the view orbits
 * @property {() => string} token of the server; empty without one
 * @property {() => string} viewText the fragment that describes the view
 * @property {(message: string) => void} tell
 */

const TAP_MS = 350;      // between two taps
const TAP_PIXELS = 24;   // between their places
const MARK_MS = 1200;

/** @param {string} id */
const toolOf = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @param {string} id */
const choiceOf = (id) => /** @type {HTMLInputElement} */ (toolOf(id));

/**
 * Calls `act` with the place of each double click or double tap.
 * @param {HTMLElement} element
 * @param {(x: number, y: number) => void} act in CSS pixels of the window
 */
function onDoubleTap(element, act) {
  let last = {at: -Infinity, x: 0, y: 0}, down = last;
  const isNear = (/** @type {{x: number, y: number}} */ a, /** @type {PointerEvent} */ b) =>
    Math.hypot(a.x - b.clientX, a.y - b.clientY) < TAP_PIXELS;
  element.addEventListener("pointerdown", (event) => {
    down = event.isPrimary && event.button === 0 ? {at: event.timeStamp, x: event.clientX, y: event.clientY} : {at: -Infinity, x: 0, y: 0};
  });
  element.addEventListener("pointerup", (event) => {
    const isTap = event.timeStamp - down.at < TAP_MS && Math.hypot(down.x - event.clientX, down.y - event.clientY) < 6;
    const isSecond = isTap && event.timeStamp - last.at < TAP_MS && isNear(last, event);
    last = isTap && !isSecond ? {at: event.timeStamp, x: event.clientX, y: event.clientY} : {at: -Infinity, x: 0, y: 0};
    if (isSecond) act(event.clientX, event.clientY);
  });
}

/** @param {Tooled} page */
export function addTools(page) {
  const {viewer} = page;
  const view = toolOf("view");

  /** @param {string} side */
  const look = (side) => {
    const to = viewer.camera && lookingFrom(viewer.camera, page.center(), side);
    if (to) page.glide(to);
  };
  for (const place of ["axes", "sides"]) {
    toolOf(place).addEventListener("click", (event) => {
      const side = /** @type {Element} */ (event.target).closest("[data-side]")?.getAttribute("data-side");
      if (side) look(side);
    });
  }
  toolOf("axes").addEventListener("mousedown", (event) => event.preventDefault());  // keys still move the view

  /**
   * Makes the view orbit what a place of the window shows.
   * @param {number} x in CSS pixels
   * @param {number} y
   */
  const orbitPlace = (x, y) => {
    const box = view.getBoundingClientRect();
    const point = pointAt(viewer, (x - box.left) / box.width, (y - box.top) / box.height);
    if (!point) return;
    page.orbit(point);
    const mark = toolOf("mark");
    Object.assign(mark.style, {left: `${x}px`, top: `${y}px`});
    mark.hidden = false;
    setTimeout(() => mark.hidden = true, MARK_MS);
  };
  onDoubleTap(view, orbitPlace);

  addClipping(toolOf("clip"), (shares) => {
    const bounds = page.bounds();
    if (!bounds) return;
    viewer.clip((now) => planesOf(now, shares));
  });

  const showRunning = () => {
    toolOf("turn").textContent = turntable.isOn ? "Stop turning" : "Turn";
    toolOf("turn").setAttribute("aria-pressed", String(turntable.isOn));
    toolOf("record").textContent = recorder.isOn ? "Stop recording" : "Record";
    toolOf("record").setAttribute("aria-pressed", String(recorder.isOn));
    toolOf("recording").hidden = !recorder.isOn;
  };
  const turntable = new Turntable({camera: () => viewer.camera, center: page.center, move: page.move}, showRunning);
  const recorder = new Recorder(() => viewer.canvas, showRunning);
  const turn = () => {
    if (turntable.isOn) turntable.stop();
    else turntable.start();
  };
  const record = () => {
    try {
      if (recorder.isOn) recorder.stop();
      else recorder.start();
    } catch (error) {
      page.tell(`the browser can't record: ${error instanceof Error ? error.message : error}`);
    }
  };
  const recordTurn = async () => {
    if (recorder.isOn || !viewer.camera) return;
    record();
    await turntable.start(1);
    if (recorder.isOn) recorder.stop();
  };
  toolOf("record").hidden = toolOf("recordturn").hidden = !canRecord();
  toolOf("turn").addEventListener("click", turn);
  toolOf("record").addEventListener("click", record);
  toolOf("recordturn").addEventListener("click", recordTurn);
  toolOf("recording").addEventListener("click", () => recorder.stop());

  toolOf("screenshot").addEventListener("click", async () => {
    const size = choiceOf("size").value.split("x").map(Number);
    try {
      save(await viewer.screenshot(size.length === 2 ? [size[0], size[1]] : undefined, choiceOf("transparent").checked), "png");
    } catch (error) {
      page.tell(error instanceof Error ? error.message : String(error));
    }
  });

  addSharing(page.viewText, page.token);

  const fullScreen = () => {
    if (document.fullscreenElement) document.exitFullscreen();
    else document.documentElement.requestFullscreen?.().catch(() => page.tell("the browser doesn't allow full screen here"));
  };
  toolOf("full").hidden = !document.fullscreenEnabled;
  toolOf("full").addEventListener("click", fullScreen);

  const help = /** @type {HTMLDialogElement} */ (toolOf("help"));
  const showHelp = () => {
    help.showModal();
    help.scrollTop = 0;  // the button that has the focus is at the end
  };
  toolOf("helpbutton").addEventListener("click", showHelp);
  for (const dialog of document.querySelectorAll("dialog")) {
    dialog.addEventListener("click", (event) => {
      if (event.target === dialog) dialog.close();  // outside of its content
    });
  }

  view.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const {key} = event;
    if ("xyzXYZ".includes(key) && key.length === 1) look((key === key.toLowerCase() ? "+" : "-") + key.toLowerCase());
    else if (key === "c") {
      const box = view.getBoundingClientRect();
      const {canvas, renderer} = viewer;
      const [right, up] = renderer.framedMiddle();
      orbitPlace(box.left + box.width * (0.5 + right / canvas.width), box.top + box.height * (0.5 - up / canvas.height));
    }
    else if (key === "t") turn();
    else if (key === "r" && canRecord()) record();
    else if (key === "f") fullScreen();
    else if (key === "?") showHelp();
    else return;
    event.preventDefault();
  });
}
