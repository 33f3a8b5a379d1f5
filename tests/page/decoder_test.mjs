// The page's decoder on sound, damaged and hostile files: it decodes, or throws FormatError. $1:
// vdi. With VDI_FUZZ_SECONDS=600, it continues with other damage for that time.
import {execFileSync, spawnSync} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";

import {Decoder, roomOfPage} from "../../web/decoder.js";
import {FormatError, decodeVdi} from "../../web/format.js";
import {lz4AnnouncedBytes, lz4Expand} from "../../web/lz4.js";
import {xxh64} from "../../web/xxh64.js";
import {check, finish, randomFrom} from "./check.mjs";

const vdi = process.argv[2];
const folder = mkdtempSync(join(tmpdir(), "vdi-decoder-"));
const fail = (/** @type {string} */ what) => check(false, what);

const random = randomFrom(12344);

function testChecksum() {
  // As xxhsum -H1 prints them.
  const known = [["", "ef46db3751d8e999"], ["a", "d24ec4f1a98c6e5b"], ["abc", "44bc2cf5ad770999"],
                 ["Nobody inspects the spammish repetition", "fbcea83c8a378bf1"]];
  for (const [text, sum] of known) {
    const {high, low} = xxh64(new TextEncoder().encode(text));
    const got = high.toString(16).padStart(8, "0") + low.toString(16).padStart(8, "0");
    if (got !== sum) fail(`xxh64 of "${text}" is ${got}, not ${sum}`);
  }
}

function testLz4() {
  const block = Uint8Array.from([0x12, 97, 1, 0, 0x50, 98, 99, 100, 101, 102]);  // a, six times itself, bcdef
  const plain = new Uint8Array(12);
  if (lz4AnnouncedBytes(block) !== 12 || !lz4Expand(block, plain) || String.fromCharCode(...plain) !== "aaaaaaabcdef")
    fail("an LZ4 block with a match");
  if (lz4Expand(Uint8Array.from([0x12, 97, 2, 0, 0x50, 98, 99, 100, 101, 102]), plain)) fail("a match before the beginning");
  if (lz4Expand(block, new Uint8Array(11)) || lz4Expand(block, new Uint8Array(13))) fail("a block of another size");
  for (let round = 0; round < 20000; ++round) {
    const noise = Uint8Array.from({length: random(40)}, () => random(256));
    const announced = lz4AnnouncedBytes(noise);
    if (announced > 0 && announced < 1e6) lz4Expand(noise, new Uint8Array(announced));
    lz4Expand(noise, new Uint8Array(random(100)));
  }
}

/** Gives a file the checksums that its bytes should have, so that damage gets further. */
function seal(/** @type {Uint8Array} */ bytes) {
  const view = new DataView(bytes.buffer);
  const put = (/** @type {number} */ at, /** @type {number} */ from, /** @type {number} */ to) => {
    if (to > bytes.length || from > to) return;
    const {high, low} = xxh64(bytes.subarray(from, to));
    view.setUint32(at, low, true);
    view.setUint32(at + 4, high, true);
  };
  const chunks = view.getUint32(40, true);
  const table = 240 + 16 * chunks;
  if (table > bytes.length) return;
  for (let c = 0, at = table; c < chunks; ++c) {
    const packed = view.getUint32(244 + 16 * c, true);
    put(248 + 16 * c, at, at + packed);
    at += packed;
  }
  put(224, 240, table);
  put(232, 0, 232);
}

/** @returns {Promise<string>} "sound", or the message of a FormatError */
async function outcome(/** @type {Uint8Array} */ bytes) {
  try {
    const decoded = await decodeVdi(bytes);
    const lists = decoded.width * decoded.height;
    if (decoded.offsets[lists] !== decoded.supersegmentCount) throw new Error("offsets don't end at the supersegments");
    return "sound";
  } catch (error) {
    if (error instanceof FormatError && !error.message.includes("\n")) return error.message;
    throw error;
  }
}

async function testDamage(/** @type {string} */ name, /** @type {Uint8Array} */ sound) {
  if (await outcome(sound) !== "sound") fail(`${name}: ${await outcome(sound)}`);
  const seen = new Set();
  for (let length = 0; length < sound.length; length += 1 + Math.floor(sound.length / 60)) {
    if (await outcome(sound.slice(0, length)) === "sound") fail(`${name} cut to ${length} bytes is sound`);
  }
  if (await outcome(Uint8Array.from([...sound, 0])) === "sound") fail(`${name} with a byte more is sound`);
  for (let round = 0; round < 1500; ++round) {
    const bytes = sound.slice();
    const header = round % 3 === 0;
    for (let i = 0; i < 1 + round % 4; ++i) bytes[random(header ? 240 : bytes.length)] ^= 1 << random(8);
    const sealed = round % 2 === 0;
    if (sealed) seal(bytes);
    const result = await outcome(bytes);
    seen.add(result.slice(0, 60));
    if (!sealed && result === "sound" && bytes.some((byte, i) => byte !== sound[i])) fail(`${name}: a flipped bit isn't seen`);
  }
  if (seen.size < 12) fail(`${name}: damage gave only ${[...seen].join("; ")}`);
}

/** Damage of any kind, most of it under right checksums, for as long as VDI_FUZZ_SECONDS says. */
async function fuzz(/** @type {Uint8Array[]} */ files) {
  const end = performance.now() + 1000 * Number(process.env.VDI_FUZZ_SECONDS ?? 1);
  let rounds = 0, sound = 0, most = 0;
  for (; performance.now() < end; ++rounds) {
    let bytes = files[random(files.length)].slice();
    for (let changes = 1 + random(4); changes > 0; --changes) {
      const at = random(2) === 0 ? random(bytes.length) : random(Math.min(bytes.length, 400));
      const piece = Uint8Array.from({length: random(12)}, () => [0, 1, 127, 128, 255, random(256)][random(6)]);
      const kind = random(6);
      if (kind === 0) bytes = Uint8Array.from([...bytes.subarray(0, at), ...bytes.subarray(at + piece.length)]);
      else if (kind === 1) bytes = Uint8Array.from([...bytes.subarray(0, at), ...piece, ...bytes.subarray(at)]);
      else if (kind === 2) bytes.set(piece.subarray(0, bytes.length - at), at);
      else bytes[at] ^= 1 << random(8);
      if (bytes.length < 300) break;
    }
    if (random(8) > 0 && bytes.length >= 240) seal(bytes);
    try {
      if (await outcome(bytes) === "sound") ++sound;
    } catch (error) {
      fail(`round ${rounds}: ${error}`);
      return;
    }
    if (rounds % 100 === 0) most = Math.max(most, process.memoryUsage().rss);
  }
  console.log(`${rounds} damaged files, ${sound} of them sound; ${most >> 20} MiB at most`);
  if (sound === 0 || sound === rounds || most > 1 << 30) fail("fuzzing");
}

const METADATA = {
  array: {name: "speed ü", association: "points", components: 1, component: 0}, range: [0.5, 11], time: 0, timeStep: 0,
  transferFunction: {colors: [[0, 0, 0, 1], [6, 0, 1, 0], [12, 1, 0, 0]], opacities: [[0, 0], [12, 1]], unitDistance: 1},
};

/** The file as version 3, with that text as its metadata. */
function withMetadata(/** @type {Uint8Array} */ file, /** @type {string} */ json) {
  const text = new TextEncoder().encode(json);
  const bytes = new Uint8Array(file.length + 16 + text.length);
  bytes.set(file);
  bytes.set(new TextEncoder().encode("JSON"), file.length);
  bytes.set(text, file.length + 16);
  const view = new DataView(bytes.buffer);
  const {high, low} = xxh64(text);
  view.setUint32(8, 3, true);
  view.setUint32(file.length + 4, text.length, true);
  view.setUint32(file.length + 8, low, true);
  view.setUint32(file.length + 12, high, true);
  seal(bytes);
  return bytes;
}

async function testMetadata(/** @type {Uint8Array} */ whole) {
  const view = new DataView(whole.buffer);
  const file = whole.slice(0, 240 + 16 * view.getUint32(40, true) + Number(view.getBigUint64(56, true)));  // without its own
  const sound = withMetadata(file, JSON.stringify(METADATA));
  const {coloring} = await decodeVdi(sound);
  if (coloring?.array.name !== "speed ü" || coloring.transferFunction.colors.length !== 3) fail("metadata");
  await testDamage("metadata", sound);
  const withMap = (/** @type {object} */ changes) =>
    JSON.stringify({...METADATA, transferFunction: {...METADATA.transferFunction, ...changes}});
  const bad = ["", "{", "[]", "null", "{}", JSON.stringify({...METADATA, range: [1]}), JSON.stringify({...METADATA, array: 3}),
               JSON.stringify({...METADATA, range: [2, 1]}), withMap({colors: [[1, 2]]}), withMap({colors: []}),
               withMap({opacities: []}), withMap({colors: [[0, 0, 0, 1.001]]}), withMap({colors: [[0, -0.1, 0, 1]]}),
               withMap({opacities: [[0, 2]]}), withMap({opacities: [[1, 0], [0, 1]]}), withMap({unitDistance: 0}),
               withMap({}).replace('"unitDistance":1', '"unitDistance":1e999')];
  for (const text of [...bad, withMap({}), withMap({colors: [[5, 1, 0.5, 0]]})]) {
    const bytes = withMetadata(file, text);
    const name = join(folder, "metadata.vdi");
    writeFileSync(name, bytes);
    const isSound = spawnSync(vdi, ["info", name]).status === 0;
    if (isSound === bad.includes(text)) fail(`the tool takes metadata ${text}: ${isSound}`);
    if ((await outcome(bytes) === "sound") !== isSound) fail(`the page takes metadata ${text} otherwise than the tool`);
  }
}

/** A small file of side * side empty lists, in the manner of `file`. */
function emptyLists(/** @type {Uint8Array} */ file, /** @type {number} */ side) {
  const perChunk = 4096, lists = side * side, count = Math.ceil(lists / perChunk);
  const code = [0, 0, 128, 63, 111, 18, 131, 58];  // depths begin at 1, in steps of 0.001
  const chunks = [perChunk, lists - (count - 1) * perChunk].map((length) => {
    const match = 8 + 4 * length - 9 - 5 - 4 - 15;  // zeros after the first one and before the last five
    return [0x9f, ...code, 0, 1, 0, ...Array(Math.floor(match / 255)).fill(255), match % 255, 0x50, 0, 0, 0, 0, 0];
  });
  const table = 240 + 16 * count, bytes = new Uint8Array(table + chunks[0].length * (count - 1) + chunks[1].length);
  bytes.set(file.subarray(0, 240));
  const view = new DataView(bytes.buffer);
  view.setUint32(8, 1, true);
  [side, side, 8, perChunk, count].forEach((value, i) => view.setUint32(24 + 4 * i, value, true));
  view.setBigUint64(48, 0n, true);
  view.setBigUint64(56, BigInt(bytes.length - table), true);
  for (let c = 0, at = table; c < count; ++c) {
    const chunk = chunks[c + 1 < count ? 0 : 1];
    view.setUint32(244 + 16 * c, chunk.length, true);
    bytes.set(chunk, at);
    at += chunk.length;
  }
  seal(bytes);
  return bytes;
}

/** A VDI that takes too much memory, or more than a texture holds, is refused before memory is allocated. */
async function testRoom(/** @type {Uint8Array} */ file) {
  const bytes = file.slice(0, 240);
  const view = new DataView(bytes.buffer);
  const decoder = Object.assign(Object.create(Decoder.prototype), {room: roomOfPage()});
  const refusal = (/** @type {number} */ width, /** @type {number} */ height, /** @type {number} */ supersegments) => {
    const chunks = Math.ceil(width * height / 4096);
    [width, height].forEach((side, i) => view.setUint32(24 + 4 * i, side, true));
    view.setUint32(36, 4096, true);
    view.setUint32(40, chunks, true);
    view.setUint32(48, supersegments, true);
    view.setBigUint64(56, 0n, true);
    view.setUint32(8, 1, true);
    const {high, low} = xxh64(bytes.subarray(0, 232));
    view.setUint32(232, low, true);
    view.setUint32(236, high, true);
    try {
      decoder.requireFits(bytes, 240 + 16 * chunks);
      return "";
    } catch (error) {
      return /** @type {Error} */ (error).message;
    }
  };
  if (refusal(3840, 2160, 40e6) !== "") fail(`a VDI of 4K: ${refusal(3840, 2160, 40e6)}`);
  if (!refusal(14000, 14000, 0).includes("3.7 GiB")) fail(`many empty lists: ${refusal(14000, 14000, 0)}`);
  if (!refusal(1920, 1080, 400e6).includes("supersegments, which take 3.0 GiB")) fail(`many supersegments: ${refusal(1920, 1080, 400e6)}`);
  decoder.room = {...decoder.room, elements: 1e6};
  if (!refusal(1920, 1080, 0).includes("a texture of this GPU holds 1,000,000")) fail(`a small GPU: ${refusal(1920, 1080, 0)}`);
  // Commands that make and serve pages refuse it, too.
  const large = join(folder, "large.vdi");
  writeFileSync(large, emptyLists(file, 10000));
  for (const words of [["serve", large], ["export", large, "-o", join(folder, "large.html")]]) {
    const {status, stderr} = spawnSync(vdi, words, {timeout: 60000});
    if (status !== 1 || !String(stderr).includes("100000000 lists and 0 supersegments take 1.9 GiB of at most 1.5")) fail(`${words}: ${stderr}`);
  }
  let asked = 0;
  const isAsked = await decodeVdi(file, () => {
    ++asked;
    throw new Error("too large");
  }).then(() => false, (error) => error.message === "too large");
  if (!isAsked || asked !== 1) fail("the decoder doesn't ask whether there is room");
}

/** Lists of as many supersegments as a run may have: more than fit a byte. */
async function testDeepLists() {
  const file = join(folder, "deep.vdi");
  execFileSync(vdi, ["generate", "--field", "shells", "--size", "8x8x16", "--copies", "1x1x40", "--joint", "cells",
                     "--blocks", "1x1x1", "--azimuth", "0", "--elevation", "0", "--parallel", "--zoom", "40",
                     "--resolution", "12x12", "--supersegments", "1024", "-o", file], {stdio: "ignore"});
  const {budget, offsets} = await decodeVdi(new Uint8Array(readFileSync(file)));
  let most = 0;
  for (let i = 1; i < offsets.length; ++i) most = Math.max(most, offsets[i] - offsets[i - 1]);
  if (budget !== 1024 || most !== 1024) fail(`lists of ${most} supersegments where ${budget} are allowed`);
}

const small = ["--size", "12x10x8", "--resolution", "24x18", "--supersegments", "4"];
const kinds = {compact: [], full: ["--precision", "full"], margin: ["--margin", "0.5", "--zoom", "2"]};
const files = [];
for (const [name, more] of Object.entries(kinds)) {
  const file = join(folder, `${name}.vdi`);
  execFileSync(vdi, ["generate", "--field", "turbulence", ...small, ...more, "-o", file], {stdio: "ignore"});
  const bytes = new Uint8Array(readFileSync(file));
  files.push(bytes);
  await testDamage(name, bytes);
  if (name === "compact") {
    await testMetadata(bytes);
    await testRoom(bytes);
  }
}
await testDeepLists();
testChecksum();
testLz4();
await fuzz(files);
rmSync(folder, {recursive: true});
finish();
