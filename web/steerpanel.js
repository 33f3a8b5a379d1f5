// The panel that steers the simulation: control, a new viewpoint, the settings that make the VDIs,
// and the parameters that the simulation has declared. The panel is hidden if the server allows no
// steering.

import {cameraText} from "./camera.js";
import {gradientOf} from "./legend.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./format.js").Coloring} Coloring */
/** @typedef {import("./live.js").Live} Live */
/** @typedef {import("./messages.js").Parameter} Parameter */
/** @typedef {import("./messages.js").Wish} Wish */

/**
 * @typedef {object} SteeredView the view that the user moves
 * @property {() => Camera | undefined} camera the user's
 * @property {() => number} angle between that camera and the VDI's, in degrees
 * @property {() => Coloring["transferFunction"]["colors"]} colors of the VDI on show; may be empty
 */

const ENDS = ["low", "high"];  // fields of the colours' range
const AUTO_DEGREES = 15;   // beyond this angle Auto requests a new viewpoint
const RATES = ["automatic", "1", "2", "4", "8"];
const RESOLUTIONS = ["480 × 270", "640 × 360", "960 × 540", "1280 × 720", "1920 × 1080"];

/** @param {string} id */
const partOf = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @param {string} id */
const fieldOf = (id) => /** @type {HTMLInputElement} */ (document.getElementById(id));

/**
 * A camera in the form that messages have.
 * @param {Camera} camera
 */
export function wishedCamera({position, focalPoint, viewUp, parallel, parallelScale, viewAngle}) {
  return {position, focalPoint, viewUp, ...parallel ? {parallelScale} : {viewAngle}};
}

const SLIDER_STEPS = 500;
const COUNT_MS = 1000;  // interval between updates of the age of requests

/**
 * A slider's value, without the digits that its steps don't resolve.
 * @param {number} value
 * @param {number} step of the slider
 */
export function steppedValue(value, step) {
  const digits = Math.floor(Math.log10(Math.abs(value))) - Math.floor(Math.log10(step)) + 2;
  return value === 0 ? 0 : Number(value.toPrecision(Math.min(Math.max(digits, 1), 17)));
}

/** A parameter's row: its name, a slider, and a field for exact values. */
class ParameterRow {
  /** @param {Parameter} parameter @param {(wish: Wish) => void} ask */
  constructor(parameter, ask) {
    const {name, whole, low, high} = parameter;
    this.name = name;
    this.slider = document.createElement("input");
    this.slider.type = "range";
    this.field = document.createElement("input");
    this.field.type = "number";
    for (const one of [this.slider, this.field]) {
      one.min = String(low);
      one.max = String(high);
      one.setAttribute("aria-label", name);
    }
    const step = whole ? Math.max(1, Math.floor((high - low) / SLIDER_STEPS)) : (high - low) / SLIDER_STEPS || 1;
    this.slider.step = String(step);
    this.field.step = whole ? "1" : "any";
    const sliderValue = () => whole ? this.slider.valueAsNumber : steppedValue(this.slider.valueAsNumber, step);
    this.slider.addEventListener("input", () => this.field.value = String(sliderValue()));
    for (const one of [this.slider, this.field]) {
      one.addEventListener("change", () => {
        const value = one === this.slider ? sliderValue() : one.valueAsNumber;
        if (Number.isFinite(value)) ask({parameters: {[name]: Math.min(Math.max(value, low), high)}});
      });
    }
    const label = document.createElement("span");
    label.textContent = name;
    this.cells = [label, this.slider, this.field];
  }

  /** @param {number} value the present one @param {boolean} isMine whether this page drives */
  show(value, isMine) {
    this.slider.disabled = this.field.disabled = !isMine;
    if (this.slider.matches(":active") || document.activeElement === this.field) return;  // the user is changing it
    this.slider.value = String(value);
    this.field.value = String(value);
  }
}

export class SteerPanel {
  /** @param {Live} live @param {SteeredView} view */
  constructor(live, view) {
    this.live = live;
    this.view = view;
    /** @type {ParameterRow[]} */
    this.rows = [];
    this.declared = "";
    /** The camera of the last request, as text. */
    this.asked = "";
    /** Ends of the colours' range that the user has edited since the fields last showed the range in force. */
    this.edited = new Set();
    /** Whether the edited range can't be requested yet, because its ends don't ascend. */
    this.isUnsent = false;
    partOf("drive").addEventListener("click", () => this.isMine() ? live.release() : live.drive());
    partOf("newview").addEventListener("click", () => this.askForView());
    partOf("halt").addEventListener("click", () => this.ask({paused: !live.steering?.paused}));
    this.onNumber("supersegments", (value) => ({supersegments: value}));
    this.onNumber("period", (value) => ({period: value}));
    fieldOf("resolution").addEventListener("change", () => {
      const [width, height] = fieldOf("resolution").value.split(" × ").map(Number);
      if (width > 0 && height > 0) this.ask({resolution: [width, height]});
    });
    fieldOf("rate").addEventListener("change", () => {
      const rate = fieldOf("rate").value;
      this.ask({sampling_rate: rate === RATES[0] ? 0 : Number(rate)});
    });
    fieldOf("preset").addEventListener("change", () => {
      if (fieldOf("preset").value !== "") this.ask({preset: fieldOf("preset").value});
    });
    for (const id of ENDS) {
      fieldOf(id).addEventListener("input", () => this.edited.add(id));
      fieldOf(id).addEventListener("change", () => this.askForRange());
    }
    fieldOf("auto").addEventListener("change", () => this.onRest());
    setInterval(() => {
      if (this.live.pending.requests.size > 0) this.refresh();  // counts the seconds
    }, COUNT_MS);
  }

  /** @param {string} id @param {(value: number) => Wish} wishOf */
  onNumber(id, wishOf) {
    fieldOf(id).addEventListener("change", () => {
      const value = fieldOf(id).valueAsNumber;
      if (Number.isInteger(value) && fieldOf(id).validity.valid) this.ask(wishOf(value));
    });
  }

  /** Whether this page drives. */
  isMine() {
    const {steering} = this.live;
    return steering !== null && steering.driver === steering.you;
  }

  /** @param {Wish} wish */
  ask(wish) {
    if (this.isMine()) this.live.steer(wish);
  }

  /** Requests the edited range. An unedited end keeps its value in force. */
  askForRange() {
    const range = this.live.steering?.generator?.range;
    if (!range) return;
    for (const id of ENDS) if (!Number.isFinite(fieldOf(id).valueAsNumber)) this.edited.delete(id);
    const [low, high] = ENDS.map((id, i) => this.edited.has(id) ? fieldOf(id).valueAsNumber : range[i]);
    this.isUnsent = !(low < high);
    if (!this.isUnsent && this.edited.size > 0) this.ask({range: [low, high]});
    this.refresh();
  }

  /**
   * Shows the range in force, unless the user is editing it.
   * @param {[number, number]} range
   */
  showRange(range) {
    if (!this.isMine()) {
      this.edited.clear();
      this.isUnsent = false;
    }
    partOf("rangenote").hidden = !this.isUnsent;
    if (this.isUnsent || ENDS.some((id) => document.activeElement === fieldOf(id))) return;
    this.edited.clear();
    ENDS.forEach((id, i) => fieldOf(id).value = String(range[i]));
  }

  askForView() {
    const camera = this.view.camera();
    if (!camera || !this.isMine() || !this.live.steering?.generator) return;
    this.asked = cameraText(camera);
    this.ask({camera: wishedCamera(camera)});
  }

  /** Call when the view has come to rest. */
  onRest() {
    const camera = this.view.camera();
    if (!camera || !fieldOf("auto").checked || cameraText(camera) === this.asked) return;
    if (this.view.angle() > AUTO_DEGREES) this.askForView();
  }

  /** Shows the server's state. */
  refresh() {
    const {steering, denied} = this.live;
    partOf("steer").hidden = steering === null;
    partOf("newview").hidden = !this.isMine() || !steering?.generator;
    if (steering === null) return;
    const {driver, you, generator, period, paused, parameters} = steering;
    const isMine = this.isMine();
    partOf("driver").textContent = denied !== "" ? denied : isMine ? `You are driving as viewer ${you}`
      : driver === null ? "Nobody is driving" : `Viewer ${driver} is driving`;
    partOf("drive").textContent = isMine ? "Give back" : "Drive";
    /** @type {HTMLButtonElement} */ (partOf("drive")).disabled = driver !== null && !isMine;
    for (const id of ["halt", "auto", "resolution", "supersegments", "rate", "preset", "low", "high", "period"])
      fieldOf(id).disabled = !isMine;
    const {pending} = this.live;
    partOf("halt").textContent = pending.has("paused") ? (paused ? "Resuming…" : "Pausing…")
      : paused ? "Resume simulation" : "Pause simulation";
    partOf("newview").textContent = pending.has("camera") ? "View requested…" : "New view from here";
    partOf("requested").textContent = pending.text(performance.now());
    this.put("period", String(period));
    for (const one of document.querySelectorAll(".generator")) /** @type {HTMLElement} */ (one).hidden = generator === null;
    for (const one of document.querySelectorAll(".colours"))
      /** @type {HTMLElement} */ (one).hidden = !generator?.range;
    for (const one of document.querySelectorAll(".rates"))
      /** @type {HTMLElement} */ (one).hidden = generator?.sampling_rate === undefined;
    if (generator) {
      const [width, height] = generator.resolution;
      this.put("supersegments", String(generator.supersegments));
      this.choose("resolution", RESOLUTIONS, width > 0 ? `${width} × ${height}` : "");
      this.choose("rate", RATES, generator.sampling_rate ? String(generator.sampling_rate) : RATES[0]);
      const colors = this.view.colors();
      partOf("inforce").hidden = colors.length < 2;
      if (colors.length > 1) partOf("inforce").style.background = gradientOf(colors, "right");
      this.choose("preset", generator.presets, generator.preset ?? "");
      this.showRange(generator.range ?? [0, 1]);
    }
    this.showParameters(parameters, isMine);
  }

  /** @param {Parameter[]} parameters @param {boolean} isMine */
  showParameters(parameters, isMine) {
    const declared = JSON.stringify(parameters.map(({name, whole, low, high}) => [name, whole, low, high]));
    if (declared !== this.declared) {
      this.declared = declared;
      this.rows = parameters.map((one) => new ParameterRow(one, (wish) => this.ask(wish)));
      partOf("parameters").replaceChildren(...this.rows.flatMap((row) => row.cells));
    }
    parameters.forEach(({value}, i) => this.rows[i].show(value, isMine));
  }

  /** @param {string} id of a field in which the user may be typing @param {string} value */
  put(id, value) {
    if (document.activeElement !== fieldOf(id)) fieldOf(id).value = value;
  }

  /** @param {string} id of a select @param {string[]} choices @param {string} value any text */
  choose(id, choices, value) {
    const select = /** @type {HTMLSelectElement} */ (/** @type {HTMLElement} */ (fieldOf(id)));
    if (document.activeElement === select) return;
    const all = choices.includes(value) ? choices : [value, ...choices];
    if (JSON.stringify([...select.options].map((option) => option.value)) !== JSON.stringify(all))
      select.replaceChildren(...all.map((text) => new Option(text === "" ? "…" : text, text)));
    select.value = value;
  }
}
