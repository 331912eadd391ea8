// Shows the quality of the job's geometry: the key figures, the length distribution, and a link to the full report.
import { el, isNumber, percent, withError } from "../page_parts.js";
import { fiberKinds } from "../result_view.js";

const SHOWN = 6; // figures

const number = (x, digits = 3) => (isNumber(x) ? String(Number(x.toPrecision(digits))) : "–");
const pair = (v, show) => (v ? v.map((x) => (isNumber(x) ? show(x) : "–")).join(" / ") : "–");

const radius = (g) => (g.radius_per_axis ? g.radius_um.map((r, i) => withError(r, g.radius_se_um?.[i])).join(" / ") : withError(g.mean_radius_um, g.radius_se_um?.[0])) + " µm";

// The description of a trial's phantom.
const phantomFibers = (t) => [`radii spread by ${percent(t.radius_spread, 1)}`,
  t.axis_ratio > 1 && `ratios of axes ${number(t.axis_ratio)} ± ${number(t.axis_ratio_spread, 2)}`,
  t.lumen > 0 && `lumens ${number(t.lumen, 2)} ± ${number(t.lumen_spread, 2)} of the width`,
  !(t.axis_ratio > 1) && !(t.lumen > 0) && "solid discs"].filter(Boolean).join(", ");

// Returns rows [name, value, meaning] from the geometry of result.json.
export function qualityRows(g) {
  const rows = [["fibers", `${g.n_fiber}, ${number(g.total_length_mm)} mm`, ""], ["radius", radius(g), g.radius_per_axis ? "weft / warp / pile" : ""]];
  if (g.input === "volume") rows.push(
    ["fibers in the scan", g.grade ? `${g.grade.verdict}, ${percent(g.grade.safe_share, 0)} of the length is sure` : "–", "whether the scan shows single fibers, and for which share of their length"],
    ["valley between neighbours", isNumber(g.grade?.valley_depth) ? percent(g.grade.valley_depth, 0) : "–", "median fall of the density between fibers side by side; small also where they touch"],
    ["material that no fiber explains", isNumber(g.grade?.unexplained_share) ? percent(g.grade.unexplained_share, 1) : "–", g.grade?.unexplained_slices ? `away from every traced fiber; most in slices ${g.grade.unexplained_slices.join(", ")} across x, y, z` : "away from every traced fiber"],
    ["material explained (Dice)", number(g.dice), "overlap of fibers and material; 1 is complete"],
    ["gaps bridged, pieces joined", `${g.n_gap_bridged}, ${g.n_joined}`, ""],
    ["fiber diameter", `${number(g.fiber_diameter_voxel)} voxels`, "fibers are distinguished from 4 on"],
    ["direction noise", pair(g.direction_noise_deg, (x) => `${number(x)}°`), "between neighbouring voxels, before / after fiber directions replaced those of voxels"],
    ["density step at the seams", pair(g.seam_density?.ratio, (x) => number(x)), "across x / y; 1 is no seam"]);
  const t = g.trial;
  if (t) rows.push(["what this scan can give", `${percent(t.recall, 1)} of the length, axes to ${number(t.axis_rms_voxel, 2)} voxels, ${number(t.fragments)} pieces a fiber, ${number(t.merges, 2)} merges, radii to ${percent(t.radius_rms, 1)}`,
    `of a phantom of these fibers (${phantomFibers(t)}) with the noise and blur of this scan`]);
  const s = g.seam_fibers;
  rows.push(["fiber ends that continue", pair(s?.continued, (x) => percent(x, 0)),
    s?.found && s.n_joined > 0 ? `across the seams in x / y; ${pair(s.found.continued, (x) => percent(x, 0))} as found, ${s.n_joined} pairs joined` : "across the seams in x / y"]);
  const a = g.alignment;
  if (a) rows.push(["alignment", a.applied ? `turned ${number(a.rotation_deg)}°, sheared ${number(a.shear_deg)}°, tilted ${number(a.tilt_deg)}°` : "not needed or not possible",
    isNumber(a.standard_error_deg) && a.outcome === "found" ? `standard error ${number(a.standard_error_deg, 2)}°` : ""]);
  if (g.crop && g.options?.crop_voxel) rows.push(["cropped to", g.options.crop_voxel.join(", "), "x0, y0, z0, x1, y1, z1"]);
  return rows;
}

// Thick before thin, or dense before light: the content of a card, or null for a cloth whose fibers are of one kind.
export function kindsTable(job) {
  const kinds = fiberKinds(job);
  if (kinds.length < 2) return null;
  const cell = (text) => el("td", { class: "number" }, text);
  const rows = kinds.map((k, i) => el("tr", {}, el("td", {}, String(i + 1)), cell(percent(k.density, 0)), cell(isNumber(k.radius) ? `${withError(k.radius, k.radiusError)} µm` : "–"), cell(String(k.n ?? "–")), cell(percent(k.share, 0))));
  return [el("p", { class: "hint" }, "The scan shows fibers of different density or thickness. Densities are over those of the densest kind."),
    el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "kinds of fibers" }, el("table", { id: "fiber-kinds" },
      el("thead", {}, el("tr", {}, el("th", {}, "Kind"), ["Density", "Radius", "Fibers", "Share of the length"].map((h) => el("th", { class: "number" }, h)))), el("tbody", {}, rows)))];
}

export function qualityCard(job, files) {
  const g = job.result?.geometry, find = (path) => files.find((f) => f.path === path);
  if (!g) return null;
  const plot = find("pictures/fiber-lengths.svg"), page = find("quality.html");
  const table = (rows) => el("table", {}, el("tbody", {}, rows.map(([name, value, hint]) => el("tr", {}, el("td", {}, name, hint ? el("div", { class: "hint" }, hint) : ""), el("td", { class: "number" }, value)))));
  const rows = qualityRows(g);
  return el("div", { id: "quality" },
    el("div", { class: "columns" },
      el("div", {}, table(rows.slice(0, SHOWN)), rows.length > SHOWN ? el("details", {}, el("summary", {}, `${rows.length - SHOWN} more figures`), table(rows.slice(SHOWN))) : null),
      plot ? el("img", { src: plot.url, alt: "length distribution of the fibers", class: "plot", loading: "lazy" }) : null),
    page ? el("p", {}, el("a", { href: page.url, target: "_blank" }, "Full quality report")) : null);
}
