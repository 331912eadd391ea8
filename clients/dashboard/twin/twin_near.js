// Draws the fibers of the copies of the tile that are in view into a picture of their own, from which the shader of the cloth takes what the
// tables are too coarse for.
import { nearFragmentText, nearVertexText } from "./twin_near_shaders.js";
import { glProgram } from "./twin_program.js";

const POINT_TEXELS = 1024, MOST_COPIES = 400, MOST_SEGMENTS = 1.2e6, NEAR_LIGHTS = 5, SAMPLES = 4;

const smooth = (low, high, x) => { const t = Math.min(Math.max((x - low) / (high - low), 0), 1); return t * t * (3 - 2 * t); };

// The copies of the tile in view: [column, row, ...]. shape: as makeShape returns it. reach: of fibers beyond their tile, mm.
export function copiesInView(shape, tile, camera, width, reach) {
  const { position, normal, size, from, to } = shape, [columns, rows] = size, m = camera.matrix, corner = [0, 0, 0];
  const clip = (u, v) => { // largest of |x| and |y| in clip space of a place of the cloth; infinite where it is seen from behind
    const a = Math.min(Math.max((u - from[0]) / (to[0] - from[0]), 0), 1) * (columns - 1), b = Math.min(Math.max((v - from[1]) / (to[1] - from[1]), 0), 1) * (rows - 1);
    const i = Math.min(Math.floor(a), columns - 2), j = Math.min(Math.floor(b), rows - 2), x = a - i, y = b - j, k = 3 * (j * columns + i);
    let facing = 0;
    for (let c = 0; c < 3; c++) {
      const mix = (list) => (1 - y) * ((1 - x) * list[k + c] + x * list[k + 3 + c]) + y * ((1 - x) * list[k + 3 * columns + c] + x * list[k + 3 * columns + 3 + c]);
      corner[c] = mix(position);
      facing += mix(normal) * (camera.eye[c] - corner[c]);
    }
    if (facing < 0 && shape.oneSided) return Infinity;
    const at = (r) => m[r] * corner[0] + m[4 + r] * corner[1] + m[8 + r] * corner[2] + m[12 + r], w = at(3);
    return Math.max(Math.abs(at(0) / w), Math.abs(at(1) / w));
  };
  let box = [...from, ...to];
  for (let round = 0; round < 4; round++) { // the part of the cloth in view, ever more closely
    const n = 32, step = [(box[2] - box[0]) / n, (box[3] - box[1]) / n], margin = 1 + 2 * Math.max(...step) / width, next = [Infinity, Infinity, -Infinity, -Infinity];
    for (let j = 0; j <= n; j++) for (let i = 0; i <= n; i++) {
      const place = [box[0] + i * step[0], box[1] + j * step[1]];
      if (clip(...place) < margin) for (const a of [0, 1]) { next[a] = Math.min(next[a], place[a] - step[a]); next[2 + a] = Math.max(next[2 + a], place[a] + step[a]); }
    }
    if (next[0] > next[2]) return [];
    box = [Math.max(next[0], from[0]), Math.max(next[1], from[1]), Math.min(next[2], to[0]), Math.min(next[3], to[1])];
  }
  const list = [], margin = 1 + (Math.hypot(...tile) + 2 * reach) / width;
  for (let j = Math.floor((box[1] - reach) / tile[1]); j * tile[1] < box[3] + reach; j++)
    for (let i = Math.floor((box[0] - reach) / tile[0]); i * tile[0] < box[2] + reach; i++) {
      if (clip((i + 0.5) * tile[0], (j + 0.5) * tile[1]) < margin) list.push(i, j);
      if (list.length > 2 * MOST_COPIES) return list;
    }
  return list;
}

export class TwinNear {
  #gl;
  #description;
  #program;
  #uniforms = new Map();
  #points;
  #lobes;
  #shape = null;
  #maps = [];
  #copies;
  #array;
  #frame = null;
  #most = MOST_SEGMENTS;
  #drawn = false;

  // null where the tables have no fibers or the browser cannot draw into half floats.
  static make(gl, description, buffer) {
    const { fibers } = description.parts;
    if (!fibers?.points || !(gl.getExtension("EXT_color_buffer_float") || gl.getExtension("EXT_color_buffer_half_float"))) return null;
    return new TwinNear(gl, description, buffer);
  }

  constructor(gl, description, buffer) {
    const { fibers, lobes } = description.parts;
    this.#gl = gl;
    this.#description = description;
    this.#program = glProgram(gl, nearVertexText(NEAR_LIGHTS), nearFragmentText(NEAR_LIGHTS), ["copy"]);
    const rows = Math.ceil(2 * (fibers.points + 2) / POINT_TEXELS), words = new Uint32Array(4 * POINT_TEXELS * rows);
    words.set(new Uint32Array(buffer, fibers.offset, 8 * fibers.points));
    this.#points = this.#texture(gl.TEXTURE_2D, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32UI, POINT_TEXELS, rows, 0, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
    this.#lobes = this.#texture(gl.TEXTURE_3D, gl.LINEAR);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGBA16F, lobes.half, lobes.difference, lobes.azimuth * lobes.sets, 0, gl.RGBA, gl.HALF_FLOAT,
      new Uint16Array(buffer, lobes.offset, 4 * lobes.half * lobes.difference * lobes.azimuth * lobes.sets));
    this.#array = gl.createVertexArray();
    gl.bindVertexArray(this.#array);
    this.#copies = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#copies);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.vertexAttribDivisor(0, 1);
    const index = new Uint32Array(6 * (fibers.points - 1));
    for (let i = 0; i + 1 < fibers.points; i++) index.set([4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 2, 4 * i + 1, 4 * i + 3], 6 * i);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
  }

  #texture(target, filter) {
    const gl = this.#gl, texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE4);
    gl.bindTexture(target, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, filter);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
    return texture;
  }

  #set(call, name, ...values) {
    if (!this.#uniforms.has(name)) this.#uniforms.set(name, this.#gl.getUniformLocation(this.#program, name));
    this.#gl[call](this.#uniforms.get(name), ...values);
  }

  // The shape as makeShape returns it: its grid as textures.
  takeShape(shape) {
    const gl = this.#gl, [width, height] = shape.size;
    for (const map of this.#maps) gl.deleteTexture(map);
    this.#maps = [[shape.position, gl.RGBA32F, gl.NEAREST], [shape.normal, gl.RGBA16F, gl.LINEAR], [shape.weft, gl.RGBA16F, gl.LINEAR]].map(([list, format, filter]) => {
      const map = this.#texture(gl.TEXTURE_2D, filter), four = new Float32Array(4 * width * height);
      for (let i = 0; i < width * height; i++) four.set(list.subarray(3 * i, 3 * i + 3), 4 * i);
      gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, gl.RGBA, gl.FLOAT, four);
      return map;
    });
    this.#shape = { ...shape, oneSided: this.#description.parts.table.sides === 1 };
  }

  #takeFrame(width, height) {
    const gl = this.#gl;
    if (this.#frame?.width === width && this.#frame.height === height) return;
    this.#dropFrame();
    const buffers = [[gl.RGBA16F, gl.COLOR_ATTACHMENT0], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]], drawn = gl.createFramebuffer(), resolved = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, drawn);
    const stores = buffers.map(([format, attachment]) => {
      const store = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, store);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, SAMPLES, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, store);
      return store;
    });
    const picture = this.#texture(gl.TEXTURE_2D, gl.LINEAR), levels = 1 + Math.floor(Math.log2(Math.max(width, height)));
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, levels, gl.RGBA16F, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, resolved);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, picture, 0);
    this.#frame = { width, height, drawn, resolved, stores, picture, levels };
  }

  // Draws fibers of half as many copies from now on, if it has drawn some last.
  takeFewer() { if (this.#drawn) this.#most /= 2; }

  #dropFrame() {
    const gl = this.#gl, frame = this.#frame;
    if (!frame) return;
    for (const f of [frame.drawn, frame.resolved]) gl.deleteFramebuffer(f);
    for (const s of frame.stores) gl.deleteRenderbuffer(s);
    gl.deleteTexture(frame.picture);
    this.#frame = null;
  }

  // Weight of the fibers in a view, and the copies of the tile that it takes: 0 where pixels are too wide for single fibers.
  #weigh(camera, state, pixels) {
    const { fibers, textures } = this.#description.parts, { tile_mm: tile } = this.#description, perMm = pixels / state.width;
    const texel = Math.sqrt(tile[0] * tile[1] / (textures.width * textures.height));
    const weight = smooth(1, 2.5, 2 * fibers.radius_mm * perMm) * smooth(1, 2, texel * perMm);
    if (weight === 0) return { weight: 0 };
    const reach = Math.max(0, -fibers.low[0], -fibers.low[1], fibers.high[0] - tile[0], fibers.high[1] - tile[1]);
    const copies = copiesInView(this.#shape, tile, camera, state.width, reach), segments = copies.length / 2 * fibers.points;
    return { weight: copies.length > 2 * MOST_COPIES ? 0 : weight * (1 - smooth(0.7 * this.#most, this.#most, segments)), copies, level: 1 + Math.log2(texel * perMm) };
  }

  // Draws the fibers, and returns {weight, level, texture} for the shader of the cloth. lights: [{from, color}], the strongest first.
  draw(camera, state, lights) {
    const gl = this.#gl, { width, height } = gl.canvas, { fibers, lobes } = this.#description.parts;
    const { weight, copies, level } = this.#weigh(camera, state, width);
    this.#drawn = weight > 0;
    if (weight === 0) return { weight: 0 };
    this.#takeFrame(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame.drawn);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0.4);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.#program);
    [["points", gl.TEXTURE_2D, this.#points], ["lobes", gl.TEXTURE_3D, this.#lobes], ["places", gl.TEXTURE_2D, this.#maps[0]], ["normals", gl.TEXTURE_2D, this.#maps[1]],
      ["wefts", gl.TEXTURE_2D, this.#maps[2]]].forEach(([name, target, texture], i) => {
      gl.activeTexture(gl.TEXTURE4 + i);
      gl.bindTexture(target, texture);
      this.#set("uniform1i", name, 4 + i);
    });
    this.#set("uniform1f", "sets", lobes.sets);
    this.#set("uniformMatrix4fv", "camera", false, camera.matrix);
    this.#set("uniform3f", "eye", ...camera.eye);
    this.#set("uniform3f", "low", ...fibers.low);
    this.#set("uniform3f", "span", ...fibers.high.map((x, a) => x - fibers.low[a]));
    this.#set("uniform1f", "radius", fibers.radius_mm);
    this.#set("uniform2f", "tile", ...this.#description.tile_mm);
    this.#set("uniform2f", "shapeFrom", ...this.#shape.from);
    this.#set("uniform2f", "shapeTo", ...this.#shape.to);
    const taken = lights.slice(0, NEAR_LIGHTS);
    this.#set("uniform1i", "lightCount", taken.length);
    taken.forEach((light, i) => {
      this.#set("uniform3f", `lightFrom[${i}]`, ...light.from);
      this.#set("uniform3f", `lightColor[${i}]`, ...light.color);
    });
    gl.bindVertexArray(this.#array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#copies);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(copies), gl.STREAM_DRAW);
    gl.drawElementsInstanced(gl.TRIANGLES, 6 * (fibers.points - 1), gl.UNSIGNED_INT, 0, copies.length / 2);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.#frame.drawn);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.#frame.resolved);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_2D, this.#frame.picture);
    gl.generateMipmap(gl.TEXTURE_2D);
    return { weight, level: Math.min(Math.max(Math.round(level), 0), this.#frame.levels - 1) };
  }
}
