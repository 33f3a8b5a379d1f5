// The page's end of the stream on sound, damaged and hostile messages, without a network. The
// messages go to the decoder of messages, or to a connection over this test's fake sockets. With
// VDI_FUZZ_SECONDS=600, it goes on with other damage for that time.
import {setFlagsFromString} from "node:v8";
import {runInNewContext} from "node:vm";

import {Live, rateOf} from "../../web/live.js";
import {LivePanel, liveText} from "../../web/livepanel.js";
import {LevelAssembler, StreamError, extendedSeries, serverMessageOf} from "../../web/messages.js";
import {check, finish, randomFrom} from "./check.mjs";

const random = randomFrom(2023);

/** @returns {any} a function's result, or "refused" for a StreamError of one line */
function outcome(/** @type {() => any} */ act) {
  try {
    return act();
  } catch (error) {
    if (error instanceof StreamError && !error.message.includes("\n")) return "refused";
    throw error;
  }
}

const level = {type: "level", frame: 7, level: 0, levels: 2, bytes: 700000, width: 640, height: 360, step: 12, time: 0.5, age: 0.25,
               dropped: 3};
const welcome = {type: "welcome", version: 1, session: "abc", steer: false, viewers: 2,
                 series: {times: [0, null, 0.5], steps: [0, 1, 2]}};

const steering = {type: "steering", you: 2, driver: null, period: 1, paused: false,
                  parameters: [{name: "feed", whole: false, value: 0.037, low: 0, high: 0.1}],
                  generator: {resolution: [640, 360], supersegments: 25, range: [0, 0.5], presets: ["X Ray"]}};

function part(frame, index, offset, bytes) {
  const message = new Uint8Array(16 + bytes.length);
  const view = new DataView(message.buffer);
  view.setUint32(0, frame, true);
  view.setUint32(4, index, true);
  view.setUint32(8, offset % 0x100000000, true);
  view.setUint32(12, Math.floor(offset / 0x100000000), true);
  message.set(bytes, 16);
  return message.buffer;
}

function testTexts() {
  check(serverMessageOf(JSON.stringify(level)).type === "level", "a level");
  const series = serverMessageOf(JSON.stringify(welcome));
  check(series.type === "welcome" && series.series?.times[1] === null && series.series.steps.length === 3, "a welcome with a series");
  check(serverMessageOf(JSON.stringify({...welcome, series: null})).series === null, "a welcome without a series");
  check(series.pulse === 0 && serverMessageOf(JSON.stringify({...welcome, pulse: 15})).pulse === 15, "a server's pulse");
  check(serverMessageOf('{"type":"driver","you":true}').type === "other", "a kind that the page has no use for");
  const told = serverMessageOf(JSON.stringify(steering));
  check(JSON.stringify(told) === JSON.stringify(steering), "the state of steering");
  check(serverMessageOf(JSON.stringify({...steering, driver: 7, generator: null})).driver === 7, "somebody drives");
  const many = serverMessageOf(JSON.stringify({...steering, generator: {...steering.generator, supersegments: 1024}}));
  check(many.type === "steering" && many.generator?.supersegments === 1024, "as many supersegments as a run may have");
  const sampled = {...steering, generator: {...steering.generator, sampling_rate: 0.5}};
  check(JSON.stringify(serverMessageOf(JSON.stringify(sampled))) === JSON.stringify(sampled), "a sampling rate");
  const named = {...steering, generator: {...steering.generator, preset: "X Ray"}};
  check(JSON.stringify(serverMessageOf(JSON.stringify(named))) === JSON.stringify(named), "the colour map in force");
  check(serverMessageOf('{"type":"denied","cause":"viewer 2\\ndrives"}').cause === "viewer 2 drives", "a denial of one line");
  const missing = serverMessageOf('{"type":"missing","frame":3,"cause":"damaged\\nor gone"}');
  check(JSON.stringify(missing) === '{"type":"missing","frame":3,"cause":"damaged or gone"}', "a frame that is missing");
  const {generator} = steering;
  const bad = [
    {...steering, you: -1}, {...steering, driver: "2"}, {...steering, period: 0}, {...steering, parameters: {}},
    {...steering, parameters: [null]}, {...steering, parameters: [{name: "a", value: 2, low: 0, high: 1}]},
    {...steering, parameters: [{name: 5, value: 0, low: 0, high: 1}]}, {...steering, generator: {}},
    {...steering, parameters: Array(65).fill(steering.parameters[0])}, {...steering, generator: {...generator, range: [1, 1]}},
    {...steering, generator: {...generator, resolution: [1e9, 1]}}, {...steering, generator: {...generator, presets: [5]}},
    {...steering, generator: {...generator, supersegments: 1025}},
    {...steering, generator: {...generator, sampling_rate: "2"}}, {...steering, generator: {...generator, sampling_rate: 65}},
    {...steering, generator: {...generator, sampling_rate: 0.01}}, {...steering, generator: {...generator, sampling_rate: -0.5}},
    "", "{", "[]", "null", "1", '"x"', "{}", '{"type":3}', "x".repeat((1 << 20) + 1),
    {...level, frame: -1}, {...level, frame: 2 ** 32}, {...level, frame: "7"}, {...level, level: 2}, {...level, levels: 1e9},
    {...level, bytes: 0}, {...level, bytes: 2 ** 40}, {...level, bytes: 1.5}, {...level, bytes: null}, {...level, width: 0},
    {...level, height: 1e6}, {...level, step: "x"}, {...level, time: {}}, {...level, age: "old"},
    {...welcome, pulse: "15"}, {...welcome, pulse: -1}, {...welcome, pulse: 1e9}, {...welcome, version: "1"}, {...welcome, session: 3}, {...welcome, series: {times: [1], steps: []}},
    {...welcome, series: {times: ["x"], steps: [1]}}, {...welcome, series: 5}, {...welcome, series: {times: [1], steps: [-1]}},
    {type: "state", state: "asleep", viewers: 1}, {type: "state", state: "live", viewers: 1, cause: 5}, {type: "error"}, {type: "missing", cause: "why"}, {type: "missing", frame: 1},
    {type: "missing", frame: -1, cause: "why"}, {type: "series", from: 3, times: 1, steps: 1},
  ];
  for (const message of bad) {
    const text = typeof message === "string" ? message : JSON.stringify(message);
    check(outcome(() => serverMessageOf(text)) === "refused", `${text.slice(0, 100)} is taken`);
  }
  const sound = [level, welcome, steering, sampled, {type: "state", state: "live", viewers: 1, cause: "why"},
                 {type: "error", cause: "why"}, {type: "missing", frame: 3, cause: "why"}].map((m) => JSON.stringify(m));
  const end = performance.now() + 1000 * Number(process.env.VDI_FUZZ_SECONDS ?? 0);
  for (let round = 0; round < 20000 || performance.now() < end; ++round) {
    const text = [...sound[round % sound.length]];
    for (let i = 0; i < 1 + round % 3; ++i) {
      const at = random(text.length);
      if (random(3) === 0) text.splice(at, 1 + random(5));
      else text[at] = String.fromCharCode(32 + random(95));
    }
    outcome(() => serverMessageOf(text.join("")));
  }
  const first = {times: [0, 1], steps: [0, 1]};
  const more = extendedSeries(first, {type: "series", from: 2, times: [2], steps: [2]});
  check(more.steps.join() === "0,1,2", "more of a series");
  for (const from of [0, 1, 3, NaN])
    check(outcome(() => extendedSeries(first, {type: "series", from, times: [2], steps: [2]})) === "refused", `a series from ${from} on`);
}

/** Levels in parts of any size come out unchanged. All else is refused, and memory is bounded. */
function testParts() {
  for (let round = 0; round < 300; ++round) {
    const bytes = 1 + random(round < 20 ? 3 << 20 : 5000);
    const file = Uint8Array.from({length: bytes}, (_, i) => (i * 31 + round) & 255);
    const assembler = new LevelAssembler();
    const begin = () => assembler.begin({...level, frame: round, level: 1, bytes});
    begin();
    const kind = round % 6;
    let got;
    for (let at = 0; at < bytes;) {
      const end = Math.min(at + 1 + random(262144), bytes);
      const sound = part(round, 1, at, file.subarray(at, end));
      if (random(4) === 0) {
        const damaged = [part(round, 1, at + 1, file.subarray(at, end)), part(round, 0, at, file.subarray(at, end)),
                         part(round + 1, 1, at, file.subarray(at, end)), new ArrayBuffer(random(17)),
                         part(round, 1, 2 ** 40 + at, file.subarray(at, end)),
                         part(round, 1, at, new Uint8Array(bytes - at + 1))][kind];
        check(outcome(() => assembler.add(damaged)) === "refused", `damage ${kind} is taken`);
      }
      got = assembler.add(sound);
      check(assembler.room.length <= Math.max(2 * end, 1 << 20), "a buffer larger than the received bytes allow");
      at = end;
    }
    check(got?.length === bytes && got.every((byte, i) => byte === file[i]), `a level of ${bytes} bytes`);
    check(outcome(() => assembler.add(part(round, 1, 0, file))) === "refused", "a level that comes once more");
    begin();
    assembler.add(part(round, 1, 0, file.subarray(0, Math.ceil(bytes / 2))));
    assembler.begin({...level, bytes});
    check(assembler.received === 0, "another level's beginning ends one");
    assembler.drop();
    check(outcome(() => assembler.add(part(round, 1, 0, file))) === "refused", "a part of no level");
  }
  const assembler = new LevelAssembler();
  assembler.begin({...level, bytes: 1 << 30});
  check(assembler.room.length <= 1 << 20, "a level that is only announced takes no memory");
}

/** A socket that records messages, and delivers the test's. */
class FakeSocket {
  constructor() {
    /** @type {any[]} */
    this.sent = [];
    this.readyState = 1;
    this.binaryType = "blob";
    this.onopen = this.onmessage = this.onclose = /** @type {any} */ (null);
  }
  send(/** @type {string} */ text) { this.sent.push(JSON.parse(text)); }
  close() { this.readyState = 3; }
  open() { this.onopen({}); }
  text(/** @type {object} */ message) { this.onmessage({data: JSON.stringify(message)}); }
  bytes(/** @type {ArrayBuffer} */ message) { this.onmessage({data: message}); }
  end(/** @type {number} */ code) { this.readyState = 3; this.onclose({code}); }
}

const soon = (milliseconds = 0) => new Promise((resolve) => setTimeout(resolve, milliseconds));
/** Waits until the decoder has no work left, however slow the machine is. */
const settled = async (/** @type {Live} */ live) => {
  await soon(20);
  while (live.isDecoding) await soon(5);
};

/** A connection whose decoder takes `decodeMs` milliseconds, and a file's first byte for the VDI. */
function connection(decodeMs = 5) {
  /** @type {FakeSocket[]} */
  const sockets = [];
  /** @type {number[]} */
  const shown = [];
  const live = new Live({
    token: "secret",
    open: () => {
      sockets.push(new FakeSocket());
      return /** @type {any} */ (sockets[sockets.length - 1]);
    },
    decode: async (file) => {
      await soon(decodeMs);
      if (file[0] === 255) throw new Error("invalid .vdi file");
      return /** @type {any} */ (file[0]);
    },
    onLevel: (vdi) => shown.push(/** @type {any} */ (vdi)) > 0,
    onChange: () => {},
  });
  live.restart();
  return {live, sockets, shown};
}

/** The socket opens, and a server that has no series answers. `more` replaces fields of its welcome. */
function greet(/** @type {FakeSocket} */ socket, /** @type {object} */ more = {}) {
  socket.open();
  socket.text({...welcome, series: null, ...more});
}

function sendLevel(/** @type {FakeSocket} */ socket, /** @type {number} */ frame, /** @type {number} */ index, /** @type {number} */ byte) {
  socket.text({...level, frame, level: index, bytes: 4});
  socket.bytes(part(frame, index, 0, new Uint8Array([byte, 0, 0, 0])));
}

async function testConnection() {
  const {live, sockets, shown} = connection();
  sockets[0].open();
  const hello = sockets[0].sent[0];
  check(hello.type === "hello" && hello.version === 1 && hello.token === "secret" && hello.have === null, "hello");
  sockets[0].text({...welcome, series: null});
  check(live.state === "waiting", "welcome without frames");
  sendLevel(sockets[0], 7, 0, 1);
  await settled(live);
  sendLevel(sockets[0], 7, 1, 2);
  await settled(live);
  check(shown.join() === "1,2" && live.state === "live", `levels in their order, not ${shown}`);
  const ends = sockets[0].sent.filter((m) => m.type === "ack");
  check(ends.length === 2 && ends[1].frame === 7 && ends[1].level === 1 && ends[1].bytes === 4, "acknowledgements of levels' ends");

  // The page shows only the newest of the levels that arrive while it decodes one.
  for (let i = 3; i < 9; ++i) sendLevel(sockets[0], 8 + i, 0, i);
  await soon(60);
  check(shown.join() === "1,2,3,8", `newest wins: ${shown}`);

  sendLevel(sockets[0], 30, 0, 255);
  await settled(live);
  check(live.state === "live" && live.cause !== "" && live.shown?.frame === 16, "a damaged file costs nothing but itself");
  sendLevel(sockets[0], 31, 1, 9);
  await settled(live);
  check(live.cause === "" && live.shown?.frame === 31, "the frame after a damaged file is shown");

  // Acknowledgements of a large level.
  sockets[0].text({...level, frame: 32, bytes: 3 << 20});
  for (let at = 0; at < 2 << 20; at += 1 << 18) sockets[0].bytes(part(32, 0, at, new Uint8Array(1 << 18)));
  const acks = sockets[0].sent.filter((m) => m.type === "ack" && m.frame === 32).map((m) => m.bytes);
  check(acks.join() === [1, 2, 3, 4].map((i) => i << 19).join(), `an acknowledgement each 512 KiB: ${acks}`);

  live.close();
}

/** The server disappears, comes back as the same one, and then as another. */
async function testLostConnection() {
  const {live, sockets} = connection();
  greet(sockets[0]);
  sendLevel(sockets[0], 31, 1, 9);
  await settled(live);
  sockets[0].text({...level, frame: 32, bytes: 3 << 20});
  for (let at = 0; at < 2 << 20; at += 1 << 18) sockets[0].bytes(part(32, 0, at, new Uint8Array(1 << 18)));
  sockets[0].end(1006);
  check(live.state === "lost" && live.retryAt > 0, "a lost connection");
  await soon(700);
  check(sockets.length === 2, "a lost connection is made again");
  sockets[1].open();
  check(sockets[1].sent[0].have === 31 && sockets[1].sent[0].session === "abc",
        "a new connection says which frame the page has");
  sockets[1].text({...welcome, session: "other"});
  check(live.shown === undefined, "another server's frames are counted anew");
  sockets[1].bytes(part(32, 0, 2 << 20, new Uint8Array(9)));
  check(live.state === "lost" && sockets[1].readyState === 3, "a part of a level that was lost ends the connection");
  sockets[1].text({...level, frame: 99});
  check(live.assembler.level === undefined, "what comes after the end begins no level");
  const wait = live.retryAt - performance.now();
  check(wait > 600 && wait <= 1000, `the second attempt waits for longer: ${wait}`);
  live.close();
}

async function testRefusals() {
  const {live, sockets} = connection();
  live.restart("new");
  sockets[1].open();
  check(sockets[1].sent[0].token === "new", "another token");
  sockets[1].text({type: "error", cause: "the token is wrong"});
  sockets[1].end(4401);
  check(live.state === "refused" && live.cause.includes("token"), "a wrong token");
  await soon(700);
  check(sockets.length === 2, "a wrong token isn't tried again");
  live.restart();
  sockets[2].open();
  sockets[2].text({...welcome, version: 2});
  check(live.state === "refused" && live.cause.includes("version 2"), "another version");
  live.restart();
  sockets[3].text("noise");
  check(live.state === "lost", "noise");
  live.close();
  await soon(1500);
  check(sockets.length === 4 && live.state === "closed", "a closed connection stays closed");
}

/** A connection that breaks silently reports nothing. The page notices the silence. */
async function testSilence() {
  const pulse = 0.1;
  const {live, sockets} = connection();
  greet(sockets[0], {pulse});
  sockets[0].text({type: "state", state: "live", viewers: 1});
  sockets[0].text({...level, frame: 8, bytes: 1 << 20});
  for (let at = 0; at < 15; ++at) {
    await soon(60);
    sockets[0].bytes(part(8, 0, at << 10, new Uint8Array(1 << 10)));
  }
  check(live.state === "live", `parts of a level are messages, too: ${live.state}`);
  await soon(450);
  check(live.state === "live", "the page looks a second time");
  sockets[0].text({type: "state", state: "live", viewers: 1});
  await soon(300);
  check(live.state === "live", "a message that comes before the second look");
  await soon(450);
  check(live.state === "lost" && live.cause === "the server doesn't answer", `a connection that breaks: ${live.state}`);
  await soon(500);
  greet(sockets[1]);
  await soon(800);
  check(live.state === "waiting", `a server that promises no pulse may be silent: ${live.state}`);
  live.close();
}

/** The decoder takes a level late, while the next one arrives. Acknowledgements of the next one go on. */
async function testLateDecoder() {
  const {live, sockets} = connection(50);
  greet(sockets[0]);
  const give = (/** @type {number} */ index, /** @type {number} */ from, /** @type {number} */ to) => {
    for (let at = from; at < to; at += 1 << 18) sockets[0].bytes(part(8, index, at, new Uint8Array(1 << 18)));
  };
  const acks = (/** @type {number} */ index) =>
    sockets[0].sent.filter((m) => m.type === "ack" && m.frame === 8 && m.level === index).map((m) => m.bytes >> 10).join();
  sendLevel(sockets[0], 7, 0, 1);
  sockets[0].text({...level, frame: 8, level: 0, bytes: 1 << 20});
  give(0, 0, 1 << 20);
  sockets[0].text({...level, frame: 8, level: 1, bytes: 4 << 20});
  give(1, 0, 1 << 18);
  check(acks(0) === "512", `the end of a level that waits isn't acknowledged: ${acks(0)}`);
  await soon(80);
  check(acks(0) === "512,1024", `the end of a level is acknowledged once the decoder takes it: ${acks(0)}`);
  give(1, 1 << 18, 1 << 20);
  check(acks(1) === "512,1024", `the next level's acknowledgements go on: ${acks(1)}`);
  live.close();
}

/** A level that is decoded after its server has gone is shown, and leaves cause and attempts as they are. */
async function testLateLevel() {
  for (const byte of [1, 255]) {
    const {live, sockets, shown} = connection(200);
    sockets[0].open();
    sockets[0].text({...welcome, series: null});
    live.failures = 3;
    sendLevel(sockets[0], 7, 1, byte);
    sockets[0].end(1006);
    const {cause, failures} = live;
    await settled(live);
    check(shown.join() === (byte === 1 ? "1" : "") && live.state === "lost", `a level after a loss: ${shown}, ${live.state}`);
    check(live.cause === cause && cause !== "" && live.failures === failures,
          `a level that ends after the loss keeps its cause: "${live.cause}", ${live.failures} failures`);
    live.close();
  }
}

async function testSeries() {
  const {live, sockets} = connection();
  live.wanted = 3;
  greet(sockets[0], {series: welcome.series});
  const wishes = () => sockets[0].sent.filter((m) => m.type !== "hello" && m.type !== "ack").map((m) => m.type + (m.index ?? "")).join();
  check(wishes() === "", "a frame that doesn't exist yet isn't asked for");
  sockets[0].text({type: "series", from: 3, times: [1], steps: [3]});
  check(wishes() === "show3", "a frame is asked for once it exists");
  sendLevel(sockets[0], 3, 1, 1);
  await settled(live);
  live.pause();
  live.show(1);
  live.follow();
  check(wishes() === "show3,pause,resume,show1,resume", `wishes: ${wishes()}`);
  live.close();
}

/** After a reconnect, a server sends the newest frame before it hears of the chosen one. */
async function testChosenFrame() {
  const {live, sockets, shown} = connection();
  greet(sockets[0], {series: welcome.series});
  live.show(1);
  sendLevel(sockets[0], 1, 1, 11);
  await settled(live);
  sockets[0].end(1006);
  live.connect();
  greet(sockets[1], {series: welcome.series});
  sendLevel(sockets[1], 2, 1, 21);
  await settled(live);
  check(shown.join() === "11" && live.shown?.frame === 1, `the newest frame isn't shown in place of the chosen one: ${shown}`);
  check(sockets[1].sent.some((m) => m.type === "ack" && m.frame === 2 && m.bytes === 4), "but it is acknowledged");
  sendLevel(sockets[1], 1, 1, 12);
  sockets[1].text({type: "missing", frame: 1, cause: "gone"});
  await settled(live);
  sendLevel(sockets[1], 2, 1, 22);
  await settled(live);
  check(shown.join() === "11,12,22", `the newest frame in place of one that is gone: ${shown}`);
  live.show(0);
  sendLevel(sockets[1], 2, 1, 24);
  await settled(live);
  check(shown.length === 3, "another frame than the chosen one");
  live.follow();
  await settled(live);
  check(shown.pop() === 24, "a frame that was put aside is shown once it is wanted, as the server won't send it again");
  live.shown = undefined;
  live.show(0);
  sendLevel(sockets[1], 2, 1, 25);
  sockets[1].text({type: "missing", frame: 0, cause: "gone"});
  await settled(live);
  check(shown.pop() === 25, "the newest frame where there is nothing else to show");
  live.wanted = 7;
  sendLevel(sockets[1], 2, 1, 23);
  await settled(live);
  check(shown.pop() === 23, "the newest frame while the series hasn't the chosen one");
  live.close();
}

/** A connection in pauses, with what the tests of these ask of it. */
function pausable() {
  const {live, sockets, shown} = connection();
  let socket = sockets[0];
  const begin = (/** @type {object} */ more) => {
    socket = sockets[sockets.length - 1];
    greet(socket, more);
  };
  begin({});
  return {
    live,
    socket: () => socket,
    /** Returns the frame that the page says it has. */
    reconnect: (/** @type {object} */ more) => {
      socket.end(1006);
      live.connect();
      begin(more);
      return socket.sent[0].have;
    },
    give: async (/** @type {number} */ frame, /** @type {number} */ index) => {
      sendLevel(socket, frame, index, 10 * frame + index);
      await settled(live);
    },
    asked: () => socket.sent.filter((m) => m.type === "pause" || m.type === "resume").map((m) => m.type).join(),
    acks: (/** @type {number} */ frame) => socket.sent.filter((m) => m.type === "ack" && m.frame === frame).length,
    seen: () => shown.splice(0).join(),
  };
}

/** A pause keeps the frame on show, and stops the server once that frame is full or can't become so. */
async function testPause() {
  const {live, socket, give, asked, acks, seen} = pausable();
  await give(1, 0);
  live.pause();
  check(asked() === "", "a paused coarse frame needs its finer levels");
  await give(1, 1);
  check(seen() === "10,11" && asked() === "pause", `a paused coarse frame gets its finer levels: ${asked()}`);
  await give(2, 0);
  await give(2, 1);
  check(seen() === "" && acks(2) === 2 && live.shown?.frame === 1, "another frame is acknowledged, and not shown");
  live.follow();
  await settled(live);
  check(seen() === "21" && asked() === "pause,resume",
        "another frame is shown after the pause, as the server won't send it again");

  await give(3, 0);
  live.pause();
  socket().text({...level, frame: 4, level: 0, bytes: 4});
  check(asked() === "pause,resume,pause", `the server has gone on to another frame: ${asked()}`);
  socket().bytes(part(4, 0, 0, new Uint8Array([40, 0, 0, 0])));
  await settled(live);
  check(seen() === "30" && acks(4) === 1, "another frame is acknowledged, and kept off in the pause");

  live.follow();
  await give(5, 0);
  check(seen() === "40,50", "the level held back, then the next frame");
  sendLevel(socket(), 7, 0, 70);
  live.pause();
  await settled(live);
  check(seen() === "" && live.shown?.frame === 5, "a pause keeps off the level that the decoder works on");
  live.show(7);
  await settled(live);
  check(seen() === "70" && !live.isPaused, "a frame that was held back is asked for");

  live.pause();
  sendLevel(socket(), 7, 1, 71);
  sendLevel(socket(), 8, 0, 80);
  await soon(30);
  check(seen() === "71", "the finer level that waits outlives another frame's");
  live.close();
}

/** A pause goes on over a new connection. A coarse frame may still become full, and a full one stays. */
async function testPauseAndReconnect() {
  const {live, reconnect, give, asked, acks, seen} = pausable();
  await give(3, 0);
  live.pause();
  check(seen() === "30", "a coarse frame in a pause");
  check(reconnect({}) === null && asked() === "", "a coarse frame may become full after a reconnect");
  await give(5, 0);
  check(seen() === "" && acks(5) === 1 && asked() === "pause",
        "a newer frame after a reconnect is acknowledged, and not shown");
  live.follow();
  await give(5, 1);
  check(seen() === "50,51", "after the pause, the level held back is shown, then the next one");

  live.pause();
  check(reconnect({}) === 5 && asked() === "pause", `a full frame stays over a reconnect: ${asked()}`);
  await give(6, 0);
  check(seen() === "" && live.shown?.frame === 5,
        "a full frame stays, whatever comes before the server hears of the pause");
  check(reconnect({session: "other"}) === 5 && live.shown?.frame === 5 && asked() === "pause",
        "a full frame stays when a server starts anew");
  await give(5, 1);
  check(seen() === "" && acks(5) === 1, "a new server's frame of the same number isn't shown in the pause");
  check(reconnect({session: "other"}) === null, "the page doesn't say that it has the new server's frame");
  await give(5, 1);
  live.follow();
  check(live.shown === undefined, "the former run's frame counts for nothing after the pause");
  await settled(live);
  check(seen() === "51" && live.shown?.frame === 5, "the new run's frame follows");
  live.close();
}

/** A panel in a page without elements, whose decoder takes a file's first byte for the VDI. */
function panelOf() {
  /** @type {FakeSocket[]} */
  const sockets = [];
  const element = {dataset: {}, hidden: false, textContent: ""};
  Object.assign(globalThis, {
    document: {getElementById: () => element, addEventListener: () => {}}, location: {href: "http://localhost/"},
    window: {addEventListener: () => {}},
    WebSocket: class extends FakeSocket {
      constructor() {
        super();
        sockets.push(this);
      }
    },
  });
  /** @type {any} */
  const decoder = {decode: async (/** @type {{file: Uint8Array}} */ {file}) => {
    if (file[0] === 255) throw new Error("invalid .vdi file");
    return file[0];
  }};
  const panel = new LivePanel("secret", decoder, {
    show: async (vdi) => {
      if (/** @type {any} */ (vdi) === 254) throw new Error("the GPU can't hold it");
      return true;
    },
    tell: () => {}, onSeries: () => {}, onChange: () => {},
  });
  panel.start(undefined);
  return {panel, live: panel.live, sockets};
}

/** The line and the light of a run that is live, ends as it should, and is followed by another. */
async function testEndedRun() {
  const {panel, live, sockets} = panelOf();
  greet(sockets[0]);
  sockets[0].text({type: "state", state: "live", viewers: 1});
  sendLevel(sockets[0], 4, 0, 7);
  await settled(live);
  const line = liveText(live, performance.now());
  for (const [what, word] of [["state", "Live"], ["step", "step "], ["age", "s old"], ["level", "level 1 of 2"], ["rate", "MiB/s"]])
    check(line.includes(word), `the line of a live run has the ${what}: ${line}`);
  const light = () => document.getElementById("live")?.dataset.state;
  sockets[0].text({type: "state", state: "ended", viewers: 1});
  sockets[0].end(1001);
  check(liveText(live, 0).startsWith("Ended") && light() === "ended", `a run that has ended in order: ${liveText(live, 0)}, ${light()}`);
  check(panel.label() === "Connect", "the button looks for another run at once");
  await soon(700);
  check(sockets.length === 2 && light() === "ended", `the page looks for another run: ${sockets.length}, ${light()}`);
  greet(sockets[1], {session: "other"});
  check(liveText(live, 0).startsWith("Waiting"), `another run is there: ${liveText(live, 0)}`);
  sockets[1].end(1006);
  check(liveText(live, 0).startsWith("Not connected") && light() === "lost", `a run that is cut off: ${liveText(live, 0)}, ${light()}`);
  live.close();

  // A finished series whose server goes can't be played any more.
  const series = panelOf();
  greet(series.sockets[0], {series: welcome.series});
  series.sockets[0].text({type: "state", state: "ended", viewers: 1});
  series.sockets[0].end(1001);
  check(series.live.state === "lost" && !series.live.hasEnded, "a series whose server is gone isn't connected");
  series.live.close();
}

/** A relay whose source is gone. */
async function testLostSource() {
  const {live, sockets} = panelOf();
  greet(sockets[0]);
  sockets[0].text({type: "state", state: "live", viewers: 1});
  sendLevel(sockets[0], 4, 0, 7);
  await settled(live);
  const [line, light] = [() => liveText(live, performance.now()), () => document.getElementById("live")?.dataset.state];
  check(light() === "live", `a relay that gets frames: ${light()}`);
  sockets[0].text({type: "state", state: "waiting", viewers: 1, cause: "the source doesn't answer"});
  check(light() === "waiting" && line().includes("the source doesn't answer"), `a relay without a source: ${light()}, ${line()}`);
  sendLevel(sockets[0], 4, 1, 8);
  await settled(live);
  check(light() === "waiting" && line().includes("the source doesn't answer"), `a frame that the relay has kept: ${light()}, ${line()}`);
  sockets[0].text({type: "state", state: "live", viewers: 1});
  check(light() === "live" && !line().includes("source"), `the source is back: ${light()}, ${line()}`);
  live.close();
}

/** A request for a frame of a series ends, whatever happens to the frame. */
async function testMissingFrames() {
  const {panel, live, sockets} = panelOf();
  greet(sockets[0], {series: welcome.series});
  sockets[0].text({type: "state", state: "ended", viewers: 1});
  const ending = (/** @type {Promise<any>} */ shown) => Promise.race([shown, soon(300).then(() => "waits")]);

  let shown = panel.show(1);
  sockets[0].text({type: "missing", frame: 2, cause: "an answer to an earlier wish"});
  check(live.cause === "" && await Promise.race([shown, soon().then(() => "waits")]) === "waits", "another frame is missing");
  sockets[0].text({type: "missing", frame: 1, cause: "the file is damaged or gone"});
  check(await ending(shown) === "missed", `a frame whose file is gone: ${await ending(shown)}`);
  check(liveText(live, 0).includes("frame 2: the file is damaged or gone"), `the line says why: ${liveText(live, 0)}`);

  shown = panel.show(2);
  sendLevel(sockets[0], 2, 1, 7);
  check(await ending(shown) === "shown" && live.cause === "", `the next one: ${await ending(shown)}`);

  for (const [byte, cause] of /** @type {[number, string][]} */ ([[255, "invalid"], [254, "GPU"]])) {
    shown = panel.show(0);
    sendLevel(sockets[0], 0, 0, byte);
    check(await Promise.race([shown, soon(20).then(() => "waits")]) === "waits", "a finer level may still be sound");
    sendLevel(sockets[0], 0, 1, byte);
    check(await ending(shown) === "missed" && live.cause.includes(cause), `a level that can't be shown: ${await ending(shown)}`);
  }
  shown = panel.show(0);
  sendLevel(sockets[0], 0, 0, 7);
  await settled(live);
  sendLevel(sockets[0], 0, 1, 255);
  check(await ending(shown) === "shown", `the coarse level is on show: ${await ending(shown)}`);

  shown = panel.show(1);
  sockets[0].end(1006);
  check(await ending(shown) === "failed", `a lost connection: ${await ending(shown)}`);
  panel.close();
}

/** Frames leave no memory behind, however many come. */
async function testManyFrames() {
  setFlagsFromString("--expose-gc");
  const collect = runInNewContext("gc");
  const used = async () => {
    for (let i = 0; i < 3; ++i) {
      await soon(30);
      collect();
    }
    const {heapUsed, arrayBuffers} = process.memoryUsage();
    return heapUsed + arrayBuffers;
  };
  const {live, sockets, shown} = connection();
  greet(sockets[0]);
  const end = performance.now() + 1000 * Number(process.env.VDI_FUZZ_SECONDS ?? 0);
  let before = 0, frame = 0;
  for (; frame < 2000 || performance.now() < end; ++frame) {
    const bytes = 100000;
    sockets[0].text({...level, frame, bytes});
    sockets[0].bytes(part(frame, 0, 0, new Uint8Array(bytes)));
    sockets[0].sent.length = shown.length = 0;
    if (frame % 100 === 0) await soon(6);
    if (frame === 500) before = await used();
  }
  const growth = await used() - before;
  console.log(`${frame} frames: ${growth >> 10} KiB more`);
  check(growth < 1 << 20, "frames leave memory behind");
  live.close();
}

testTexts();
testParts();
await testManyFrames();
await testConnection();
await testLostConnection();
await testRefusals();
await testSilence();
await testLateDecoder();
await testLateLevel();
await testSeries();
await testChosenFrame();
await testPause();
await testPauseAndReconnect();
await testEndedRun();
await testLostSource();
await testMissingFrames();
check(Math.abs(rateOf(10000, [{at: 8000, bytes: 1000}, {at: 9000, bytes: 3000}, {at: 1000, bytes: 1e9}]) - 2000) < 1, "the rate");
finish();
