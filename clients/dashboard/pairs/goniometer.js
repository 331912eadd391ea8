// Goniometric plots of a table of measurements: for each lamp the measured and rendered radiance over the camera's angle.
import { el, svg } from "../page_parts.js";

const W = 330, H = 196, X = W / 2, Y = H - 22, R = 150, SAME = 1e-4, SHOWN = 24;
const COLORS = ["var(--accent)", "var(--red)", "var(--green)", "#8e44ad", "#b9770e", "#117a8b"];
const level = (rgb) => (rgb[0] + rgb[1] + rgb[2]) / 3;
const near = (a, b) => Math.abs(a - b) < SAME;
const turn = (deg, whole) => { const t = ((deg % whole) + whole) % whole; return whole - t < SAME ? 0 : t; };
const degrees = (x) => `${Number(x.toFixed(1))}°`;

// The plane of the camera beside that of the lamp, 0..180°, and its angle from the normal, positive away from the lamp.
function place(a) {
  const apart = turn(a.camera_phi_deg - a.light_phi_deg, 360), away = apart > 90 - SAME && apart < 270 - SAME;
  return { plane: turn(apart, 180), theta: away ? a.camera_theta_deg : -a.camera_theta_deg };
}

const sameLamp = (a, b) => near(a.light_theta_deg, b.light_theta_deg) && (a.light_theta_deg < SAME || near(turn(a.light_phi_deg - b.light_phi_deg, 360), 0));

// [{angles: of the first row, rows: [...], lobes: [{plane, ...}]}]; list: configurations of a job; lobes: lobesOf it
function lamps(list, lobes) {
  const found = [];
  for (const c of list) {
    let lamp = found.find((l) => sameLamp(l.angles, c.angles));
    if (!lamp) found.push(lamp = { angles: c.angles, rows: [], lobes: [] });
    lamp.rows.push({ c, ...place(c.angles) });
  }
  for (const lobe of lobes) {
    const lamp = found.find((l) => l.rows.some((r) => r.c.name === lobe.row));
    if (lamp) lamp.lobes.push({ ...lobe, plane: lamp.rows.find((r) => r.c.name === lobe.row).plane });
  }
  return found;
}

function plot({ angles, rows, lobes }) {
  const most = 1.25 * Math.max(1e-9, ...rows.flatMap(({ c }) => [level(c.measured), level(c.rendered)]));
  const at = (deg, value) => [X + R * value / most * Math.sin(deg * Math.PI / 180), Y - R * value / most * Math.cos(deg * Math.PI / 180)].map((v) => v.toFixed(1));
  const planes = [];
  const color = (plane) => {
    let k = planes.findIndex((p) => near(p, plane));
    if (k < 0) k = planes.push(plane) - 1;
    return COLORS[k % COLORS.length];
  };
  const root = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "goniometer", role: "img", "aria-label": `radiance over the angle of the camera, lamp at ${degrees(angles.light_theta_deg)}` });
  for (const half of [0.5, 1]) root.append(svg("path", { class: "axis", d: `M${X - half * R} ${Y} A${half * R} ${half * R} 0 0 1 ${X + half * R} ${Y}` }),
    svg("text", { x: X + half * R, y: Y + 13, "text-anchor": "middle" }, (most * half).toPrecision(2)));
  for (let deg = -90; deg <= 90; deg += 30) { const [x, y] = at(deg, most); root.append(svg("line", { class: "axis", x1: X, y1: Y, x2: x, y2: y })); }
  if (angles.light_theta_deg < 90) {
    const [x, y] = at(-angles.light_theta_deg, 1.08 * most);
    root.append(svg("line", { class: "lamp", x1: X, y1: Y, x2: x, y2: y }), svg("circle", { class: "lamp", cx: x, cy: y, r: 5 }));
  }
  for (const lobe of lobes) {
    const points = lobe.rgb.map((rgb, k) => [lobe.angles[k], level(rgb)]).filter(([, v]) => v <= most).map(([deg, v]) => at(deg, v).join(",")).join(" ");
    root.append(svg("polyline", { points, fill: "none", stroke: color(lobe.plane), "stroke-width": 1.6 }));
  }
  for (const { c, plane, theta } of rows) {
    const [cx, cy] = at(theta, level(c.measured)), mark = svg("circle", { class: "measured", cx, cy, r: 3.2, stroke: color(plane), "stroke-width": 1.4, fill: c.held ? "none" : color(plane) });
    mark.append(svg("title", {}, `${c.name}: measured ${level(c.measured).toPrecision(4)}, rendered ${level(c.rendered).toPrecision(4)}`));
    root.append(mark);
  }
  const legend = planes.map((p, k) => {
    const line = el("span", { class: "swatch" }, "▬ ");
    line.style.color = COLORS[k % COLORS.length];
    return el("span", {}, line, p < SAME ? "plane of the lamp" : `plane turned by ${degrees(p)}`, " ");
  });
  return el("figure", {}, root, el("figcaption", {}, el("b", {}, `Lamp ${degrees(angles.light_theta_deg)} / ${degrees(angles.light_phi_deg)} `), legend));
}

// Returns the plots, or null for a job without a table.
export function goniometer(list, lobes) {
  if (lobes.length === 0) return null;
  const all = lamps(list.filter((c) => c.measured && c.rendered), lobes), shown = all.slice(0, SHOWN);
  return el("div", { id: "goniometer" },
    el("p", { class: "hint" }, "Radiance (mean of the channels) over the angle of the camera from the normal, to the right away from the lamp. Lines: rendered, as far as they fit; dots: measured; rings: held out.",
      all.length > SHOWN ? ` ${SHOWN} of ${all.length} lamps.` : ""),
    el("div", { class: "goniometers" }, shown.map(plot)));
}
