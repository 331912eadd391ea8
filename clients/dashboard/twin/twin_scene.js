// Draws the twin with WebGL 2: the tables as textures, one shape, one lamp with its shadow map, and parallel lights.
import { backdropOf, cameraFrom, direction, lightsOf, MOST_LIGHTS } from "./twin_lights.js";
import { TwinNear } from "./twin_near.js";
import { glProgram } from "./twin_program.js";
import { depthFragmentText, depthVertexText, fragmentText, vertexText } from "./twin_shaders.js";
import { makeShape } from "./twin_shapes.js";

const SHADOW_EDGE = 1024, FAR_FIELD_MM = 20000;
const ATTRIBUTES = ["position", "normal", "weft", "place"];

function halfToFloat(h) {
  const sign = h & 0x8000 ? -1 : 1, exponent = h >> 10 & 31, mantissa = h & 1023;
  return sign * (exponent === 0 ? mantissa * 2 ** -24 : (1024 + mantissa) * 2 ** (exponent - 25));
}

// The next mipmap of rgba pixels: means over areas, which need not be whole pixels.
function shrink(pixels, width, height) {
  const w = Math.max(1, width >> 1), h = Math.max(1, height >> 1), out = new Float32Array(4 * w * h);
  const spans = (from, to) => Array.from({ length: to }, (_, i) => {
    const low = i * from / to, high = (i + 1) * from / to, list = [];
    for (let k = Math.floor(low); k < Math.min(from, Math.ceil(high)); k++) list.push([k, (Math.min(high, k + 1) - Math.max(low, k)) / (high - low)]);
    return list;
  });
  const columns = spans(width, w), lines = spans(height, h);
  for (let y = 0; y < h; y++)
    for (let x = 0; x < w; x++)
      for (const [j, a] of lines[y]) for (const [i, b] of columns[x])
        for (let c = 0; c < 4; c++) out[4 * (y * w + x) + c] += a * b * pixels[4 * (j * width + i) + c];
  return { pixels: out, width: w, height: h };
}

// The state in the frame of a cloth that has been turned: camera and lamp go the other way around.
function turned(state) {
  if (!state.turn) return state;
  const [x, y, z] = state.center ?? [0, 0, 0], a = state.turn * Math.PI / 180, center = [x * Math.cos(a) - y * Math.sin(a), x * Math.sin(a) + y * Math.cos(a), z];
  return { ...state, center, phi: state.phi + state.turn, lampPhi: state.lampPhi + state.turn };
}

// Lamp and surroundings as the parallel lights of close views, the strongest first.
function nearLights(state, lights) {
  const list = lights.map((l) => ({ from: l.from, color: l.color.map((x) => x * l.share) }));
  if (state.lampPower > 0) list.push({ from: direction(state.lampTheta, state.lampPhi), color: [1, 1, 1].map((x) => x * state.lampPower) });
  const power = (l) => l.color[0] + l.color[1] + l.color[2];
  return list.sort((a, b) => power(b) - power(a));
}

export class TwinScene {
  #gl;
  #description;
  #buffer;
  #surface;
  #depth;
  #uniforms = new Map();
  #shape = { name: "", count: 0, array: null, buffers: [] };
  #shadow;
  #groups = 0;
  #textures = [];
  #near = null;

  // Throws when the browser has no WebGL 2 or cannot hold the tables. groups: the textures, in fours, that the buffer holds already; with fewer than
  // all of them the drawing is a draft until finish().
  constructor(canvas, description, buffer, groups = description.parts.textures.n / 4) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.#gl = gl;
    this.#description = description;
    this.#buffer = buffer;
    this.#depth = glProgram(gl, depthVertexText, depthFragmentText, ATTRIBUTES);
    this.#makeShadow();
    this.#takeGroups(groups);
    gl.enable(gl.DEPTH_TEST);
    if (groups === description.parts.textures.n / 4) this.finish();
  }

  // The buffer is filled: all textures, and the fibers of close views.
  finish() {
    const all = this.#description.parts.textures.n / 4;
    if (this.#groups !== all) this.#takeGroups(all);
    try {
      this.#near = TwinNear.make(this.#gl, this.#description, this.#buffer);
    } catch {
      this.#near = null; // a driver that refuses these shaders still draws the cloth
    }
    this.#shape.name = "";
  }

  #takeGroups(groups) {
    const gl = this.#gl;
    for (const t of this.#textures.splice(0)) gl.deleteTexture(t);
    if (this.#surface) gl.deleteProgram(this.#surface);
    this.#groups = groups;
    this.#uniforms.clear();
    this.#surface = glProgram(gl, vertexText, fragmentText(groups, MOST_LIGHTS), ATTRIBUTES);
    this.#makeTextures();
    this.#makeTable();
  }

  #array(unit, repeat, filter) {
    const gl = this.#gl;
    gl.activeTexture(gl.TEXTURE0 + unit);
    const texture = gl.createTexture();
    this.#textures.push(texture);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D_ARRAY, wrap, repeat ? gl.REPEAT : gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  }

  #makeTextures() {
    const gl = this.#gl, { width, height, offset } = this.#description.parts.textures, groups = this.#groups;
    const halves = new Uint16Array(this.#buffer, offset, 4 * groups * width * height);
    this.#array(0, true, gl.LINEAR_MIPMAP_LINEAR);
    const levels = 1 + Math.floor(Math.log2(Math.max(width, height)));
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, levels, gl.RGBA16F, width, height, groups);
    const anisotropy = gl.getExtension("EXT_texture_filter_anisotropic");
    if (anisotropy) gl.texParameterf(gl.TEXTURE_2D_ARRAY, anisotropy.TEXTURE_MAX_ANISOTROPY_EXT, Math.min(8, gl.getParameter(anisotropy.MAX_TEXTURE_MAX_ANISOTROPY_EXT)));
    for (let g = 0; g < groups; g++) {
      let level = { pixels: Float32Array.from(halves.subarray(4 * g * width * height, 4 * (g + 1) * width * height), halfToFloat), width, height };
      for (let l = 0; l < levels; l++) {
        gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, l, 0, 0, g, level.width, level.height, 1, gl.RGBA, gl.FLOAT, level.pixels);
        level = shrink(level.pixels, level.width, level.height);
      }
    }
  }

  #makeTable() {
    const gl = this.#gl, { view_edge: view, light_edge: light, sides, offset } = this.#description.parts.table, groups = this.#groups;
    const columns = view * sides * light, rows = sides * view * light, layer = 4 * columns * rows;
    // the first version has the layers in another order
    const place = (k) => (this.#description.format === "selvedge-twin.v1" ? k % 3 * this.#description.parts.textures.n / 4 + Math.floor(k / 3) : k);
    this.#array(1, false, gl.LINEAR);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA16F, columns, rows, 3 * groups);
    for (let k = 0; k < 3 * groups; k++)
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, k, columns, rows, 1, gl.RGBA, gl.HALF_FLOAT, new Uint16Array(this.#buffer, offset + 2 * layer * place(k), layer));
    gl.useProgram(this.#surface);
    this.#set("uniform1i", "textures", 0);
    this.#set("uniform1i", "table", 1);
    this.#set("uniform1i", "shadows", 2);
    this.#set("uniform1i", "fibers", 3);
    this.#set("uniform2f", "tableSize", columns, rows);
    this.#set("uniform1f", "viewEdge", view);
    this.#set("uniform1f", "lightEdge", light);
    this.#set("uniform1i", "sides", sides);
    this.#set("uniform2f", "tile", ...this.#description.tile_mm);
    if (gl.getError() !== gl.NO_ERROR) throw new Error("the graphics card cannot hold the tables");
  }

  #makeShadow() {
    const gl = this.#gl, texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_EDGE, SHADOW_EDGE);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    this.#shadow = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#shadow);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
    gl.drawBuffers([gl.NONE]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  #set(call, name, ...values) {
    if (!this.#uniforms.has(name)) this.#uniforms.set(name, this.#gl.getUniformLocation(this.#surface, name));
    this.#gl[call](this.#uniforms.get(name), ...values);
  }

  #takeShape(name) {
    const gl = this.#gl;
    if (this.#shape.name === name) return;
    for (const b of this.#shape.buffers) gl.deleteBuffer(b);
    if (this.#shape.array) gl.deleteVertexArray(this.#shape.array);
    const made = makeShape(name, this.#description, this.#buffer), array = gl.createVertexArray(), buffers = [];
    const fill = (target, data) => {
      const b = gl.createBuffer();
      gl.bindBuffer(target, b);
      gl.bufferData(target, data, gl.STATIC_DRAW);
      buffers.push(b);
    };
    gl.bindVertexArray(array);
    ATTRIBUTES.forEach((attribute, i) => {
      fill(gl.ARRAY_BUFFER, made[attribute]);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, attribute === "place" ? 2 : 3, gl.FLOAT, false, 0, 0);
    });
    fill(gl.ELEMENT_ARRAY_BUFFER, made.index);
    this.#shape = { name, count: made.index.length, array, buffers };
    this.#near?.takeShape(made);
  }

  #draw() { this.#gl.drawElements(this.#gl.TRIANGLES, this.#shape.count, this.#gl.UNSIGNED_INT, 0); }

  // state: {turn, shape, theta, phi, width, center, lampTheta, lampPhi, lampPower, environment, exposure, fibers}; turn: of the cloth, camera and light staying; angles in degrees,
  // lengths in millimetres; fibers false: by the tables alone. Draws into the canvas as large as it is.
  draw(asked) {
    const state = turned(asked), gl = this.#gl, { setup } = this.#description, canvas = gl.canvas;
    this.#takeShape(state.shape);
    const lamp = cameraFrom({ theta: state.lampTheta, phi: state.lampPhi, distance: setup.lamp_distance_mm, width: 64, depth: 45 });
    gl.bindVertexArray(this.#shape.array);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#shadow);
    gl.viewport(0, 0, SHADOW_EDGE, SHADOW_EDGE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.#depth);
    gl.uniformMatrix4fv(gl.getUniformLocation(this.#depth, "camera"), false, lamp.matrix);
    this.#draw();
    const eye = cameraFrom({ theta: state.theta, phi: state.phi, width: state.width, center: state.center, aspect: canvas.width / canvas.height,
      distance: setup.far_field ? FAR_FIELD_MM : setup.camera_distance_mm });
    const lights = lightsOf(state.environment, state.turn), near = (state.fibers !== false && this.#near?.draw(eye, state, nearLights(state, lights))) || { weight: 0 };
    gl.bindVertexArray(this.#shape.array);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...backdropOf(state.environment), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.#surface);
    this.#set("uniformMatrix4fv", "camera", false, eye.matrix);
    this.#set("uniform3f", "eye", ...eye.eye);
    this.#set("uniform3f", "lamp", ...lamp.eye);
    this.#set("uniform1f", "lampDistance", setup.lamp_distance_mm);
    this.#set("uniform1f", "lampSide", setup.lamp_side_mm);
    this.#set("uniform1f", "lampPower", state.lampPower);
    this.#set("uniformMatrix4fv", "lampCamera", false, lamp.matrix);
    this.#set("uniform2f", "lampRange", lamp.near, lamp.far);
    this.#set("uniform1f", "lampPixel", lamp.widthAtOne);
    this.#set("uniform1f", "exposure", state.exposure);
    this.#set("uniform1i", "curve", state.environment === "lamp only" ? 0 : 1);
    this.#set("uniform1f", "nearWeight", near.weight);
    this.#set("uniform1f", "nearLevel", near.level ?? 0);
    this.#set("uniform1i", "lightCount", lights.length);
    lights.forEach((light, i) => {
      this.#set("uniform4f", `lightFrom[${i}]`, ...light.from, light.share);
      this.#set("uniform3f", `lightColor[${i}]`, ...light.color);
    });
    this.#draw();
  }

  // The pixels of a drawing of edge x edge, row 0 at the top, as rgba bytes; the canvas keeps that size.
  pixels(state, edge) {
    const gl = this.#gl, out = new Uint8Array(4 * edge * edge), row = 4 * edge;
    gl.canvas.width = gl.canvas.height = edge;
    this.draw(state);
    gl.readPixels(0, 0, edge, edge, gl.RGBA, gl.UNSIGNED_BYTE, out);
    const turned = new Uint8Array(out.length);
    for (let y = 0; y < edge; y++) turned.set(out.subarray(row * (edge - 1 - y), row * (edge - y)), row * y);
    return turned;
  }

  // Draws single fibers of half as many copies of the tile at most.
  takeFewerFibers() { this.#near?.takeFewer(); }

  // Waits until all is drawn.
  settle() { this.#gl.readPixels(0, 0, 1, 1, this.#gl.RGBA, this.#gl.UNSIGNED_BYTE, new Uint8Array(4)); }

  close() { this.#gl.getExtension("WEBGL_lose_context")?.loseContext(); }
}
