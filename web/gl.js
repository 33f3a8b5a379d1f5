// Small helpers for WebGL2.

/** @param {WebGL2RenderingContext} gl @param {number} kind @param {string} source */
function compile(gl, kind, source) {
  const shader = gl.createShader(kind);
  if (!shader) throw new Error("WebGL created no shader");
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  return shader;
}

/**
 * A program, with its uniforms by name. Throws Error if it doesn't build, unless the context is
 * lost.
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex
 * @param {string} fragment
 */
export function makeProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  if (!program) throw new Error("WebGL created no program");
  const shaders = [compile(gl, gl.VERTEX_SHADER, vertex), compile(gl, gl.FRAGMENT_SHADER, fragment)];
  for (const shader of shaders) gl.attachShader(program, shader);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = [...shaders.map((shader) => gl.getShaderInfoLog(shader)), gl.getProgramInfoLog(program)];
    throw new Error(`the graphics driver rejects a shader: ${logs.filter(Boolean).join(" ").split("\n")[0]}`);
  }
  for (const shader of shaders) gl.deleteShader(shader);
  /** @type {Map<string, WebGLUniformLocation | null>} */
  const locations = new Map();
  const uniform = (/** @type {string} */ name) => {
    const known = locations.get(name);
    if (known !== undefined) return known;
    const location = gl.getUniformLocation(program, name);
    locations.set(name, location);
    return location;
  };
  return {program, uniform};
}

/**
 * The largest width and height of a picture that the GPU draws to a texture or to the canvas. They
 * are 1 while the context is lost.
 * @param {WebGL2RenderingContext} gl
 * @returns {[number, number]}
 */
export function largestPicture(gl) {
  const side = Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), gl.getParameter(gl.MAX_RENDERBUFFER_SIZE));
  const viewport = gl.getParameter(gl.MAX_VIEWPORT_DIMS) ?? [1, 1];
  return [Math.max(Math.min(side, viewport[0]), 1), Math.max(Math.min(side, viewport[1]), 1)];
}

/**
 * The layout of long arrays in textures; see Variant in traverse.js.
 * @param {WebGL2RenderingContext} gl
 */
export function tilingOf(gl) {
  const shift = Math.min(12, Math.floor(Math.log2(gl.getParameter(gl.MAX_TEXTURE_SIZE))));
  return {rowShift: shift, layerShift: shift};
}

/**
 * The number of elements that a texture of makeArrayTexture holds.
 * @param {WebGL2RenderingContext} gl
 */
export function mostElements(gl) {
  const {rowShift, layerShift} = tilingOf(gl);
  return gl.isContextLost() ? Infinity : 2 ** (rowShift + layerShift) * gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS);
}

const UPLOAD_BYTES = 2 << 20;  // bytes of one upload

/**
 * Makes an integer texture of rows and layers from an array of two or four words per element.
 * Throws Error if the GPU can't hold it.
 * @param {WebGL2RenderingContext} gl
 * @param {Uint32Array} words
 * @param {1 | 2 | 4} perElement
 * @param {{rowShift: number, layerShift: number}} tiling
 * @returns {{texture: WebGLTexture | null, uploads: (() => void)[]}} call all uploads to complete
 *     the texture
 */
export function makeArrayTexture(gl, words, perElement, tiling) {
  const width = 1 << tiling.rowShift;
  const maxHeight = 1 << tiling.layerShift;
  const rows = Math.max(1, Math.ceil(words.length / perElement / width));
  const layers = Math.ceil(rows / maxHeight);
  if (layers > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS)) throw new Error("the VDI is too large for this GPU's textures");
  const [internal, format] = {1: [gl.R32UI, gl.RED_INTEGER], 2: [gl.RG32UI, gl.RG_INTEGER],
                              4: [gl.RGBA32UI, gl.RGBA_INTEGER]}[perElement];
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
  gl.getError();
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, internal, width, Math.min(rows, maxHeight), layers);
  if (gl.getError() === gl.OUT_OF_MEMORY) {
    gl.deleteTexture(texture);
    throw new Error("the GPU has too little memory for this VDI");
  }
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  const perRow = width * perElement;
  const mostRows = Math.max(1, Math.floor(UPLOAD_BYTES / 4 / perRow));
  /** @type {(() => void)[]} */
  const uploads = [];
  for (let row = 0; row * perRow < words.length;) {
    const first = row;
    const whole = Math.floor(words.length / perRow) - row;
    const some = Math.min(Math.max(whole, 1), maxHeight - (row % maxHeight), mostRows);
    const across = whole > 0 ? width : (words.length % perRow) / perElement;
    uploads.push(() => {
      const part = words.subarray(first * perRow, first * perRow + some * across * perElement);
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, first % maxHeight, Math.floor(first / maxHeight), across, some, 1, format,
                       gl.UNSIGNED_INT, part);
    });
    row += some;
  }
  return {texture, uploads};
}
