// Shows a VDI in a canvas, in two steps. `drawPicture` renders the VDI to a picture of its own, in
// strips and at any resolution. `present` puts background, outline and that picture on the canvas.

import {basisOf, clipMatrix, pixelSizeOf, raysOf, toView} from "./camera.js";
import {REGION, cullShader} from "./cull.js";
import {largestPicture, makeArrayTexture, makeProgram, tilingOf} from "./gl.js";
import {MOST_CLIP_PLANES, WHOLE_PICTURE, traverseShader} from "./traverse.js";
import {dot, normalize} from "./vector.js";

/** @typedef {import("./format.js").Camera} Camera */
/** @typedef {import("./decoder.js").PreparedVdi} PreparedVdi */
/** @typedef {import("./format.js").Vec3} Vec3 */
/** @typedef {[number, number, number]} Color shares of red, green and blue */
/** @typedef {{origin: Vec3, normal: Vec3}} ClipPlane hides the side away from which its normal points; world */

const COPY = `#version 300 es
precision highp float;
uniform sampler2D picture;
uniform vec2 part;        // part of the texture that the picture fills
uniform vec2 canvasSize;
out vec4 color;
void main() { color = texture(picture, min(gl_FragCoord.xy / canvasSize * part, part - 0.5 / vec2(textureSize(picture, 0)))); }
`;

const LINES = `#version 300 es
uniform mat4 clip;
in vec3 offset;
void main() {
  gl_Position = clip * vec4(offset, 1.0);
  gl_Position.z = 0.0;
}
`;

const PLAIN = `#version 300 es
precision highp float;
uniform vec4 plain;
out vec4 color;
void main() { color = plain; }
`;

/** The 12 edges of a box: two corners, with bits for x, y, z; and two faces, as axis * 2 + side. */
const EDGES = [0, 1, 2].flatMap((axis) => [0, 1, 2, 3].map((i) => {
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
  const from = ((i & 1) << u) | ((i >> 1) << v);
  return {from, to: from | (1 << axis), faces: [2 * u + (i & 1), 2 * v + (i >> 1)]};
}));

/** @param {[Vec3, Vec3]} bounds @param {number} corner with bits for x, y, z @param {Vec3} origin @returns {Vec3} */
export function cornerOf(bounds, corner, origin) {
  return /** @type {Vec3} */ ([0, 1, 2].map((axis) => bounds[(corner >> axis) & 1][axis] - origin[axis]));
}

/**
 * Edges of the box as ends of lines, relative to the camera's position. An edge is in front if one
 * of its faces faces the camera. All material in the box is behind it.
 * @param {[Vec3, Vec3]} bounds
 * @param {Camera} camera
 * @param {boolean} inFront
 */
export function outlineEnds(bounds, camera, inFront) {
  const forward = basisOf(camera).forward;
  const seesFace = (/** @type {number} */ face) => {
    const axis = face >> 1, sign = (face & 1) === 1 ? 1 : -1;
    const towards = camera.parallel ? -forward[axis] : camera.position[axis] - bounds[face & 1][axis];
    return sign * towards > 0;
  };
  return EDGES.filter((edge) => edge.faces.some(seesFace) === inFront)
              .flatMap((edge) => [...cornerOf(bounds, edge.from, camera.position), ...cornerOf(bounds, edge.to, camera.position)]);
}

/** @typedef {{vdi: PreparedVdi, textures: (WebGLTexture | null)[], uploads: (() => void)[]}} Loaded */

/**
 * Textures of arrays, with as many words per element as stated, and the uploads that complete them.
 * Throws Error if the GPU can't hold all of them.
 * @param {WebGL2RenderingContext} gl
 * @param {[Uint32Array, 1 | 2 | 4][]} arrays
 */
function makeTextures(gl, arrays) {
  const tiling = tilingOf(gl);
  /** @type {ReturnType<typeof makeArrayTexture>[]} */
  const made = [];
  try {
    for (const [words, perElement] of arrays) made.push(makeArrayTexture(gl, words, perElement, tiling));
  } catch (error) {
    for (const {texture} of made) gl.deleteTexture(texture);
    throw error;
  }
  return {textures: made.map(({texture}) => texture), uploads: made.flatMap(({uploads}) => uploads)};
}

/**
 * A VDI's textures, and the uploads that complete them. There are none while the context is lost.
 * @param {WebGL2RenderingContext} gl
 * @param {PreparedVdi} vdi
 * @returns {Loaded}
 */
function texturesOf(gl, vdi) {
  if (gl.isContextLost()) return {vdi, textures: [], uploads: []};
  const {heads, tiles} = vdi.leaning ?? vdi;
  /** @type {[Uint32Array, 1 | 2 | 4][]} */
  const arrays = [[heads, 4], [vdi.segments, vdi.compact ? 2 : 4], [tiles, 2]];
  if (vdi.leaning) arrays.push([vdi.leaning.slopes, 1]);
  return {vdi, ...makeTextures(gl, arrays)};
}

/**
 * A picture on the GPU. A view may fill a part of it.
 * @param {WebGL2RenderingContext} gl
 * @param {number} filter of its texture
 */
function makePicture(gl, filter) {
  const texture = gl.createTexture();
  const framebuffer = gl.createFramebuffer();
  const picture = {texture, framebuffer, width: 0, height: 0, part: [0, 0]};
  return {
    ...picture,
    /** @param {number} width least width @param {number} height least height */
    resize(width, height) {
      if (this.width === width && this.height === height) return;
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
      [this.width, this.height, this.part] = [width, height, [0, 0]];
    },
  };
}

/**
 * A part of a canvas, in pixels from its lower left corner.
 * @typedef {{x: number, y: number, width: number, height: number}} Frame
 */

/** @param {HTMLCanvasElement} canvas */
function contextOf(canvas) {
  let cause = "";
  canvas.addEventListener("webglcontextcreationerror", (event) => {
    cause ||= /** @type {WebGLContextEvent} */ (event).statusMessage;
  });
  const gl = canvas.getContext("webgl2", {alpha: false, antialias: true, powerPreference: "high-performance"});
  if (!gl) throw new Error(`VDIs can't be shown without WebGL2, which this browser refuses${cause && `: ${cause}`}`);
  return gl;
}

export class Renderer {
  /**
   * Throws Error without WebGL2. The owner of the canvas sets its size in pixels, `most` at most.
   * @param {HTMLCanvasElement} canvas
   */
  constructor(canvas) {
    this.gl = contextOf(canvas);
    this.canvas = canvas;
    /**
     * The part of the canvas in which the camera's extent is framed, in pixels from the lower left
     * corner; undefined: the whole canvas.
     * @type {Frame | undefined}
     */
    this.framing = undefined;
    /** @type {Loaded | undefined} */
    this.loaded = undefined;
    this.smooth = true;
    /** @type {ClipPlane[]} fewer than MOST_CLIP_PLANES */
    this.clipPlanes = [];
    /** Counts contexts. Objects of former contexts are gone. */
    this.age = 0;
    /** The largest width and height of the canvas. @type {[number, number]} */
    this.most = [1, 1];
    this.restore();
  }

  /**
   * Goes on with another canvas. Throws Error without WebGL2; then nothing has changed.
   * @param {HTMLCanvasElement} canvas
   */
  moveTo(canvas) {
    this.gl = contextOf(canvas);
    this.canvas = canvas;
    this.restore();
  }

  /** Creates all objects on the GPU, at first and whenever the context was lost. */
  restore() {
    const gl = this.gl;
    ++this.age;
    this.most = largestPicture(gl);
    /** @type {Map<string, ReturnType<typeof makeProgram>>} programs that render VDIs, by variant */
    this.programs = new Map();
    this.copy = makeProgram(gl, WHOLE_PICTURE, COPY);
    this.lines = makeProgram(gl, LINES, PLAIN);
    this.ends = gl.createBuffer();
    this.cull = makeProgram(gl, WHOLE_PICTURE, cullShader(tilingOf(gl)));
    this.regions = makePicture(gl, gl.NEAREST);
    this.shown = makePicture(gl, gl.LINEAR);
    this.next = makePicture(gl, gl.LINEAR);
    gl.disable(gl.DITHER);
    const vdi = this.loaded?.vdi;
    this.loaded = undefined;
    if (!vdi) return;
    const loaded = texturesOf(gl, vdi);
    for (const upload of loaded.uploads) upload();
    this.loaded = loaded;
  }

  /**
   * Uploads a VDI. Throws Error if the GPU can't hold it; the former VDI then stays.
   * @param {PreparedVdi} vdi
   * @param {() => Promise<void> | undefined} pause called between parts of the upload, which awaits
   *     the promise if it returns one
   * @param {() => boolean} isWanted called after the upload; false drops the VDI
   * @returns {Promise<boolean>} whether the VDI replaced the former one
   */
  async setVdi(vdi, pause, isWanted) {
    for (;;) {
      const {gl, age} = this;
      const loaded = texturesOf(gl, vdi);
      for (const upload of loaded.uploads) {
        if (!isWanted()) break;
        upload();
        await pause();
      }
      if (!gl.isContextLost()) this.programOf(vdi);  // throws before anything has changed
      if (age !== this.age) continue;  // these textures are gone with a lost context
      const wanted = isWanted();
      const unused = wanted ? this.loaded : loaded;
      if (wanted) this.loaded = loaded;
      for (const texture of unused?.textures ?? []) gl.deleteTexture(texture);
      return wanted;
    }
  }

  /**
   * Uploads the slopes of the VDI's supersegments, from its `leaning`. Throws Error if the GPU
   * can't hold it.
   * @param {() => Promise<void> | undefined} pause as for setVdi
   */
  async setLeaning(pause) {
    const {gl, loaded} = this;
    const age = this.age;
    const leaning = loaded?.vdi.leaning;
    if (!loaded || !leaning || gl.isContextLost() || loaded.textures.length > 3) return;
    this.programOf(loaded.vdi, true);
    const {textures, uploads} = makeTextures(gl, [[leaning.heads, 4], [leaning.tiles, 2], [leaning.slopes, 1]]);
    for (const upload of uploads) {
      upload();
      await pause();
      if (age !== this.age || loaded !== this.loaded) return textures.forEach((texture) => gl.deleteTexture(texture));
    }
    const [heads, tiles, slopes] = textures;
    const [oldHeads, segments, oldTiles] = loaded.textures;
    loaded.textures = [heads, segments, tiles, slopes];
    for (const texture of [oldHeads, oldTiles]) gl.deleteTexture(texture);
  }

  /** Whether the VDI can be drawn sheared, which needs its supersegments' slopes. */
  canShear() {
    return this.smooth && (this.loaded?.textures.length ?? 0) > 3;
  }

  /**
   * The program that renders a VDI.
   * @param {PreparedVdi} vdi
   * @param {boolean} [sheared]
   */
  programOf(vdi, sheared = false) {
    const key = `${vdi.compact} ${this.smooth} ${sheared}`;
    const known = this.programs?.get(key);
    if (known) return known;
    const {gl} = this;
    const variant = {...tilingOf(gl), compact: vdi.compact, smooth: this.smooth, sheared};
    const program = makeProgram(gl, WHOLE_PICTURE, traverseShader(variant));
    this.programs?.set(key, program);
    return program;
  }

  /**
   * Draws rows [firstRow, endRow) of a picture for a canvas of the present size. Rows count from
   * the bottom. The picture becomes visible with `finishPicture`.
   * @param {Camera} camera
   * @param {number} scale canvas pixels per pixel of the picture, >= 1
   * @param {number} firstRow
   * @param {number} endRow
   * @param {boolean} [sheared] only if canShear()
   */
  drawPicture(camera, scale, firstRow, endRow, sheared = false) {
    const {gl, loaded, canvas, next} = this;
    if (!loaded || !next) return;
    const {width, height} = this.pictureSize(scale);
    gl.enable(gl.SCISSOR_TEST);
    gl.disable(gl.BLEND);
    this.findRegions(camera, scale, firstRow, endRow);
    next.resize(canvas.width, canvas.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, next.framebuffer);
    gl.viewport(0, 0, width, height);
    gl.scissor(0, firstRow, width, endRow - firstRow);
    const program = this.programOf(loaded.vdi, sheared);
    this.setRays(program, camera, scale);
    this.setClipPlanes(program, loaded.vdi.camera);
    gl.activeTexture(gl.TEXTURE4);
    gl.bindTexture(gl.TEXTURE_2D, this.regions?.texture ?? null);
    gl.uniform1i(program.uniform("regions"), 4);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
    next.part = [width / canvas.width, height / canvas.height];
  }

  /**
   * Finds the regions of these rows that may show material.
   * @param {Camera} camera
   * @param {number} scale
   * @param {number} firstRow
   * @param {number} endRow
   */
  findRegions(camera, scale, firstRow, endRow) {
    const {gl, canvas, regions, cull} = this;
    if (!regions || !cull) return;
    const {width, height} = this.pictureSize(scale);
    const [across, up] = [Math.ceil(width / REGION), Math.ceil(height / REGION)];
    regions.resize(Math.ceil(canvas.width / REGION), Math.ceil(canvas.height / REGION));
    gl.bindFramebuffer(gl.FRAMEBUFFER, regions.framebuffer);
    gl.viewport(0, 0, across, up);
    const first = Math.floor(firstRow / REGION);
    gl.scissor(0, first, across, Math.ceil(endRow / REGION) - first);
    this.setRays(cull, camera, scale);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** @param {number} scale */
  pictureSize(scale) {
    return {width: Math.max(1, Math.ceil(this.canvas.width / scale)), height: Math.max(1, Math.ceil(this.canvas.height / scale))};
  }

  /**
   * The number of canvas pixels in the camera's vertical extent. In a frame that is narrower than
   * the VDI's picture it is less than the frame's height, because the whole width stays in view.
   */
  framedHeight() {
    const {loaded, canvas} = this;
    const frame = this.framing ?? canvas;
    if (!loaded) return frame.height;
    const {width, height, margin} = loaded.vdi;
    return Math.min(frame.height, frame.width * (height - 2 * margin[1]) / (width - 2 * margin[0]));
  }

  /**
   * The middle of what the camera frames, in pixels right of and above the canvas' middle.
   * @returns {[number, number]}
   */
  framedMiddle() {
    const {framing: frame, canvas} = this;
    return frame ? [frame.x + (frame.width - canvas.width) / 2, frame.y + (frame.height - canvas.height) / 2] : [0, 0];
  }

  /**
   * Makes a program current and sets its uniforms for the VDI and a view.
   * @param {ReturnType<typeof makeProgram>} made
   * @param {Camera} camera
   * @param {number} scale
   */
  setRays(made, camera, scale) {
    const {gl, loaded} = this;
    if (!loaded) return;
    const {vdi, textures} = loaded;
    const {program, uniform} = made;
    gl.useProgram(program);
    const {leaning} = vdi;
    const step = vdi.compact ? vdi.code.step : 1;
    if (leaning) {
      gl.uniform1f(uniform("slopeUnit"), leaning.slopeUnit / step);
      gl.uniform4fv(uniform("boxFaces"), leaning.faces.flat());
    }
    const units = [0, 1, 2, 5];  // pictures use the others
    ["heads", "segments", "tiles", "slopes"].slice(0, textures.length).forEach((name, i) => {
      gl.activeTexture(gl.TEXTURE0 + units[i]);
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, textures[i]);
      gl.uniform1i(uniform(name), units[i]);
    });
    const {width, height} = this.pictureSize(scale);
    const rays = raysOf(camera, this.framedHeight(), vdi.camera, this.framedMiddle());
    gl.uniform2i(uniform("lists"), vdi.width, vdi.height);
    gl.uniform1i(uniform("parallel"), vdi.camera.parallel ? 1 : 0);
    gl.uniform1f(uniform("pixelSize"), pixelSizeOf(vdi));
    gl.uniform1f(uniform("nearest"), vdi.nearest);
    gl.uniform1f(uniform("farthest"), vdi.farthest);
    gl.uniform1f(uniform("binScale"), vdi.binScale);
    gl.uniform2f(uniform("code"), vdi.compact ? vdi.code.first : 0, step);
    gl.uniform3fv(uniform("rayOrigin"), [...rays.origin, ...rays.originRight, ...rays.originUp]);
    gl.uniform3fv(uniform("rayDirection"), [...rays.direction, ...rays.directionRight, ...rays.directionUp]);
    gl.uniform2f(uniform("pictureSize"), scale * width, scale * height);
    gl.uniform1f(uniform("pixelScale"), scale);
  }

  /**
   * @param {ReturnType<typeof makeProgram>} program
   * @param {Camera} original V_O
   */
  setClipPlanes({uniform}, original) {
    const {gl} = this;
    const basis = basisOf(original);
    const planes = this.clipPlanes.slice(0, MOST_CLIP_PLANES).map(({origin, normal}) => {
      const unit = normalize(normal);
      /** @type {Vec3} */
      const turned = [dot(unit, basis.right), dot(unit, basis.up), dot(unit, basis.forward)];
      return [...turned, dot(turned, toView(origin, original, basis))];
    });
    gl.uniform1i(uniform("clipPlaneCount"), planes.length);
    if (planes.length > 0) gl.uniform4fv(uniform("clipPlanes"), planes.flat());
  }

  /**
   * The opacity of a pixel of the canvas before another clipping plane, from 0 to 255. Spoils the
   * picture that is being drawn.
   * @param {Camera} camera
   * @param {number} column
   * @param {number} row
   * @param {ClipPlane} plane
   */
  alphaAt(camera, column, row, plane) {
    const {gl, clipPlanes} = this;
    const pixel = new Uint8Array(4);
    this.clipPlanes = [...clipPlanes, plane];
    this.drawPicture(camera, 1, row, row + 1, this.canShear());
    this.clipPlanes = clipPlanes;
    gl.readPixels(column, row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return pixel[3];
  }

  /** Makes the drawn picture the one that `present` shows. */
  finishPicture() {
    [this.shown, this.next] = [this.next, this.shown];
  }

  /**
   * @param {Camera} camera
   * @param {Color | undefined} background undefined: none
   * @param {Color | undefined} outline its colour; undefined for none
   * @param {WebGLFramebuffer | null} [target] has the canvas' size; the canvas by default
   */
  present(camera, background, outline, target = null) {
    const {gl, canvas} = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.disable(gl.BLEND);
    gl.clearColor(...background ?? [0, 0, 0], background ? 1 : 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (outline) this.drawOutline(camera, outline, false);
    this.putPicture();
    if (outline) this.drawOutline(camera, outline, true);
  }

  /**
   * The picture that `present` would show, without a background: rows from the top, colours not
   * premultiplied. Spoils the picture that is being drawn.
   * @param {Camera} camera
   * @param {Color | undefined} outline
   */
  transparentPixels(camera, outline) {
    const {gl, canvas, next} = this;
    const {width, height} = canvas;
    const pixels = new Uint8ClampedArray(4 * width * height);
    if (!next) return pixels;
    next.resize(width, height);
    this.present(camera, undefined, outline, next.framebuffer);
    const upward = new Uint8Array(pixels.length);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, upward);
    for (let row = 0; row < height; ++row)
      pixels.set(upward.subarray(4 * width * (height - 1 - row), 4 * width * (height - row)), 4 * width * row);
    for (let i = 0; i < pixels.length; i += 4) {
      const scale = pixels[i + 3] > 0 ? 255 / pixels[i + 3] : 0;
      for (let c = i; c < i + 3; ++c) pixels[c] *= scale;
    }
    return pixels;
  }

  putPicture() {
    const {gl, shown, copy, canvas} = this;
    if (!shown || !copy || !this.loaded || shown.part[0] === 0) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(copy.program);
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, shown.texture);
    gl.uniform1i(copy.uniform("picture"), 3);
    gl.uniform2f(copy.uniform("part"), shown.part[0], shown.part[1]);
    gl.uniform2f(copy.uniform("canvasSize"), canvas.width, canvas.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** @param {Camera} camera @param {Color} color @param {boolean} inFront which part to draw */
  drawOutline(camera, color, inFront) {
    const {gl, loaded, lines, ends, canvas} = this;
    if (!loaded || !lines || !ends) return;
    const {bounds} = loaded.vdi;
    if (bounds[0].some((low, axis) => !(low <= bounds[1][axis]))) return;
    const points = outlineEnds(bounds, camera, inFront);
    gl.useProgram(lines.program);
    gl.bindBuffer(gl.ARRAY_BUFFER, ends);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points), gl.DYNAMIC_DRAW);
    const attribute = gl.getAttribLocation(lines.program, "offset");
    gl.enableVertexAttribArray(attribute);
    gl.vertexAttribPointer(attribute, 3, gl.FLOAT, false, 0, 0);
    const framed = this.framedHeight();
    const [right, up] = this.framedMiddle();
    const clip = clipMatrix(camera, [canvas.width / framed, canvas.height / framed],
                            [2 * right / canvas.width, 2 * up / canvas.height]);
    gl.uniformMatrix4fv(lines.uniform("clip"), false, clip);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniform4f(lines.uniform("plain"), ...color, inFront ? 0.7 : 0.4);
    gl.drawArrays(gl.LINES, 0, points.length / 3);
    gl.disableVertexAttribArray(attribute);
  }
}
