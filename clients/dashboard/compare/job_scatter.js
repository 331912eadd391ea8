// One quantity of many jobs against another, chosen by two selects: a point a job, with two standard errors either way.
import { el, isNumber, svg } from "../page_parts.js";

const W = 760, H = 400, L = 78, R = 18, T = 14, B = 48, MOST_TICK = 6;

function ticksOf(quantity, low, high) {
  if (quantity.texts) return quantity.texts.map((_, i) => i);
  const step = 10 ** Math.floor(Math.log10((high - low) / MOST_TICK)), wide = [1, 2, 5, 10].map((k) => k * step).find((s) => (high - low) / s <= MOST_TICK);
  return Array.from({ length: MOST_TICK + 2 }, (_, i) => (Math.ceil(low / wide) + i) * wide).filter((v) => v <= high);
}

function rangeOf(points, key, quantity) {
  if (quantity.texts) return [-0.5, quantity.texts.length - 0.5];
  const ends = points.flatMap((p) => [p[key].value - 2 * (p[key].se ?? 0), p[key].value + 2 * (p[key].se ?? 0)]);
  const low = Math.min(...ends), high = Math.max(...ends), more = 0.06 * (high - low) || Math.abs(high) * 0.1 || 1;
  return [low - more, high + more];
}

export function scatterOf(jobs, across, up) {
  const points = jobs.map(({ job, letter }) => ({ job, letter, x: across.of(job), y: up.of(job) })).filter((p) => isNumber(p.x?.value) && isNumber(p.y?.value));
  if (points.length === 0) return el("p", { class: "hint" }, "No job has both of these.");
  const [x0, x1] = rangeOf(points, "x", across), [y0, y1] = rangeOf(points, "y", up);
  const X = (v) => L + (W - L - R) * (v - x0) / (x1 - x0), Y = (v) => H - B - (H - T - B) * (v - y0) / (y1 - y0);
  const root = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "plot job-scatter", role: "group", "aria-label": `${up.name} against ${across.name}, ${points.length} jobs` });
  for (const v of ticksOf(across, x0, x1)) root.append(svg("line", { class: "axis", x1: X(v), x2: X(v), y1: T, y2: H - B }), svg("text", { x: X(v), y: H - B + 17, "text-anchor": "middle" }, across.show(v)));
  for (const v of ticksOf(up, y0, y1)) root.append(svg("line", { class: "axis", x1: L, x2: W - R, y1: Y(v), y2: Y(v) }), svg("text", { x: L - 6, y: Y(v) + 4, "text-anchor": "end" }, up.show(v)));
  root.append(svg("text", { class: "name", x: (L + W - R) / 2, y: H - 8, "text-anchor": "middle" }, across.name), svg("text", { class: "name", x: 16, y: (H - B + T) / 2, "text-anchor": "middle", transform: `rotate(-90 16 ${(H - B + T) / 2})` }, up.name));
  for (const p of points) {
    const x = X(p.x.value), y = Y(p.y.value), said = (q, v) => `${q.name} ${q.show(v.value)}${isNumber(v.se) ? ` ± ${q.show(v.se)}` : ""}`;
    const link = svg("a", { href: `#${p.job.id}` }, svg("title", {}, `${p.job.sample}: ${said(up, p.y)}; ${said(across, p.x)}`));
    if (isNumber(p.y.se)) link.append(svg("line", { class: "error", x1: x, x2: x, y1: Y(p.y.value - 2 * p.y.se), y2: Y(p.y.value + 2 * p.y.se) }));
    if (isNumber(p.x.se)) link.append(svg("line", { class: "error", x1: X(p.x.value - 2 * p.x.se), x2: X(p.x.value + 2 * p.x.se), y1: y, y2: y }));
    link.append(svg("circle", { cx: x, cy: y, r: 5, class: `point ${p.job.verdict?.code ?? ""}` }));
    if (p.letter) link.append(svg("text", { x: x + 8, y: y - 6 }, p.letter));
    root.append(link);
  }
  return root;
}
