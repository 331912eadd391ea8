// The profile of a single fiber as maps over two angles and as polar plots (fabric thesis, sections 4.3.2 and 4.5): measured
// beside fitted light in one colour scale. A map is of one pair of the other angles, which a list chooses.
import { el, svg } from "../page_parts.js";

const LEAST = 4, W = 360, H = 330, L = 52, R = 12, T = 10, B = 44, LEVELS = 64, TURN = 360;
const ANCHORS = [[13, 12, 40], [72, 24, 112], [168, 48, 98], [232, 108, 54], [250, 196, 84], [255, 252, 226]];

function colour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (ANCHORS.length - 1), i = Math.min(Math.floor(at), ANCHORS.length - 2);
  return `rgb(${ANCHORS[i].map((c, k) => Math.round(c + (at - i) * (ANCHORS[i + 1][k] - c))).join(" ")})`;
}

// The share of the colour scale: a root, so that dim modes are seen beside the bright one.
const shareOf = (value, top) => Math.sqrt(Math.max(value, 0) / top);
const around = (deg) => ((deg % TURN) + TURN) % TURN;
const short = (v) => String(Number(v.toPrecision(3)));
const distinct = (list) => new Set(list.map((v) => v.toFixed(3))).size;
const middle = (list) => [...list].sort((a, b) => a - b)[Math.floor(list.length / 2)];

// Rows that have the same values under `keys`, where `fits` says that they make a plot: [{rows, ...the values}].
function groupsOf(rows, keys, fits) {
  const found = new Map();
  for (const r of rows) {
    const key = keys.map((k) => r[k]).join(" ");
    if (!found.has(key)) found.set(key, { rows: [], ...Object.fromEntries(keys.map((k) => [k, r[k]])) });
    found.get(key).rows.push(r);
  }
  return [...found.values()].filter(fits);
}

// Largest and smallest number of a list of any length: a call takes some 60,000 arguments at most, a profile has up to 300,000 values.
export const largest = (list, least = -Infinity) => list.reduce((a, b) => Math.max(a, b), least);
export const smallest = (list, most = Infinity) => list.reduce((a, b) => Math.min(a, b), most);

const degrees = (name, value) => (Number.isFinite(value) ? `${name} ${short(value)}°` : null);
const named = (...parts) => parts.filter(Boolean).join(", ");

const light = (g) => g.rows.reduce((sum, r) => sum + Math.max(r.measured, 0), 0) / g.rows.length;
const brightest = (list) => list.reduce((best, g) => (light(g) > light(best) ? g : best));

// Of the angles along the fiber the brightest one for each direction of the light.
function brightestViews(groups) {
  const of = new Map();
  for (const g of groups) {
    const key = [g.thetaI, g.phiI, g.channel].join(" ");
    of.set(key, of.has(key) ? brightest([of.get(key), g]) : g);
  }
  return [...of.values()];
}

// The plots that a profile has: {id, title, groups, x, y, kind}.
export function profileViews(rows) {
  const source = (g) => degrees("light θi", g.thetaI), view = (g) => degrees("view θo", g.thetaO), turn = (g) => degrees("light φi", g.phiI);
  const views = [
    { id: "phi-phi", title: "φi, φo", kind: "map", name: (g) => named(source(g), view(g)), x: { of: (r) => r.phiI, title: "azimuth of the light φi" },
      y: { of: (r) => around(r.phiI + r.phi), title: "azimuth of the view φo" },
      groups: groupsOf(rows, ["thetaI", "thetaO", "channel"], (g) => distinct(g.rows.map((r) => r.phiI)) >= LEAST && g.rows.length >= LEAST * LEAST) },
    { id: "theta-phi", title: "θo, φd", kind: "map", name: (g) => named(source(g), turn(g)), x: { of: (r) => r.thetaO, title: "angle of the view along the fiber θo" },
      y: { of: (r) => r.phi, title: "azimuth of the view from the light φd" },
      groups: groupsOf(rows, ["thetaI", "phiI", "channel"], (g) => distinct(g.rows.map((r) => r.thetaO)) >= LEAST && distinct(g.rows.map((r) => r.phi)) >= LEAST) },
    { id: "polar", title: "polar", kind: "polar", name: (g) => named(source(g), turn(g), view(g)),
      groups: brightestViews(groupsOf(rows, ["thetaI", "thetaO", "phiI", "channel"], (g) => distinct(g.rows.map((r) => r.phi)) >= 2 * LEAST)) }];
  return views.filter((v) => v.groups.length > 0);
}

// Angles around the fiber that span most of a turn make a whole one; others keep their range.
function axisOf(spec, rows) {
  const values = rows.map(spec.of), low = smallest(values), high = largest(values), whole = spec.title.startsWith("azimuth") && high - low > 270;
  return { ...spec, whole, low: whole ? 0 : low, high: whole ? TURN : high, at: (r) => (whole ? around(spec.of(r)) : spec.of(r)) };
}

// Borders of the cells about sorted places: half way to the next one, at most `most` away, so that gaps stay empty.
function cells(places, axis) {
  const copies = axis.whole ? [...places.map((p) => ({ ...p, v: p.v - TURN })), ...places, ...places.map((p) => ({ ...p, v: p.v + TURN }))] : places;
  const list = copies.sort((a, b) => a.v - b.v), step = list.slice(1).map((p, i) => p.v - list[i].v), most = list.length > 1 ? 0.75 * middle(step) : 1;
  return list.map((p, i) => ({ ...p, from: p.v - Math.min(most, i > 0 ? step[i - 1] / 2 : most), to: p.v + Math.min(most, i < step.length ? step[i] / 2 : most) }));
}

const clip = (axis, cell, room) => [Math.max(cell.from, axis.low - room), Math.min(cell.to, axis.high + room)];

// The rectangles of a map, as one path for each level of the colour scale.
function paint(rows, x, y, value, top, place) {
  const columns = new Map(), paths = Array.from({ length: LEVELS }, () => []);
  for (const r of rows) {
    const key = x.at(r).toFixed(3);
    if (!columns.has(key)) columns.set(key, { v: x.at(r), rows: [] });
    columns.get(key).rows.push({ v: y.at(r), value: value(r) });
  }
  for (const column of cells([...columns.values()], x)) {
    const [left, right] = clip(x, column, x.whole ? 0 : place.room.x).map(place.x);
    if (!(right > left)) continue;
    for (const cell of cells(column.rows, y)) {
      const [low, high] = clip(y, cell, y.whole ? 0 : place.room.y).map(place.y);
      if (!(low > high) || !Number.isFinite(cell.value)) continue;
      const level = Math.min(LEVELS - 1, Math.floor(LEVELS * shareOf(cell.value, top)));
      paths[level].push(`M${left.toFixed(2)} ${low.toFixed(2)}H${right.toFixed(2)}V${high.toFixed(2)}H${left.toFixed(2)}Z`);
    }
  }
  return paths.map((p, i) => (p.length > 0 ? svg("path", { d: p.join(""), fill: colour((i + 0.5) / LEVELS), "shape-rendering": "crispEdges" }) : null)).filter(Boolean);
}

const ticks = (axis) => (axis.whole ? [0, 90, 180, 270, 360] : [0, 0.25, 0.5, 0.75, 1].map((k) => axis.low + k * (axis.high - axis.low)));

function mapOf(view, group, value, top, caption) {
  const x = axisOf(view.x, group.rows), y = axisOf(view.y, group.rows);
  const room = (axis) => (axis.whole ? 0 : 0.5 * (axis.high - axis.low) / Math.max(1, distinct(group.rows.map(axis.at)) - 1));
  const place = { room: { x: room(x), y: room(y) } }, spread = (axis, pad) => [axis.low - pad, Math.max(axis.high - axis.low + 2 * pad, 1e-9)];
  const [x0, xs] = spread(x, place.room.x), [y0, ys] = spread(y, place.room.y);
  place.x = (v) => L + (W - L - R) * (v - x0) / xs;
  place.y = (v) => H - B - (H - T - B) * (v - y0) / ys;
  const root = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "plot map", role: "img", "aria-label": `${caption}, ${view.name(group)}` });
  root.append(svg("rect", { class: "empty", x: L, y: T, width: W - L - R, height: H - T - B }), ...paint(group.rows, x, y, value, top, place));
  for (const v of ticks(x)) root.append(svg("text", { x: place.x(v), y: H - B + 15, "text-anchor": "middle" }, `${short(v)}°`));
  for (const v of ticks(y)) root.append(svg("text", { x: L - 5, y: place.y(v) + 4, "text-anchor": "end" }, `${short(v)}°`));
  root.append(svg("text", { x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle" }, x.title),
    svg("text", { transform: `translate(12 ${(T + H - B) / 2}) rotate(-90)`, "text-anchor": "middle" }, y.title));
  return el("figure", {}, root, el("figcaption", {}, caption));
}

function legend(top) {
  const width = 300, root = svg("svg", { viewBox: `0 0 ${width + 40} 34`, class: "plot scale", role: "img", "aria-label": `colour scale from 0 to ${short(top)}` });
  for (let i = 0; i < LEVELS; i++) root.append(svg("rect", { x: 20 + i * width / LEVELS, y: 2, width: width / LEVELS + 0.5, height: 12, fill: colour((i + 0.5) / LEVELS) }));
  for (const share of [0, 0.25, 0.5, 0.75, 1]) root.append(svg("text", { x: 20 + share * width, y: 28, "text-anchor": "middle" }, short(share * share * top)));
  return root;
}

// Radiance as the distance from the middle, by the azimuth of the view; the light comes from the right.
function polarOf(view, group, model, name) {
  const size = 360, half = size / 2, radius = half - 34, rows = [...group.rows].sort((a, b) => a.phi - b.phi);
  const values = rows.flatMap((r) => [r.measured, r.fitted[model]]).filter(Number.isFinite), top = largest(values, 1e-12);
  const at = (phi, v) => { const d = radius * Math.max(v, 0) / top, a = phi * Math.PI / 180; return [half + d * Math.cos(a), half - d * Math.sin(a)]; };
  const root = svg("svg", { viewBox: `0 0 ${size} ${size}`, class: "plot polar", role: "img", "aria-label": `measured and fitted radiance around the fiber, ${view.name(group)}` });
  for (const k of [0.5, 1]) root.append(svg("circle", { cx: half, cy: half, r: radius * k, class: "axis ring" }), svg("text", { x: half + 0.72 * radius * k, y: half - 0.72 * radius * k }, short(top * k)));
  for (const phi of [0, 90, 180, 270]) {
    const [x, y] = at(phi, top * 1.12);
    root.append(svg("text", { x, y: y + 4, "text-anchor": "middle" }, phi === 0 ? "light" : `${phi}°`));
  }
  const whole = rows.length > 2 && rows[rows.length - 1].phi - rows[0].phi > 270, points = rows.filter((r) => Number.isFinite(r.fitted[model])).map((r) => at(r.phi, r.fitted[model]).map((v) => v.toFixed(2)).join(","));
  root.append(svg(whole ? "polygon" : "polyline", { points: points.join(" "), fill: "none", stroke: "var(--accent)", "stroke-width": 1.8 }));
  for (const r of rows) { const [cx, cy] = at(r.phi, r.measured); root.append(svg("circle", { cx, cy, r: 2, fill: "var(--ink)" })); }
  return el("figure", {}, root, el("figcaption", {}, `${view.name(group)}: ● measured, line ${name}`));
}

// Six groups spread over all of them.
const spread = (list, most) => (list.length <= most ? list : Array.from({ length: most }, (_, k) => list[Math.round(k * (list.length - 1) / (most - 1))]));

// The part of the card that shows one kind of plot; `models` are ids, of which a list chooses one.
export function profileMaps(view, models) {
  const box = el("div", { class: "plots maps", "data-view": view.id }), scale = el("div", { class: "map-scale" });
  const option = (list) => list.map((text, i) => el("option", { value: i }, text));
  const group = el("select", { "aria-label": "angles" }, option(view.groups.map((g) => named(view.name(g), view.groups.some((o) => o.channel !== g.channel) ? g.channel : null))));
  const model = el("select", { "aria-label": "model" }, option(models));
  group.value = String(view.groups.indexOf(brightest(view.groups)));
  const draw = () => {
    const m = Number(model.value), g = view.groups[Number(group.value)];
    if (view.kind === "polar") { box.replaceChildren(...spread(view.groups, 6).map((one) => polarOf(view, one, m, models[m]))); return; }
    const top = largest(g.rows.flatMap((r) => [r.measured, r.fitted[m]]).filter(Number.isFinite), 1e-12);
    box.replaceChildren(mapOf(view, g, (r) => r.measured, top, "measured"), mapOf(view, g, (r) => r.fitted[m], top, `fitted, ${models[m]}`));
    scale.replaceChildren(legend(top), el("span", { class: "hint" }, "Radiance. The colours follow its root."));
  };
  group.addEventListener("change", draw);
  model.addEventListener("change", draw);
  draw();
  return el("div", {}, el("div", { class: "legend-row" }, view.kind === "map" && view.groups.length > 1 ? group : view.kind === "map" ? el("span", {}, view.name(view.groups[0])) : null, models.length > 1 ? model : null), box, scale);
}
