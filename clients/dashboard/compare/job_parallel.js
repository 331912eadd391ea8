// Parallel coordinates: an axis for each quantity, a line for each job.
import { el, isNumber, svg } from "../page_parts.js";

const H = 340, T = 60, B = 30, GAP = 130, SIDE = 70;

export function parallelOf(jobs, axes) {
  if (axes.length < 2) return el("p", { class: "hint" }, "Choose two quantities or more.");
  const W = 2 * SIDE + GAP * (axes.length - 1), x = (i) => SIDE + GAP * i;
  const scales = axes.map((q) => {
    const values = jobs.map(({ job }) => q.of(job)?.value).filter(isNumber), low = Math.min(...values), high = Math.max(...values);
    return { low, high, y: (v) => (high > low ? H - B - (H - T - B) * (v - low) / (high - low) : (H - B + T) / 2) };
  });
  const root = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "plot job-parallel", role: "group", "aria-label": `${jobs.length} jobs over ${axes.map((q) => q.name).join(", ")}` });
  root.setAttribute("width", String(W));
  axes.forEach((q, i) => {
    const words = q.name.match(/.{1,18}(?:\s|$)|\S{1,18}/g) ?? [q.name];
    root.append(svg("line", { class: "axis", x1: x(i), x2: x(i), y1: T, y2: H - B }),
      ...words.slice(0, 3).map((line, k) => svg("text", { class: "name", x: x(i), y: 14 + 13 * k, "text-anchor": "middle" }, line.trim())),
      svg("text", { x: x(i) + 5, y: T - 3 }, q.show(scales[i].high)), svg("text", { x: x(i) + 5, y: H - B + 14 }, q.show(scales[i].low)));
  });
  for (const { job, letter } of jobs) {
    const at = axes.map((q, i) => [x(i), q.of(job)?.value, scales[i]]).filter(([, v]) => isNumber(v)).map(([px, v, s]) => `${px},${s.y(v)}`);
    if (at.length < 2) continue;
    const [endX, endY] = at[at.length - 1].split(",").map(Number);
    const line = svg("a", { href: `#${job.id}` }, svg("title", {}, job.sample), svg("polyline", { points: at.join(" "), class: `line ${job.verdict?.code ?? ""}` }));
    if (letter) line.append(svg("text", { x: endX + 6, y: endY + 4 }, letter));
    root.append(line);
  }
  return el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "parallel coordinates" }, root);
}
