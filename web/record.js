// Turns the view like a turntable, and records the picture as a video.

import {orbited} from "./camera.js";
import {save} from "./picture.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Vec3} Vec3 */

const SECONDS_PER_TURN = 12;
const FRAMES_PER_SECOND = 30;
const BITS_PER_SECOND = 12e6;
const PART_MS = 500;  // the browser hands the video over in parts of this length
const FORMATS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

/**
 * @typedef {object} Turned the view that turns
 * @property {() => Camera | undefined} camera
 * @property {() => Vec3} center
 * @property {(camera: Camera) => void} move
 */

export class Turntable {
  /** @param {Turned} view @param {() => void} onChange called when it starts or stops */
  constructor(view, onChange) {
    this.view = view;
    this.onChange = onChange;
    this.isOn = false;
    this.run = 0;
  }

  stop() {
    if (!this.isOn) return;
    this.isOn = false;
    this.onChange();
  }

  /**
   * @param {number} [turns] after which it stops; without end by default
   * @returns {Promise<void>} fulfilled when it has stopped
   */
  start(turns = Infinity) {
    const run = ++this.run;
    const {center} = this.view;
    this.isOn = true;
    this.onChange();
    let left = 360 * turns, last = performance.now();
    return new Promise((resolve) => {
      const step = () => {
        const camera = this.view.camera();
        if (!this.isOn || run !== this.run || !camera) return resolve();
        const now = performance.now();
        const degrees = Math.min((now - last) * 360 / (1000 * SECONDS_PER_TURN), left);
        [last, left] = [now, left - degrees];
        this.view.move(orbited(camera, center(), degrees, 0));
        if (left > 0) requestAnimationFrame(step);
        else {
          this.stop();
          resolve();
        }
      };
      requestAnimationFrame(step);
    });
  }
}

/** Whether the browser can record. */
export function canRecord() {
  return typeof MediaRecorder !== "undefined" && "captureStream" in HTMLCanvasElement.prototype;
}

export class Recorder {
  /** @param {() => HTMLCanvasElement} canvas on show @param {() => void} onChange called when it starts or stops */
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    /** @type {MediaRecorder | undefined} */
    this.recorder = undefined;
  }

  get isOn() {
    return this.recorder !== undefined;
  }

  /** Throws Error if the browser can't record. */
  start() {
    const mimeType = FORMATS.find((format) => MediaRecorder.isTypeSupported(format));
    const recorder = new MediaRecorder(this.canvas().captureStream(FRAMES_PER_SECOND), {mimeType, videoBitsPerSecond: BITS_PER_SECOND});
    /** @type {Blob[]} */
    const parts = [];
    recorder.addEventListener("dataavailable", ({data}) => parts.push(data));
    recorder.addEventListener("stop", () => {
      for (const track of recorder.stream.getTracks()) track.stop();
      const type = recorder.mimeType.split(";")[0] || "video/webm";
      save(new Blob(parts, {type}), type.split("/")[1]);
    });
    recorder.start(PART_MS);
    this.recorder = recorder;
    this.onChange();
  }

  stop() {
    this.recorder?.stop();
    this.recorder = undefined;
    this.onChange();
  }
}
