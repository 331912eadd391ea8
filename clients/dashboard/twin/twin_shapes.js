// The surfaces that the twin is laid on, in millimetres around the orbit center, z up: a flat piece, the upper side of a
// cylinder, a piece that has fallen over a ball. They are the surfaces of the job's pictures (docs/bent-cloth.md).

const CYLINDER_RADIUS = 15, SIZE = 40;

// A grid of (n + 1) x (m + 1) points; of(i, j) gives [x, y, z, u, v]. Normals and wefts are central differences.
function grid(n, m, of) {
  const points = (n + 1) * (m + 1), position = new Float32Array(3 * points), normal = new Float32Array(3 * points), weft = new Float32Array(3 * points), place = new Float32Array(2 * points);
  for (let j = 0; j <= m; j++)
    for (let i = 0; i <= n; i++) {
      const k = j * (n + 1) + i, p = of(i, j);
      position.set(p.slice(0, 3), 3 * k);
      place.set(p.slice(3), 2 * k);
    }
  const at = (i, j) => position.subarray(3 * (j * (n + 1) + i), 3 * (j * (n + 1) + i) + 3);
  for (let j = 0; j <= m; j++)
    for (let i = 0; i <= n; i++) {
      const a = at(Math.max(i - 1, 0), j), b = at(Math.min(i + 1, n), j), c = at(i, Math.max(j - 1, 0)), d = at(i, Math.min(j + 1, m));
      const u = [0, 1, 2].map((x) => b[x] - a[x]), v = [0, 1, 2].map((x) => d[x] - c[x]);
      const w = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const length = Math.hypot(...u), height = Math.hypot(...w), k = 3 * (j * (n + 1) + i);
      for (let x = 0; x < 3; x++) { weft[k + x] = u[x] / length; normal[k + x] = w[x] / height; }
    }
  const index = new Uint32Array(6 * n * m);
  for (let j = 0, at = 0; j < m; j++)
    for (let i = 0; i < n; i++, at += 6) {
      const k = j * (n + 1) + i;
      index.set([k, k + 1, k + n + 2, k, k + n + 2, k + n + 1], at);
    }
  return { position, normal, weft, place, index, size: [n + 1, m + 1], from: [...place.subarray(0, 2)], to: [...place.subarray(-2)] };
}

const flat = () => grid(1, 1, (i, j) => [(i - 0.5) * SIZE, (j - 0.5) * SIZE, 0, (i - 0.5) * SIZE, (j - 0.5) * SIZE]);

function cylinder(wrap) {
  const n = 240, r = CYLINDER_RADIUS;
  return grid(n, 1, (i, j) => {
    const angle = (i / n - 0.5) * wrap * Math.PI / 180;
    return [r * Math.sin(angle), (j - 0.5) * SIZE, r * (Math.cos(angle) - 1), r * angle, (j - 0.5) * SIZE];
  });
}

function drape(part, buffer) {
  const n = part.points - 1, number = new Uint16Array(buffer, part.offset, 3 * part.points ** 2), cell = part.size_mm / n;
  return grid(n, n, (i, j) => {
    const k = 3 * (j * part.points + i);
    return [...[0, 1, 2].map((a) => part.low[a] + (part.high[a] - part.low[a]) * number[k + a] / 65535), (i - n / 2) * cell, (j - n / 2) * cell];
  });
}

export const shapeNames = ["flat", "cylinder", "drape"];

export function makeShape(name, description, buffer) {
  if (name === "flat") return flat();
  return name === "cylinder" ? cylinder(180) : drape(description.parts.drape, buffer);
}
