// From the codes of a slice to colours: grey for densities, and for directions a mixture of one colour for each axis, the
// same as in the view of the fibers in 3D.
export const AXIS_COLOURS = [[0.98, 0.76, 0.40], [0.38, 0.66, 0.93], [0.35, 0.85, 0.45]];

// The squares of the components of the direction that a code stands for; null for 0.
export function directionOf(code, steps) {
  if (code === 0) return null;
  let left = code - 1, x = 0;
  while (left > steps - x) left -= steps - x++ + 1;
  return [x / steps, left / steps, (steps - x - left) / steps];
}

const pixel = (r, g, b) => (0xff000000 | (b << 16) | (g << 8) | r) >>> 0; // memory of an ImageData, little-endian

// A table of the pixels of all codes: index direction * (densitySteps + 1) + density.
export function pixelTable(densitySteps, directionSteps, byDirection) {
  const nDirection = 1 + (directionSteps + 1) * (directionSteps + 2) / 2, n = densitySteps + 1, table = new Uint32Array(nDirection * n);
  for (let c = 0; c < nDirection; c++) {
    const square = byDirection ? directionOf(c, directionSteps) : null;
    const colour = square ? [0, 1, 2].map((i) => square.reduce((sum, s, a) => sum + s * AXIS_COLOURS[a][i], 0)) : [1, 1, 1];
    for (let d = 0; d < n; d++) {
      const bright = 255 * (square ? 0.25 + 0.75 * d / densitySteps : (byDirection ? 0.45 : 1) * d / densitySteps);
      table[c * n + d] = pixel(...colour.map((x) => Math.round(bright * x)));
    }
  }
  return table;
}

// Draws rows of tiles on a canvas of their size, the highest row of voxels at the top.
export function paint(canvas, rows, table, densitySteps) {
  const { width } = rows[0], height = rows.reduce((sum, r) => sum + r.height, 0), n = densitySteps + 1;
  Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d"), image = context.createImageData(width, height), to = new Uint32Array(image.data.buffer);
  let at = width * height;
  for (const { height: h, density, direction } of rows)
    for (let v = 0, i = 0; v < h; v++) {
      at -= width;
      for (let u = 0; u < width; u++, i++) to[at + u] = table[direction[i] * n + density[i]];
    }
  context.putImageData(image, 0, 0);
}
