// Pictures with linear values, {width, height, rgb}: loading, averages, exposure, drawing.
import { raw } from "../server_link.js";
import { readExr } from "./exr_reader.js";

const STEPS = 4096, WHITE_SHARE = 0.98, WHITE = 0.8, TAKEN = 20000;
const TABLE = Uint8ClampedArray.from({ length: STEPS + 1 }, (_, i) => {
  const v = i / STEPS;
  return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
});
const encode = (x) => (x > 0 ? TABLE[Math.min(STEPS, Math.round(x * STEPS))] : 0); // also 0 for a value that is no number

// One value everywhere: a row that was measured without a photograph.
export const uniform = (rgb) => ({ width: 1, height: 1, rgb: Float32Array.from(rgb) });

export async function loadPicture(url, signal) {
  const buffer = await (await raw("GET", url, { signal })).arrayBuffer();
  try { return readExr(buffer); } catch (error) { throw new Error(`${decodeURIComponent(url.split("/").pop())} cannot be shown: ${error.message}`); }
}

// Averages the picture over a grid of at most `edge` pixels a side.
export function reduced(picture, width, height) {
  const rgb = new Float32Array(3 * width * height);
  for (let y = 0; y < height; y++) {
    const y0 = Math.floor(y * picture.height / height), y1 = Math.max(y0 + 1, Math.floor((y + 1) * picture.height / height));
    for (let x = 0; x < width; x++) {
      const x0 = Math.floor(x * picture.width / width), x1 = Math.max(x0 + 1, Math.floor((x + 1) * picture.width / width)), n = (y1 - y0) * (x1 - x0);
      for (let v = y0; v < y1; v++)
        for (let u = x0; u < x1; u++)
          for (let k = 0; k < 3; k++) rgb[3 * (y * width + x) + k] += picture.rgb[3 * (v * picture.width + u) + k] / n;
    }
  }
  return { width, height, rgb };
}

export function thumbnail(picture, edge) {
  const s = Math.min(1, edge / Math.max(picture.width, picture.height));
  return s === 1 ? picture : reduced(picture, Math.max(1, Math.round(s * picture.width)), Math.max(1, Math.round(s * picture.height)));
}

// The exposure at which 98 % of the pixels of the brighter picture are below 0.8 of white.
export function automaticExposure(pictures) {
  const peaks = pictures.map(({ rgb }) => {
    const step = 3 * Math.max(1, Math.floor(rgb.length / 3 / TAKEN)), peak = [];
    for (let i = 0; i < rgb.length; i += step) peak.push(Math.max(rgb[i], rgb[i + 1], rgb[i + 2]));
    const sorted = peak.filter(Number.isFinite).sort((a, b) => a - b);
    return sorted[Math.floor(WHITE_SHARE * (sorted.length - 1))] ?? 0;
  });
  return WHITE / Math.max(1e-6, ...peaks);
}

function toCanvas(canvas, width, height, colour) {
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d"), image = context.createImageData(width, height);
  for (let i = 0; i < width * height; i++) {
    colour(3 * i, image.data, 4 * i);
    image.data[4 * i + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

export function draw(canvas, picture, exposure) {
  const { rgb } = picture;
  return toCanvas(canvas, picture.width, picture.height, (from, to, at) => {
    for (let k = 0; k < 3; k++) to[at + k] = encode(rgb[from + k] * exposure);
  });
}

// Draws rendered minus measured, mean of the channels, over a grid that both pictures have: orange where the rendering
// is brighter, blue where it is darker, white where they are equal. `full`: the difference that has the full colour.
export function drawDifference(canvas, measured, rendered, block, full) {
  const sides = [measured, rendered].filter((p) => p.width > 1);
  const edge = (side) => Math.max(1, Math.round(Math.min(...(sides.length ? sides : [measured]).map((p) => p[side])) / block));
  const width = edge("width"), height = edge("height"), [a, b] = [measured, rendered].map((p) => reduced(p, width, height).rgb);
  return toCanvas(canvas, width, height, (from, to, at) => {
    const d = (b[from] + b[from + 1] + b[from + 2] - a[from] - a[from + 1] - a[from + 2]) / 3;
    const share = Number.isFinite(d) ? Math.min(1, Math.abs(d) / full) : 0, end = d > 0 ? [200, 80, 0] : [0, 90, 200];
    for (let k = 0; k < 3; k++) to[at + k] = Math.round(255 + share * (end[k] - 255));
  });
}

// The value at a place, 0..1 each way.
export function valueAt(picture, x, y) {
  const u = Math.min(picture.width - 1, Math.floor(x * picture.width)), v = Math.min(picture.height - 1, Math.floor(y * picture.height)), at = 3 * (v * picture.width + u);
  return { u, v, rgb: [...picture.rgb.subarray(at, at + 3)] };
}
