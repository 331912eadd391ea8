// Colours of the fibers in 3D, and their legend. hair: as readHair of fiber_view.js returns it.
import { el } from "../page_parts.js";
import { FOUND_FROM } from "./hair_file.js";

// Where a fiber runs on the whole, from its first to its last point (colours of the chart of lengths).
const KINDS = [["weft (along x)", [0.81, 0.55, 0.18]], ["warp (along y)", [0.23, 0.51, 0.75]], ["through the cloth (along z)", [0.35, 0.75, 0.42]]];
const GROUPS = [[0.81, 0.55, 0.18], [0.23, 0.51, 0.75], [0.35, 0.75, 0.42], [0.82, 0.34, 0.48], [0.62, 0.47, 0.85], [0.35, 0.75, 0.75], [0.85, 0.80, 0.36], [0.7, 0.7, 0.7]];
// From thin to thick: dark violet over red to pale yellow, whose brightness rises (as of the map "inferno").
const SCALE = [[0.27, 0.06, 0.46], [0.58, 0.15, 0.40], [0.87, 0.32, 0.23], [0.98, 0.65, 0.13], [0.99, 1.0, 0.64]];

const css = (rgb) => `rgb(${rgb.map((x) => Math.round(255 * x)).join(",")})`;

function scaled(t) {
  const at = Math.min(0.9999, Math.max(0, t)) * (SCALE.length - 1), i = Math.floor(at), f = at - i;
  return SCALE[i].map((x, c) => x + f * (SCALE[i + 1][c] - x));
}

const swatch = (color, text) => el("span", { class: "swatch" }, el("i", { style: `background:${color}` }), text);

function byDirection(hair) {
  const { position, n } = hair;
  return {
    legend: ["Direction of each piece: ", swatch(css([0.98, 0.76, 0.40]), "x, weft"), swatch(css([0.38, 0.66, 0.93]), "y, warp"), swatch(css([0.35, 0.85, 0.45]), "z, through the cloth")],
    of(s) {
      const d = [0, 1, 2].map((c) => Math.abs(position[6 * s + 3 + c] - position[6 * s + c])), length = Math.hypot(...d) || 1;
      const [x, y, z] = d.map((v) => (v / length) ** 2);
      return [0.98 * x + 0.38 * y + 0.35 * z, 0.76 * x + 0.66 * y + 0.85 * z, 0.40 * x + 0.93 * y + 0.45 * z];
    }, n,
  };
}

function byKind(hair) {
  const present = new Set(hair.kind);
  return { legend: ["Each fiber from end to end: ", ...KINDS.map(([name, color], i) => present.has(i) ? swatch(css(color), name) : null)], of: (s) => KINDS[hair.kind[s]][1] };
}

function byGroup(hair) {
  const present = [...new Set(hair.group)].sort();
  return { legend: ["Material: ", ...present.map((g) => swatch(css(GROUPS[g]), `group ${g}`))], of: (s) => GROUPS[hair.group[s]] };
}

// The scale spans the middle 96 % of the pieces: a single wild fiber does not take all colours.
function byRadius(hair) {
  const sorted = Float32Array.from(hair.radius).sort(), low = sorted[Math.floor(0.02 * (hair.n - 1))], high = sorted[Math.ceil(0.98 * (hair.n - 1))];
  const um = (mm) => `${Number((1000 * mm).toPrecision(3))} µm`;
  if (!(high > 1.0005 * low)) return { legend: [`All fibers have a radius of ${um(low)}.`], of: () => scaled(0.7) };
  return {
    legend: ["Radius: ", um(low), el("span", { class: "ramp", style: `background:linear-gradient(to right,${SCALE.map(css).join(",")})` }), um(high),
      ` (the middle 96 %; all: ${um(sorted[0])} to ${um(sorted[hair.n - 1])})`],
    of: (s) => scaled((hair.radius[s] - low) / (high - low)),
  };
}

// Where the scan shows the fiber, and where the line was carried on through a gap or amid material without fibers.
const FOUND = [1.0, 0.45, 0.36], FILLED = [0.30, 0.82, 1.0];
function byContrast(hair) {
  let filled = 0;
  for (const c of hair.contrast) if (c < FOUND_FROM) filled++;
  return {
    legend: [swatch(css(FOUND), "found: the scan shows the fiber"), swatch(css(FILLED), "filled in: it does not show it clearly"), `${(100 * filled / Math.max(1, hair.n)).toFixed(1)} % of the pieces are filled in`],
    of: (s) => (hair.contrast[s] < FOUND_FROM ? FILLED : FOUND),
  };
}

// Of the fibers as they were traced, because closing the seams of the tile moves them away from the scan.
export const TRACED = ["found or filled in, as traced", byContrast];

// The ways that this file has data for: [name, function of hair].
export const waysToColour = (hair) => [["direction", byDirection], ["class", byKind], ["radius", byRadius], hair.group ? ["material", byGroup] : null].filter(Boolean);

// Three numbers for each end of each segment; deeper fibers are darker.
export function coloursOf(hair, way) {
  const { position, n } = hair, { of, legend } = way(hair), out = new Float32Array(position.length);
  let low = Infinity, high = -Infinity;
  for (let i = 2; i < position.length; i += 3) { low = Math.min(low, position[i]); high = Math.max(high, position[i]); }
  for (let s = 0; s < n; s++) {
    const base = of(s);
    for (const e of [6 * s, 6 * s + 3]) {
      const shade = 0.35 + 0.65 * ((position[e + 2] - low) / (high - low || 1));
      for (let c = 0; c < 3; c++) out[e + c] = base[c] * shade;
    }
  }
  return { colours: out, legend };
}
