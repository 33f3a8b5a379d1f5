// Tests the page's controls, pictures and numbers without a browser. The test provides elements,
// renderer and clock.
import {basisOf, cameraOfText, cameraText, clipMatrix, halfHeightOf, orbited, panned, toView, zoomed} from "../../web/camera.js";
import {addControls} from "../../web/controls.js";
import {numberText, rangeText, ticksOf} from "../../web/legend.js";
import {outlineEnds} from "../../web/renderer.js";
import {PendingRequests} from "../../web/pending.js";
import {SteerPanel, steppedValue} from "../../web/steerpanel.js";
import {Viewer} from "../../web/viewer.js";
import {check, finish} from "./check.mjs";

Object.assign(globalThis, {postMessage: () => {}});  // the page's script is that of its worker, too
const {Page} = await import("../../web/page.js");

/** A clock that only `pass` moves. */
const clock = {
  now: 0,
  /** @type {{at: number, act: () => void}[]} */
  timers: [],
  pass(/** @type {number} */ milliseconds) {
    const end = this.now + milliseconds;
    for (;;) {
      const due = this.timers.filter(({at}) => at <= end).sort((a, b) => a.at - b.at);
      if (due.length === 0) break;
      this.timers.splice(this.timers.indexOf(due[0]), 1);
      this.now = Math.max(this.now, due[0].at);
      due[0].act();
    }
    this.now = end;
  },
};
Object.defineProperty(globalThis, "performance", {value: {now: () => clock.now}});
Object.assign(globalThis, {
  window: {devicePixelRatio: 1},
  setTimeout: (/** @type {() => void} */ act, /** @type {number} */ after) => {
    const timer = {at: clock.now + after, act};
    clock.timers.push(timer);
    return timer;
  },
  clearTimeout: (/** @type {any} */ timer) => {
    clock.timers = clock.timers.filter((other) => other !== timer);
  },
  requestAnimationFrame: (/** @type {() => void} */ act) => setTimeout(act, 16),
});

/** @type {any} */
const CAMERA = {position: [0, 0, 5], focalPoint: [0, 0, 0], viewUp: [0, 1, 0], viewAngle: 30, parallel: false,
                parallelScale: 1};

/**
 * A viewer of a square canvas. Its renderer notes for each row of its two pictures which camera drew it,
 * and how coarsely.
 */
function viewerOf(/** @type {number} */ millisecondsPerPixel) {
  const side = 100;
  const gl = new Proxy({}, {get: (_, name) => /^[A-Z]/.test(String(name)) ? name : () => 1});
  /** @type {any} */
  const canvas = {width: side, height: side, clientWidth: side, clientHeight: side,
                  getContext: () => gl, addEventListener: () => {}, toBlob: (/** @type {(blob: object) => void} */ take) => take({})};
  const viewer = new Viewer(canvas, () => {}, async () => undefined);
  const blank = () => Array(side).fill("");
  let drawn = 0;
  const renderer = {
    gl: {
      TIMEOUT_EXPIRED: 1, flush: () => {}, deleteSync: () => {},
      fenceSync: () => ({at: clock.now + drawn * millisecondsPerPixel}),
      clientWaitSync: (/** @type {{at: number}} */ sync) => clock.now < sync.at ? 1 : 0,
    },
    frame: 0,
    setVdi: async (/** @type {any} */ _, /** @type {any} */ pause, /** @type {() => boolean} */ isWanted) => isWanted(),
    most: [4096, 4096], loaded: undefined, smooth: false, canShear: () => false, shown: blank(), next: blank(),
    pictureSize: (/** @type {number} */ scale) => ({width: Math.ceil(side / scale), height: Math.ceil(side / scale)}),
    /** @param {any} camera @param {number} scale @param {number} first @param {number} end */
    drawPicture(camera, scale, first, end) {
      this.next.fill(`${camera.position[0]} at ${scale}`, first, end);
      drawn = Math.ceil(side / scale) * (end - first);
    },
    finishPicture() { [this.shown, this.next] = [this.next, this.shown]; },
    present: () => {},
  };
  viewer.renderer = /** @type {any} */ (renderer);
  viewer.cost = millisecondsPerPixel;
  let rests = 0;
  viewer.onRest = () => void ++rests;
  const look = (/** @type {number} */ x, /** @type {boolean} */ moving) =>
    viewer.setCamera({...CAMERA, position: [x, 0, 5]}, moving);
  return {viewer, renderer, look, rests: () => rests};
}

function testRest() {
  const {viewer, look, rests} = viewerOf(1e-6);
  for (let x = 0; x < 60; ++x) {
    look(x, true);
    clock.pass(10);
  }
  check(rests() === 0, `a view that moves doesn't rest: ${rests()} times`);
  clock.pass(1000);
  check(rests() === 1, `a view rests once after a motion: ${rests()} times`);
  look(99, false);
  clock.pass(40);
  check(rests() === 2 && viewer.isWhole(), "a view that jumps rests at once");

  // A motion that ends in strips, because its pictures became too slow for the whole canvas meanwhile.
  const slow = viewerOf(1e-6);
  slow.look(0, true);
  clock.pass(100);
  slow.viewer.cost = 0.01;
  for (let x = 1; x < 20; ++x) {
    slow.look(x, true);
    clock.pass(20);
  }
  check(slow.rests() === 0, `a slow view that moves doesn't rest: ${slow.rests()} times`);
  clock.pass(2000);
  check(slow.viewer.isWhole() && slow.rests() === 1, `a slow view rests, too: ${slow.rests()} times`);
}

/**
 * A hand that rests while VDIs come: the page calls it at rest, and each VDI is seen as finely as
 * its time on show allows.
 */
async function testRestWithFrames() {
  const seenOf = async (/** @type {number} */ millisecondsPerPixel, /** @type {number[]} */ pauses) => {
    const {viewer, renderer, look, rests} = viewerOf(millisecondsPerPixel);
    /** @type {string[][]} scales at which each VDI is seen */
    const seen = [];
    const finish = renderer.finishPicture;
    renderer.finishPicture = () => {
      finish.call(renderer);
      seen[renderer.frame].push(renderer.shown[0].split(" at ")[1]);
    };
    await viewer.setVdi(/** @type {any} */ ({}), () => true);
    seen.push([]);
    for (let x = 0; x < 10; ++x) {
      look(x, true);
      clock.pass(16);
    }
    let rested = rests();
    for (let i = 0; i < 20; ++i) {
      clock.pass(pauses[i % pauses.length]);
      seen.push([]);
      renderer.frame = seen.length - 1;
      await viewer.setVdi(/** @type {any} */ ({}), () => true);
      if (i === 0) rested = rests();
    }
    return {seen: seen.slice(4), rested};
  };
  const slow = await seenOf(0.1, [500]);  // a whole picture takes a second
  check(slow.rested === 1, `a view rests although no picture is complete: ${slow.rested}`);
  const coarsest = (/** @type {string[][]} */ seen) => Math.max(...seen.slice(0, -1).flat().map(Number));
  check(slow.seen.slice(0, -1).every((scales) => scales.length > 0) && coarsest(slow.seen) <= 2.5,
        `frames that come twice a second are seen about as finely as the time allows: ${JSON.stringify(slow.seen)}`);
  const sharp = await seenOf(0.02, [500]);
  check(sharp.seen.slice(0, -1).every((scales) => scales.join() === "1"),
        `frames are seen sharp from the start if time allows: ${JSON.stringify(sharp.seen)}`);
  const quick = await seenOf(0.1, [100]);
  check(quick.seen.flat().length >= 10 && coarsest(quick.seen) <= 6, `most of ten frames a second are seen: ${JSON.stringify(quick.seen)}`);
  const levels = await seenOf(0.02, [450, 50]);
  check(levels.seen.filter((scales) => scales.join() === "1").length >= 8 && coarsest(levels.seen) === 1,
        `of two levels in quick succession, the finer one is seen sharp: ${JSON.stringify(levels.seen)}`);
  const irregular = await seenOf(0.02, [400, 150, 150, 150]);
  check(irregular.seen.flat().length >= 12, `frames that come earlier than expected are seen, too: ${JSON.stringify(irregular.seen)}`);
}

async function testScreenshot() {
  const {viewer, renderer, look, rests} = viewerOf(0.01);
  look(7, false);
  while (viewer.nextRow === 0) clock.pass(1);
  check(viewer.nextRow < 100 && renderer.shown[0] !== "7 at 1", "a picture is drawn in strips");
  await viewer.screenshot();
  const isWhole = () => renderer.shown.every((row) => row === "7 at 1");
  check(isWhole(), "a screenshot shows the whole picture");
  check(viewer.missing === "nothing" && rests() === 1, "the picture of a screenshot is one at rest");
  clock.pass(2000);
  check(isWhole(),
        `a screenshot's picture stays, and no strips are put into an older one: ${new Set(renderer.shown).size} kinds of rows`);
  check(rests() === 1, `the view rests once after a screenshot: ${rests()} times`);
  viewer.isLost = true;
  const refused = await viewer.screenshot().then(() => "", (/** @type {Error} */ error) => error.message);
  check(refused.includes("lost the picture"), `no screenshot of a lost picture: ${refused}`);
}

/** An element of this size, pointers on it, and the place where the camera sees a point of the world. */
function handsOn(/** @type {number} */ width, /** @type {number} */ height, /** @type {number} */ framed) {
  /** @type {Map<string, (event: any) => void>} */
  const listeners = new Map();
  const element = {
    addEventListener: (/** @type {string} */ name, /** @type {(event: any) => void} */ act) => listeners.set(name, act),
    getBoundingClientRect: () => ({left: 0, top: 0, width, height}), setPointerCapture: () => {},
  };
  let camera = CAMERA;
  addControls(/** @type {any} */ (element), /** @type {any} */ ({
    camera: () => camera, center: () => [0, 0, 0], diagonal: () => 1, framed: () => framed,
    move: (/** @type {any} */ next) => camera = next,
  }));
  /** @param {string} name @param {number} id @param {number} x @param {number} y */
  const point = (name, id, x, y, more = {}) =>
    listeners.get(name)?.({pointerId: id, clientX: x, clientY: y, button: 0, ...more});
  const place = (/** @type {any} */ world) => {
    const [x, y, z] = toView(world, camera, basisOf(camera));
    const pixels = framed * height / 2 / halfHeightOf(camera) / z;
    return [width / 2 + x * pixels, height / 2 - y * pixels];
  };
  return {point, place};
}

/** @param {number[]} place @param {number} x @param {number} y @param {number} most pixels between them */
const isNear = (place, x, y, most = 0.01) => Math.hypot(place[0] - x, place[1] - y) < most;

function testRoll() {
  // Material 80 pixels to the right of the middle follows the pointer to the place 80 pixels above it.
  const half = halfHeightOf(CAMERA) * 5;
  const mouse = handsOn(400, 300, 1);
  const beside = [80 / 150 * half, 0, 0];
  check(isNear(mouse.place(beside), 280, 150), "where the test's material is");
  mouse.point("pointerdown", 1, 280, 150, {ctrlKey: true});
  mouse.point("pointermove", 1, 200 + 80 * Math.SQRT1_2, 150 - 80 * Math.SQRT1_2);
  mouse.point("pointermove", 1, 200, 70);
  check(isNear(mouse.place(beside), 200, 70), `a mouse rolls material along: ${mouse.place(beside)}`);

  // Fingers on both sides of the middle, which move alternately, counterclockwise and a little at a
  // time.
  const touch = handsOn(400, 300, 1);
  touch.point("pointerdown", 1, 280, 150);
  touch.point("pointerdown", 2, 120, 150);
  for (let i = 1; i <= 60; ++i) {
    const [x, y] = [80 * Math.cos(i * Math.PI / 120), 80 * Math.sin(i * Math.PI / 120)];
    touch.point("pointermove", 1, 200 + x, 150 - y);
    touch.point("pointermove", 2, 200 - x, 150 + y);
  }
  check(isNear(touch.place(beside), 200, 70, 3), `two fingers roll material along: ${touch.place(beside)}`);
}

function testPan() {
  // On a phone held upright, a picture of 16 to 9 takes 112.5 of 400 pixels of height.
  const mouse = handsOn(200, 400, 112.5 / 400);
  mouse.point("pointerdown", 1, 100, 200, {shiftKey: true});
  mouse.point("pointermove", 1, 130, 180);
  check(isNear(mouse.place([0, 0, 0]), 130, 180), `material follows a mouse: ${mouse.place([0, 0, 0])}`);
  const touch = handsOn(200, 400, 112.5 / 400);
  touch.point("pointerdown", 1, 60, 200);
  touch.point("pointerdown", 2, 140, 200);
  for (let i = 1; i <= 20; ++i) {
    touch.point("pointermove", 1, 60, 200 - i);
    touch.point("pointermove", 2, 140, 200 - i);
  }
  check(isNear(touch.place([0, 0, 0]), 100, 180, 1), `material follows two fingers: ${touch.place([0, 0, 0])}`);
  const wide = handsOn(400, 300, 1);
  wide.point("pointerdown", 1, 100, 200, {button: 1});
  wide.point("pointermove", 1, 130, 180);
  check(isNear(wide.place([0, 0, 0]), 230, 130), `material follows a mouse in a wide window: ${wide.place([0, 0, 0])}`);
}

/** However far a user zooms in, the view can be kept in a link, and continues from there. */
function testZoom() {
  for (const focalPoint of [[0, 0, 0], [5, -3, 2], [448000, 5411000, 100]]) {
    for (const more of [{}, {parallel: true, parallelScale: 40}]) {
      let camera = {...CAMERA, ...more, focalPoint, position: [focalPoint[0] + 200, focalPoint[1] + 100, focalPoint[2] + 50]};
      for (let i = 0; i < 2000; ++i) camera = zoomed(camera, 1.1, 173);
      const kept = cameraOfText(cameraText(camera), camera);
      check(kept !== undefined && cameraText(kept) === cameraText(camera), `a view from near ${focalPoint}: ${cameraText(camera)}`);
      const turned = orbited(camera, camera.focalPoint, 5, 0);
      check(cameraText(turned) !== cameraText(camera), `a near view of ${focalPoint} turns`);
      const far = zoomed(camera, 1e-6, 173);
      check(toView(far.focalPoint, far, basisOf(far))[2] > 100 || far.parallelScale > 100, `and comes back: ${cameraText(far)}`);
    }
  }
  const near = {...CAMERA, position: [0, 0, 1e-9]};
  check(Math.abs(zoomed(near, 2, 1).position[2] - 1e-9) < 1e-12, "a view that is nearer already stays");
}

/** Far from the origin, as in a map's coordinates: metres in millions. */
function testFarFromTheOrigin() {
  /** @type {any} */
  const camera = {...CAMERA, focalPoint: [448050, 5411050, 150], position: [448350, 5411250, 250]};
  check(cameraText(panned(camera, 1e-4, 0)) !== cameraText(camera), "a pan by a tenth of a pixel is a motion");
  const kept = cameraOfText(cameraText(camera), camera);
  check(kept !== undefined && kept.position.every((value, i) => Math.abs(value - camera.position[i]) < 1e-3), "a link keeps the place");
  const bounds = /** @type {any} */ ([[448000, 5411000, 100], [448100.3, 5411100.3, 200.3]]);
  const ends = new Float32Array([...outlineEnds(bounds, camera, true), ...outlineEnds(bounds, camera, false)]);
  const matrix = clipMatrix(camera, [1.6, 1]);
  const pixels = 500;  // half the picture's height
  let worst = 0;
  for (const x of [0, 1]) for (const y of [0, 1]) for (const z of [0, 1]) {
    const [right, up, depth] = toView([bounds[x][0], bounds[y][1], bounds[z][2]], camera, basisOf(camera));
    const place = [right, up].map((value) => pixels * value / depth / halfHeightOf(camera));
    let nearest = Infinity;
    for (let i = 0; i < ends.length; i += 3) {
      const row = (/** @type {number} */ r) =>
        Math.fround(matrix[r] * ends[i] + matrix[4 + r] * ends[i + 1] + matrix[8 + r] * ends[i + 2] + matrix[12 + r]);
      const drawn = [1.6 * pixels * row(0) / row(3), pixels * row(1) / row(3)];
      nearest = Math.min(nearest, Math.hypot(drawn[0] - place[0], drawn[1] - place[1]));
    }
    worst = Math.max(worst, nearest);
  }
  check(worst < 0.01, `the outline is off by ${worst} pixels`);
}

function testNumbers() {
  const texts = (/** @type {number} */ low, /** @type {number[]} */ ...shares) =>
    shares.map((value) => numberText(low + value, shares[shares.length - 1])).join(" ");
  const cases = [
    [texts(101300, 0, 50, 100), "101300 101350 101400"],
    [texts(1234567000, 0, 500, 1000), "1234567000 1234567500 1234568000"],
    [texts(-1e6, 0, 0.5, 1), "-1000000.00 -999999.50 -999999.00"],
    [texts(1.2e-5, 0, 5e-8, 1e-7), "1.2000e-5 1.2050e-5 1.2100e-5"],
    [texts(1.25e11, 0, 5e8, 1e9), "1.2500e+11 1.2550e+11 1.2600e+11"],
    [texts(2e-20, 0, 5e-31, 1e-30), "2.000000000000e-20 2.000000000050e-20 2.000000000100e-20"],
    [texts(2e21, 0, 5e17, 1e18), "2.00000e+21 2.00050e+21 2.00100e+21"],
    [texts(0.5, 0, 5e-9, 1e-8), "0.5000000000 0.5000000050 0.5000000100"],
    // Wide ranges.
    [texts(0, 0, 1e5, 2e5), "0 1.00e+5 2.00e+5"],
    [texts(-2, 0, 2, 14.5), "-2.0 0 12.5"],
    [texts(0, 0, 2.5e-4, 5e-4), "0 2.50e-4 5.00e-4"],
    [texts(20, 0, 500, 1000), "20 520 1020"],
  ];
  for (const [got, expected] of cases) check(got === expected, `numbers: ${got}, not ${expected}`);
  check(rangeText(-0.25, 1 / 3) === "-0.25 to 0.333333", `a range: ${rangeText(-0.25, 1 / 3)}`);
  check(rangeText(300, 300 + 2 ** -44) === "300 to 300.00000000000006", `a narrow range: ${rangeText(300, 300 + 2 ** -44)}`);
}

/** Ranges of all widths, down to neighbouring doubles, have few ticks, in order, with texts that differ. */
function testTicks() {
  check(ticksOf(-2, 12.5).join() === "-2,12.5,0,5,10", `ticks: ${ticksOf(-2, 12.5)}`);
  const least = Number.MIN_VALUE, most = Number.MAX_VALUE;
  /** @type {[number, number][]} */
  const ranges = [[0, least], [least, 3 * least], [-most, most], [0, most], [-1, most], [-least, least]];
  for (const middle of [300, -300, 1e-300, 1e300, 273.15, 2 ** 53, -(2 ** 52), 2 ** 60, 0.1, 101325, 1e15]) {
    const ulp = 2 ** (Math.floor(Math.log2(Math.abs(middle))) - 52);
    for (const ulps of [1, 2, 3, 5, 17, 1000, 123456, 1e10]) ranges.push([middle, middle + ulps * ulp], [middle - ulps * ulp, middle]);
  }
  for (const [low, high] of ranges) {
    const ticks = ticksOf(low, high);
    const texts = ticks.map((value) => numberText(value, Math.min(high - low, most)));
    const what = `ticks of ${low} to ${high}: ${ticks}, ${texts}`;
    check(ticks.length <= 7 && ticks.every((value) => value >= low && value <= high), what);
    check(new Set(texts).size === texts.length && texts.every((text) => text.length <= 26), what);
  }
}

/** A page of fields without a browser. `enter` acts as a user who types in a field and leaves it. */
function fields() {
  /** @type {Map<string, any>} */
  const elements = new Map();
  const make = () => {
    /** @type {Map<string, (() => void)[]>} */
    const listeners = new Map();
    return {
      value: "", hidden: false, disabled: false, checked: false, textContent: "", validity: {valid: true}, options: [],
      get valueAsNumber() { return this.value === "" ? NaN : Number(this.value); },
      addEventListener: (/** @type {string} */ name, /** @type {() => void} */ act) =>
        listeners.set(name, [...listeners.get(name) ?? [], act]),
      fire: (/** @type {string} */ name) => (listeners.get(name) ?? []).forEach((act) => act()),
      setAttribute: () => {}, matches: () => false, replaceChildren: () => {},
    };
  };
  const byId = (/** @type {string} */ id) => {
    if (!elements.has(id)) elements.set(id, make());
    return elements.get(id);
  };
  const page = {getElementById: byId, createElement: make, querySelectorAll: () => [], /** @type {any} */ activeElement: null};
  Object.assign(globalThis, {document: page, Option: class {}});
  const enter = (/** @type {any} */ field, /** @type {number | string} */ value) => {
    page.activeElement = field;
    field.value = String(value);
    field.fire("input");
    field.fire("change");
  };
  return {byId, enter, leave: () => page.activeElement = null};
}

/** A steering panel, its requests, and a function that delivers the server's state. */
function steered() {
  const page = fields();
  /** @type {any[]} */
  const asked = [];
  /** @type {any} */
  const live = {steering: null, denied: "", pending: new PendingRequests(), steer: (/** @type {any} */ wish) => asked.push(wish)};
  const panel = new SteerPanel(live, {camera: () => undefined, angle: () => 0, colors: () => []});
  const say = (/** @type {any} */ generator, /** @type {any[]} */ parameters = []) => {
    live.steering = {you: 1, driver: 1, period: 1, paused: false, parameters,
                     generator: {resolution: [640, 360], supersegments: 25, presets: [], ...generator}};
    panel.refresh();
  };
  return {...page, panel, say, asked: () => JSON.stringify(asked.splice(0))};
}

function testNumbersOfThePanel() {
  check(steppedValue(101325.123456789, 0.00172) === 101325.1235, `a slider's digits: ${steppedValue(101325.123456789, 0.00172)}`);
  check(steppedValue(0.30000000000000004, 0.0002) === 0.3 && steppedValue(0, 0.1) === 0 && steppedValue(1e-9, 1) === 1e-9,
        "a slider's values near 0");
  const {byId, enter, leave, panel, say, asked} = steered();
  const range = [101325.12, 101325.98];
  const whole = {name: "cells", whole: true, value: 1234567, low: 0, high: 1e7};
  say({range}, [whole]);
  check(byId("low").value === "101325.12" && byId("high").value === "101325.98", `a narrow range: ${byId("low").value}, ${byId("high").value}`);
  enter(byId("high"), 101326);
  check(asked() === '[{"range":[101325.12,101326]}]', "the end that isn't edited stays");
  leave();
  const [{slider, field}] = panel.rows;
  check(field.value === "1234567" && slider.step === "20000", `a whole parameter: ${field.value}, step ${slider.step}`);
  enter(slider, 1240000);
  check(asked() === '[{"parameters":{"cells":1240000}}]' && field.value === "1240000", `a step of a whole slider: ${field.value}`);
  say({range}, [{name: "rate", whole: false, value: 0.1234567891, low: 0, high: 1}]);
  leave();
  panel.refresh();
  check(panel.rows[0].field.value === "0.1234567891", `a number in full: ${panel.rows[0].field.value}`);
}

function testSamplingRate() {
  const {byId, enter, leave, say, asked} = steered();
  say({range: [0, 1], sampling_rate: 0});
  check(byId("rate").value === "automatic", `the rate in force: ${byId("rate").value}`);
  enter(byId("rate"), "4");
  enter(byId("rate"), "automatic");
  check(asked() === '[{"sampling_rate":4},{"sampling_rate":0}]', "sampling rates that are asked for");
  leave();
  say({range: [0, 1], sampling_rate: 0.5});
  check(byId("rate").value === "0.5", `a rate that the page doesn't offer: ${byId("rate").value}`);
}

function testRangeUpwards() {
  const {byId, enter, leave, panel, say, asked} = steered();
  say({range: [0, 1]});
  enter(byId("low"), 5);
  check(asked() === "[]" && !byId("rangenote").hidden, "a range whose ends don't ascend isn't asked for, and the panel says so");
  leave();
  say({range: [0, 1]});
  check(byId("low").value === "5", `an end that can't be asked for yet stays: ${byId("low").value}`);
  enter(byId("high"), 10);
  check(asked() === '[{"range":[5,10]}]' && byId("rangenote").hidden, "both ends are asked for together");
  say({range: [0, 1]});
  check(byId("low").value === "5", "the fields stay while the user is in one of them");
  leave();
  say({range: [5, 10]});
  check(byId("low").value === "5" && byId("high").value === "10", "the range in force");
  enter(byId("low"), "");
  leave();
  panel.refresh();
  check(asked() === "[]" && byId("low").value === "5", `an emptied field: ${byId("low").value}`);
}

/** A page whose viewer shows each VDI that it gets, and whose only text is its message. */
function pageOf() {
  const {byId} = fields();
  Object.assign(globalThis, {location: {hash: ""}});
  /** @type {any} */
  const viewer = {camera: undefined, isLost: false, setVdi: async (/** @type {any} */ _, /** @type {() => boolean} */ isWanted) => isWanted(),
                  setCamera(/** @type {any} */ camera) { this.camera = camera; }};
  /** @type {any} */
  const page = Object.create(Page.prototype);
  Object.assign(page, {viewer, frame: 0, request: 0, plays: 0, notice: "", showFacts: () => {}, showView: () => {}});
  page.live = {live: {state: "live", isHeldBack: () => false}, close() { this.live.state = "closed"; }};
  return {page, viewer, message: () => byId("message").hidden ? "" : byId("message").textContent};
}

/** A VDI made from this place. */
const vdiFrom = (/** @type {number} */ x) => ({camera: {...CAMERA, position: [x, 0, 5]}, coloring: undefined, timeStep: 0, time: 0,
                                              segments: {byteLength: 0}, heads: {byteLength: 0}});

async function testFollowing() {
  const {page, viewer} = pageOf();
  const seen = () => viewer.camera.position[0];
  const give = async (/** @type {number} */ x) => page.takeLevel(vdiFrom(x), {frame: x});
  await give(0);
  await give(1);
  check(seen() === 1, "a view that hasn't moved follows a server's VDIs");
  page.setCamera({...CAMERA, position: [50, 0, 5]});
  await give(2);
  check(seen() === 50, "a view that has moved stays");
  page.goHome();
  for (let x = 3; x < 9; ++x) {  // VDIs come faster than the motion ends
    clock.pass(100);
    await give(x);
  }
  clock.pass(1000);
  check(seen() === 8, `As made reaches the newest VDI's viewpoint: ${seen()}`);
  await give(9);
  check(seen() === 9, "and follows it afterwards");
  page.setCamera({...CAMERA, position: [50, 0, 5]});
  page.goHome();
  clock.pass(100);
  page.setCamera({...CAMERA, position: [60, 0, 5]});
  await give(10);
  clock.pass(1000);
  check(seen() === 60, "a user who moves the view ends the motion");

  // Files, and a page that `vdi export` makes.
  page.live = undefined;
  page.source = {count: 3, nameOf: () => "", load: async (/** @type {number} */ frame) => vdiFrom(frame)};
  page.setCamera(page.vdi.camera);
  await page.show(0);
  await page.show(1);
  check(seen() === 1, `a view that hasn't moved follows a file's VDIs: ${seen()}`);
  page.setCamera({...CAMERA, position: [50, 0, 5]});
  await page.show(2);
  check(seen() === 50, "a view that has moved stays while files change");
}

/** A wrong file that is dropped onto a server's page. */
async function testWrongFile() {
  const {page, viewer, message} = pageOf();
  const drop = (/** @type {string} */ name) => page.openFiles([{name, slice: () => new Blob([]), arrayBuffer: async () => new ArrayBuffer(8)}]);
  let isSound = false;
  page.decoder = {requireFits: () => {}, decode: async () => {
    if (!isSound) throw new Error("invalid .vdi file: it is too short");
    return vdiFrom(70);
  }};
  await page.takeLevel(vdiFrom(0), {frame: 0});
  let wrong = drop("photo.png");
  const level = page.takeLevel(vdiFrom(1), {frame: 1});
  await wrong;
  check(message().includes("invalid .vdi file"), `a wrong file: ${message()}`);
  check(await level && page.frame === 1 && page.live.live.state === "live" && !page.source, "the server's frames continue");
  check(message().includes("invalid .vdi file"), "the message can be read");
  clock.pass(6000);
  check(message() === "", `the message goes: ${message()}`);

  // While a level is on its way to the GPU.
  const {setVdi} = viewer;
  let arrive = () => {};
  viewer.setVdi = async (/** @type {any} */ vdi, /** @type {() => boolean} */ isWanted) => {
    await new Promise((resolve) => arrive = () => resolve(0));
    return setVdi(vdi, isWanted);
  };
  const next = page.takeLevel(vdiFrom(2), {frame: 2});
  await 0;
  viewer.setVdi = setVdi;
  wrong = drop("photo.png");
  arrive();
  await wrong;
  check(await next && page.frame === 2, "a level that was on its way is shown after all");

  isSound = true;
  await drop("sound.vdi");
  check(page.live.live.state === "closed" && page.source && viewer.camera.position[0] === 70, "a sound file takes the server's place");
  check(!await page.takeLevel(vdiFrom(3), {frame: 3}), "and no late level that of the file");
  page.live.live.state = "waiting";
  page.notice = "";
  document.getElementById("message").textContent = "a failure";
  document.getElementById("message").hidden = false;
  await page.takeLevel(vdiFrom(4), {frame: 4});
  check(message() === "" && !page.source, "a frame takes the place of an earlier message");
}

testRest();
await testRestWithFrames();
await testScreenshot();
testRoll();
testPan();
testZoom();
testFarFromTheOrigin();
testNumbers();
testTicks();
testNumbersOfThePanel();
testRangeUpwards();
testSamplingRate();
await testFollowing();
await testWrongFile();
finish();
