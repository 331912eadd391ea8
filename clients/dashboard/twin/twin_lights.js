// Lamp, camera and surroundings of the twin: directions, matrices, and environments as a few parallel lights.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// theta from the vertical, phi from +x towards +y, degrees.
export function direction(theta, phi) {
  const t = theta * Math.PI / 180, p = phi * Math.PI / 180;
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
}

// A camera at `distance` from the point `center`, seen from theta and phi; up is the projection of the vertical. width: of
// the point seen at the center. Column-major; {eye, matrix, near, far, widthAtOne}.
export function cameraFrom({ theta, phi, distance, width, aspect = 1, center = [0, 0, 0], depth = 80 }) {
  const t = theta * Math.PI / 180, p = phi * Math.PI / 180, back = direction(theta, phi);
  const up = [-Math.cos(t) * Math.cos(p), -Math.cos(t) * Math.sin(p), Math.sin(t)], right = cross(up, back);
  const eye = back.map((x, a) => center[a] + distance * x), near = Math.max(distance - depth, 0.02 * distance), far = distance + depth;
  const scale = 2 * distance / width, slope = (far + near) / (near - far), shift = 2 * far * near / (near - far);
  const rows = [[...right.map((x) => x * scale), -scale * dot(right, eye)], [...up.map((x) => x * scale * aspect), -scale * aspect * dot(up, eye)]];
  const z = [...back, -dot(back, eye)];
  rows.push(z.map((x, i) => slope * x + (i === 3 ? shift : 0)), z.map((x) => -x));
  const matrix = new Float32Array(16);
  for (let r = 0; r < 4; r++) for (let c = 0; c < 4; c++) matrix[4 * c + r] = rows[r][c];
  return { eye, matrix, near, far, widthAtOne: width / distance };
}

const box = (d, theta, phi, half) => dot(d, direction(theta, phi)) > Math.cos(half * Math.PI / 180);

// Radiance of each environment in a direction, in units of a white diffuser that faces the lamp.
const environment = {
  "lamp only": null,
  studio: (d) => (box(d, 45, 60, 16) ? [15, 14.4, 13.4] : box(d, 60, 250, 20) ? [5, 5.2, 5.5] : d[2] > 0 ? [0.2, 0.2, 0.2] : [0.05, 0.05, 0.05]),
  daylight: (d) => (box(d, 40, 150, 6) ? [110, 103, 92] : d[2] > 0 ? [0.22, 0.29, 0.4].map((x) => x * (1.4 - 0.7 * d[2])) : [0.08, 0.075, 0.06]),
  evening: (d) => (box(d, 76, 215, 8) ? [44, 23, 9] : d[2] > 0 ? [0.3, 0.17, 0.11].map((x, c) => x * (1 - d[2]) ** 2 + [0.05, 0.07, 0.13][c]) : [0.035, 0.025, 0.025]),
  "overcast sky": (d) => (d[2] > 0 ? [0.36, 0.39, 0.42].map((x) => x * (1 + 2 * d[2])) : [0.08, 0.08, 0.07]),
  window: (d) => (box(d, 60, 150, 24) ? [7, 7.6, 8.2] : d[2] > 0 ? [0.14, 0.13, 0.12] : [0.05, 0.05, 0.04]),
};
export const environmentNames = Object.keys(environment);
// What is seen behind the cloth, as shown on the screen. Alone in the light of a lamp stands what is measured: on black.
const backdrop = { studio: [0.9, 0.9, 0.9], daylight: [0.8, 0.86, 0.93], evening: [0.24, 0.19, 0.2], "overcast sky": [0.84, 0.86, 0.88], window: [0.76, 0.76, 0.75] };
export const backdropOf = (name) => backdrop[name] ?? [0, 0, 0];
export const MOST_LIGHTS = 12;

const fibonacci = (i, n) => {
  const z = 1 - (2 * i + 1) / n, phi = i * Math.PI * (3 - Math.sqrt(5)), s = Math.sqrt(1 - z * z);
  return [s * Math.cos(phi), s * Math.sin(phi), z];
};

// The environment as parallel lights {from, share, color}: its radiance in 2,000 directions, gathered around MOST_LIGHTS of
// them; each light stands in the middle of its light. share is radiance times solid angle over pi.
// turn: of all of it around the vertical, degrees.
export function lightsOf(name, turn = 0) {
  const radiance = environment[name];
  if (!radiance) return [];
  const n = 2000, sums = Array.from({ length: MOST_LIGHTS }, () => ({ from: [0, 0, 0], color: [0, 0, 0], power: 0 }));
  for (let i = 0; i < n; i++) {
    const d = fibonacci(i, n), rgb = radiance(d), power = rgb[0] + rgb[1] + rgb[2];
    let best = 0;
    for (let k = 1; k < MOST_LIGHTS; k++) if (dot(d, fibonacci(k, MOST_LIGHTS)) > dot(d, fibonacci(best, MOST_LIGHTS))) best = k;
    for (let a = 0; a < 3; a++) { sums[best].from[a] += power * d[a]; sums[best].color[a] += rgb[a] * 4 / n; }
    sums[best].power += power;
  }
  const cosine = Math.cos(turn * Math.PI / 180), sine = Math.sin(turn * Math.PI / 180);
  return sums.filter((s) => s.power > 0).map(({ from, color }) => {
    const [x, y, z] = from.map((a) => a / Math.hypot(...from));
    return { from: [x * cosine - y * sine, x * sine + y * cosine, z], share: 1, color };
  });
}
