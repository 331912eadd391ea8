// The profile of a single fiber, from profile.csv: maps and polar plots (profile_maps.js), and curves: measured radiances as
// dots, the fitted models as lines, a plot for each pair of angles along the fiber.
import { el, svg } from "../page_parts.js";
import { raw } from "../server_link.js";
import { largest, profileMaps, profileViews, smallest } from "./profile_maps.js";

const MOST_PLOT = 6, LEAST_ROW = 4, W = 380, H = 210, L = 46, R = 10, T = 10, B = 36;
const COLOURS = ["var(--accent)", "var(--green)", "var(--warn)", "var(--red)"];

// Returns {models, rows: [{thetaI, phiI, thetaO, phi, channel, measured, fitted: [..]}]}; phiI is NaN where the profile has no
// azimuth of the light.
export function readProfile(text) {
  const [head, ...lines] = text.trim().split(/\r?\n/).filter((line) => line !== "" && !line.startsWith("#")).map((line) => line.split(","));
  const first = head.indexOf("radiance") + 1, at = (cells, name) => (head.includes(name) ? cells[head.indexOf(name)] : NaN);
  return { models: head.slice(first), rows: lines.map((cells) => ({ thetaI: Number(at(cells, "theta_i_deg")), phiI: Number(at(cells, "phi_i_deg")), thetaO: Number(at(cells, "theta_o_deg")),
    phi: Number(at(cells, "phi_deg")), channel: at(cells, "channel"), measured: Number(cells[first - 1]), fitted: cells.slice(first).map(Number) })) };
}

// Rows of one direction of the light, one angle along the fiber and one channel, by phi.
function slicesOf(rows) {
  const slices = new Map();
  for (const r of rows) {
    const key = [r.thetaI, r.phiI, r.thetaO, r.channel].join(" ");
    if (!slices.has(key)) slices.set(key, { ...r, rows: [] });
    slices.get(key).rows.push(r);
  }
  for (const slice of slices.values()) slice.rows.sort((a, b) => a.phi - b.phi);
  return [...slices.values()].filter((s) => s.rows.length >= LEAST_ROW);
}

function plot(slice, models) {
  const { rows } = slice, top = 1.08 * largest(rows.flatMap((r) => [r.measured, ...r.fitted]).filter(Number.isFinite), 1e-12);
  const from = rows[0].phi, to = rows[rows.length - 1].phi, low = smallest(rows.map((r) => r.measured), 0);
  const x = (phi) => L + (W - L - R) * (phi - from) / Math.max(to - from, 1e-9), y = (v) => H - B - (H - T - B) * (v - low) / (top - low);
  const name = `light ${slice.thetaI}°, view ${slice.thetaO}° from the fiber's normal plane${Number.isNaN(slice.phiI) ? "" : `, light at azimuth ${slice.phiI}°`}${slice.channel ? `, ${slice.channel}` : ""}`;
  const root = svg("svg", { viewBox: `0 0 ${W} ${H}`, class: "plot", role: "img", "aria-label": `measured and fitted radiance, ${name}` });
  const text = (words, at) => root.append(svg("text", at, words));
  for (const k of [0, 0.5, 1]) {
    const v = low + k * (top - low) / 1.08, phi = from + k * (to - from);
    root.append(svg("line", { class: "axis", x1: L, x2: W - R, y1: y(v), y2: y(v) }));
    text(String(Number(v.toPrecision(2))), { x: L - 5, y: y(v) + 4, "text-anchor": "end" });
    text(`${Number(phi.toPrecision(3))}°`, { x: x(phi), y: H - B + 15, "text-anchor": k === 0 ? "start" : k === 1 ? "end" : "middle" });
  }
  text("azimuth of the view from the light", { x: (L + W - R) / 2, y: H - 4, "text-anchor": "middle" });
  models.forEach((_, m) => root.append(svg("polyline", { fill: "none", stroke: COLOURS[m % COLOURS.length], "stroke-width": 1.8, points: rows.filter((r) => Number.isFinite(r.fitted[m])).map((r) => `${x(r.phi)},${y(r.fitted[m])}`).join(" ") })));
  for (const r of rows) root.append(svg("circle", { cx: x(r.phi), cy: y(r.measured), r: 2.2, fill: "var(--ink)" }));
  return el("figure", {}, root, el("figcaption", {}, name));
}

// Evenly spread over the slices, when there are more than fit.
const chosen = (list) => (list.length <= MOST_PLOT ? list : Array.from({ length: MOST_PLOT }, (_, k) => list[Math.round(k * (list.length - 1) / (MOST_PLOT - 1))]));

function curves(slices, models) {
  const legend = models.map((id, m) => el("span", {}, el("i", { class: `line line-${m % COLOURS.length}` }), id));
  return [el("div", { class: "legend-row" }, el("span", {}, "● measured"), legend, slices.length > MOST_PLOT ? el("span", {}, `${MOST_PLOT} of ${slices.length} pairs of angles`) : null),
    slices.length ? el("div", { class: "plots" }, chosen(slices).map((s) => plot(s, models))) : el("p", { class: "hint" }, "No pair of angles has four directions or more, so there is no curve to draw.")];
}

export function profilePlot(profile, files) {
  const box = el("div", { id: "profile-plot" }, el("p", { class: "hint" }, "Loading the profile ..."));
  const file = files.find((f) => f.path === profile.csv);
  const load = async () => {
    if (!file) throw new Error(`the results have no file ${profile.csv}`);
    const { models, rows } = readProfile(await (await raw("GET", file.url)).text()), slices = slicesOf(rows), views = profileViews(rows);
    const shown = el("div"), buttons = [["curves", "curves"], ...views.map((v) => [v.id, v.title])].map(([id, title]) => el("button", { type: "button", "data-view": id, onclick: () => show(id) }, title));
    const show = (id) => {
      for (const b of buttons) b.setAttribute("aria-pressed", String(b.dataset.view === id));
      shown.replaceChildren(...(id === "curves" ? curves(slices, models) : [profileMaps(views.find((v) => v.id === id), models)]));
    };
    box.replaceChildren(views.length > 0 ? el("div", { class: "view-row", role: "group", "aria-label": "plots of the profile" }, buttons) : "", shown);
    show(views[0]?.id === "phi-phi" ? "phi-phi" : "curves");
  };
  load().catch((error) => box.replaceChildren(el("p", { class: "hint fault" }, `The profile cannot be drawn: ${error.message}.`)));
  return box;
}
