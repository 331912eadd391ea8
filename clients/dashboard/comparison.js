// Measured against rendered means: swatches of their colours, a scatter plot, and the curve of the fiber radius.
import { colour, el, svg } from "./page_parts.js";

const RGB = ["var(--red)", "var(--green)", "var(--blue)"];

export function picture(url, rgb, exposure, what) {
  if (url) return el("img", { src: url, alt: what, loading: "lazy", title: what });
  const swatch = el("div", { title: `${what}: mean ${rgb ? rgb.map((v) => v.toFixed(4)).join(", ") : "unknown"}` });
  if (rgb) swatch.style.background = colour(rgb, exposure);
  return swatch;
}

// Returns one exposure for all swatches, so that they can be compared. The brightest tenth of the means may clip.
export function commonExposure(list) {
  const peak = list.filter((c) => c.measured).map((c) => Math.max(...c.measured)).sort((a, b) => a - b);
  return peak.length ? 0.8 / Math.max(peak[Math.floor(0.9 * (peak.length - 1))], 1e-6) : 1;
}

function axisTicks(low, high) {
  const ticks = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++)
    for (const m of [1, 2, 5]) {
      const v = m * 10 ** e;
      if (v >= low && v <= high) ticks.push(v);
    }
  return ticks;
}

export function scatterPlot(list) {
  const points = list.filter((c) => c.measured && c.rendered)
    .flatMap((c) => c.measured.map((m, i) => ({ m, r: c.rendered[i], channel: i, c }))).filter((p) => p.m > 0 && p.r > 0);
  if (points.length === 0) return el("p", { class: "hint" }, "Nothing to compare.");
  const W = 520, H = 440, L = 52, B = 40, T = 10, R = 12;
  const values = points.flatMap((p) => [p.m, p.r]);
  const low = Math.min(...values) / 1.3, high = Math.max(...values) * 1.3;
  const t = (v) => Math.log(v / low) / Math.log(high / low);
  const X = (v) => L + t(v) * (W - L - R), Y = (v) => H - B - t(v) * (H - B - T);
  const root = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "scatter", role: "img", "aria-label": "rendered against measured mean radiance" });
  const k = 1.1, corner = (f) => [[low, low * f], [high, high * f]];
  const clip = ([x, y]) => `${X(Math.min(Math.max(x, low), high))},${Math.min(Math.max(Y(y), T), H - B)}`;
  root.append(svg("polygon", { class: "band", points: [...corner(k), ...corner(1 / k).reverse()].map(clip).join(" ") }),
    svg("line", { class: "one", x1: X(low), y1: Y(low), x2: X(high), y2: Y(high) }));
  for (const v of axisTicks(low, high)) {
    const label = v < 0.01 ? v.toExponential(0) : String(Number(v.toPrecision(1)));
    root.append(svg("line", { class: "axis", x1: X(v), y1: T, x2: X(v), y2: H - B }), svg("line", { class: "axis", x1: L, y1: Y(v), x2: W - R, y2: Y(v) }),
      svg("text", { x: X(v), y: H - B + 15, "text-anchor": "middle" }, label), svg("text", { x: L - 6, y: Y(v) + 4, "text-anchor": "end" }, label));
  }
  root.append(svg("text", { x: (L + W) / 2, y: H - 6, "text-anchor": "middle" }, "measured mean radiance"),
    svg("text", { x: 12, y: H / 2, "text-anchor": "middle", transform: `rotate(-90 12 ${H / 2})` }, "rendered"));
  for (const p of points) {
    const mark = svg("circle", { cx: X(p.m), cy: Y(p.r), r: 4, stroke: RGB[p.channel], "stroke-width": 1.6, fill: p.c.held ? "none" : RGB[p.channel], "fill-opacity": 0.75 });
    mark.append(svg("title", {}, `${p.c.name} ${"rgb"[p.channel]}: measured ${p.m.toPrecision(4)}, rendered ${p.r.toPrecision(4)}`));
    root.append(mark);
  }
  return [
    el("div", { class: "legend-row" }, el("span", {}, "● fitted"), el("span", {}, "○ held out"), el("span", {}, "shaded: ± 10 %"), el("span", {}, "logarithmic axes, colour = channel")),
    root,
  ];
}

// Plots the objective over the fiber radius with two standard errors either way. The line marks the fitted radius.
export function radiusPlot(search) {
  const W = 460, H = 220, L = 56, R = 12, T = 12, B = 34, list = search.curve;
  const low = Math.min(...list.map((p) => p.f - 2 * p.se)), high = Math.max(...list.map((p) => p.f + 2 * p.se));
  const from = Math.log(list[0].radius), to = Math.log(list[list.length - 1].radius);
  const x = (r) => L + (W - L - R) * (Math.log(r) - from) / (to - from), y = (f) => H - B - (H - T - B) * (f - low) / (high - low);
  const parts = [svg("rect", { x: L, y: T, width: W - L - R, height: H - T - B, fill: "none", stroke: "var(--line)" })];
  const label = (text, at) => { const t = svg("text", { fill: "currentColor", "font-size": 11, ...at }); t.textContent = text; parts.push(t); };
  const inside = (r) => Math.min(Math.max(x(r), L), W - R);
  parts.push(svg("rect", { x: inside(Math.max(search.value - search.se, 1e-9)), y: T, width: inside(search.value + search.se) - inside(Math.max(search.value - search.se, 1e-9)), height: H - T - B, fill: "var(--accent)", opacity: 0.15 }),
    svg("line", { x1: inside(search.value), x2: inside(search.value), y1: T, y2: H - B, stroke: "var(--accent)" }));
  for (const p of list)
    parts.push(svg("line", { x1: x(p.radius), x2: x(p.radius), y1: y(p.f - 2 * p.se), y2: y(p.f + 2 * p.se), stroke: "var(--ink)", opacity: 0.6 }), svg("circle", { cx: x(p.radius), cy: y(p.f), r: 3, fill: "var(--accent)" }));
  for (const r of [list[0].radius, Math.exp((from + to) / 2), list[list.length - 1].radius]) label(Number(r.toPrecision(3)), { x: x(r), y: H - B + 15, "text-anchor": "middle" });
  for (const f of [low, high]) label(Number(f.toPrecision(2)), { x: L - 6, y: y(f) + (f === low ? 0 : 10), "text-anchor": "end" });
  label("fiber radius, µm", { x: (L + W - R) / 2, y: H - 4, "text-anchor": "middle" });
  return el("div", {}, el("p", { class: "hint" }, "Sum of squared errors of the fit at each radius ± 2 s.e. The band is the fitted radius with its standard error."), svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "radius" }, ...parts));
}
