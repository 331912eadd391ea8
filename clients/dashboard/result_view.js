// The only file that knows the structure of result.json and of series records (docs/file-formats.md). Other files use
// its functions.
import { isNumber } from "./page_parts.js";

const CHANNEL = { r: 0, g: 1, b: 2 };

// The name of a parameter without its set: "C_R.r" for "warp.C_R.r".
const ownName = (p) => (p.set ? p.name.slice(p.set.length + 1) : p.name);

// Returns [{set, symbol, unit, flat: [{i, name, channel}]}] from parameters with names such as "C_R.r", "beta_TT". set:
// the group of fibers that they belong to, "" when there is one set.
export function parameterGroups(parameters) {
  const groups = [];
  parameters.forEach((p, i) => {
    const [, symbol, channel] = /^(.+?)(?:\.([rgb]))?$/.exec(ownName(p)), set = p.set ?? "";
    let group = groups.find((g) => g.symbol === symbol && g.set === set);
    if (!group) groups.push(group = { set, symbol, unit: p.unit ?? "", flat: [] });
    group.flat.push({ i, name: ownName(p), channel: channel in CHANNEL ? CHANNEL[channel] : -1 });
  });
  return groups;
}

// The meaning of each parameter by "MODEL NAME", from the catalogue of models of GET /v1/options; the name without the set.
export const parameterMeanings = (models) => new Map((models ?? []).flatMap((m) => m.parameters.map((p) => [`${m.id} ${p.name}`, p.meaning])));

// Describes the n numbers of a model's points: [{name, unit, lower, upper, fixed}]. A series describes its models; one
// without descriptions belongs to a job with a single model.
export function describedParameters(model, job, n) {
  if (model?.parameters?.length === n) return model.parameters;
  if (job.parameters?.length === n) return job.parameters;
  return Array.from({ length: n }, (_, i) => ({ name: `parameter ${i + 1}`, unit: "" }));
}

// Errors by which models are compared: if each photograph has a gain of its own, the errors with these gains.
function comparedErrors(m) {
  if (!isNumber(m.fit_rel_rms_with_gains)) return { fit: m.fit_rel_rms, fitSe: m.fit_rel_rms_se, held: m.heldout_rel_rms, heldSe: m.heldout_rel_rms_se, withGains: false };
  return { fit: m.fit_rel_rms_with_gains, fitSe: m.fit_rel_rms_with_gains_se, held: m.heldout_rel_rms_with_gains, heldSe: m.heldout_rel_rms_with_gains_se, withGains: true };
}

// Returns all models of the job: [{id, title, best, converged, fit, leftOut, held, withGains, paths, seconds,
// parameters}]
export function models(job) {
  return (job.result?.models ?? []).map((m) => ({
    leftOut: m.cross_validation?.rel_rms, leftOutSe: m.cross_validation?.rel_rms_se, id: m.id, title: m.title, best: m.best, converged: m.converged, paths: m.n_path_fit, seconds: m.fit_wall_s, parameters: fitted(m), ...comparedErrors(m),
  }));
}

// Returns the statements of the input files as sentences [{text, applied}], equal statements of several files as one;
// those that are not used come first.
export function statements(job) {
  const groups = new Map();
  for (const { file, statements: list } of job.result?.files ?? []) for (const s of list) {
    const key = JSON.stringify([s.name, s.use, s.reason]), group = groups.get(key);
    if (group) { group.others++; group.differ ||= group.value !== s.value; } else groups.set(key, { ...s, file, others: 0, differ: false });
  }
  return [...groups.values()].map((g) => ({ applied: g.use === "applied",
    text: `${g.file}${g.others ? ` and ${g.others} other file${g.others > 1 ? "s" : ""} state` : " states"} ${g.name} ${g.value}${g.differ ? " (others state other values)" : ""}: ${g.use === "applied" ? "applied" : `not used, ${g.reason}`}` }))
    .sort((a, b) => Number(a.applied) - Number(b.applied));
}

// Returns the fitted parameters of a job or of one of its models: [{set, name, unit, value, se, flags: [text], lower,
// upper}], the name without the set
export function fitted(of) {
  return (of.parameters ?? []).map((p) => {
    const flags = [];
    if (p.fixed) flags.push("fixed");
    else {
      if (typeof p.at_bound === "string") flags.push(`at ${p.at_bound} bound`);
      else if (p.at_bound) flags.push("at a bound");
      if (p.determined === false) flags.push("not determined");
      if (p.tied_to) flags.push(p.ratio === 1 ? `tied to ${p.tied_to}` : `${Number(p.ratio.toPrecision(3))} × ${p.tied_to}`);
      if (p.prior) flags.push(`prior ${p.prior.mean} ± ${p.prior.se}`);
    }
    return { set: p.set ?? "", name: ownName(p), unit: p.unit ?? "", value: p.value, se: p.standard_error, flags, lower: p.lower, upper: p.upper };
  });
}

// Returns the search for the fiber radius, {value, se, start, flags, curve: [{radius, f, se}]} by rising radius, or
// null.
export function radiusSearch(job) {
  const r = job.result?.radius;
  if (!r) return null;
  const flags = [r.at_bound ? "at the edge of its range" : null, r.determined ? null : "not determined"].filter(Boolean);
  const curve = r.curve.map((p) => ({ radius: p.radius_um, f: p.objective, se: p.objective_se })).sort((a, b) => a.radius - b.radius);
  return { value: r.radius_um, se: r.standard_error_um, start: r.start_um, flags, curve };
}

// Returns all configurations: [{name, sphere, filter, held, angles, measured, rendered, measuredPicture, renderedPicture, measuredLinear, renderedLinear, error, errorSe}],
// Linear: the OpenEXR files of the pictures; error: the relative error of the row; sphere: the rendering is of a sphere; filter: of the rendering, or null
export function configurations(job, urls) {
  return (job.result?.rows ?? []).map((c) => {
    return {
      name: c.name, sphere: c.rendering_shows === "sphere", filter: c.rendering_filter ?? null, held: c.set === "held-out", angles: c, measured: c.measured, rendered: c.rendered, error: c.rel_error ?? null, errorSe: c.rel_error_se,
      measuredPicture: urls.get(c.photograph_png) ?? null, renderedPicture: urls.get(c.rendering_png) ?? null,
      measuredLinear: urls.get(c.photograph_png?.replace(/\.png$/, ".exr")) ?? null, renderedLinear: urls.get(c.rendering_exr) ?? null,
    };
  });
}

// Returns the files for other programs: [{format, exact, error, errorSe, worst, row, warnings}]; error: relative RMS difference of
// their cloth from the job's renderings over its rows; worst: the largest one, in the row of that name; null where none is stated
export function exportsOf(job) {
  return (job.result?.exports ?? []).map((e) => {
    const errors = e.row_rel_errors ?? [], worst = errors.length ? Math.max(...errors) : null;
    return { format: e.format, exact: e.exact === true, error: e.row_rel_rms ?? null, errorSe: e.row_rel_rms_se ?? null, worst, row: job.result.rows?.[errors.indexOf(worst)]?.name ?? null, warnings: e.warnings ?? [] };
  });
}

// Returns the rendered lobes of a table: [{row: name, angles: degrees of the camera, rgb: [[r, g, b], ...]}]
export function lobesOf(job) {
  return (job.result?.lobes ?? []).map((l) => ({ row: l.row, angles: l.camera_theta_deg, rgb: l.rendered }));
}

// Photographs and renderings among the files of a job that has no result yet: [{name, photograph, rendering}], addresses
// or null
export function picturesSoFar(files) {
  const found = new Map();
  for (const { path, url } of files) {
    const [, folder, name] = /^(photographs|renderings)\/([^/]+)\.png$/.exec(path) ?? [];
    if (!folder) continue;
    if (!found.has(name)) found.set(name, { name, photograph: null, rendering: null });
    found.get(name)[folder === "photographs" ? "photograph" : "rendering"] = url;
  }
  return [...found.values()];
}

// The pictures of slices and the fiber file among the results.
export const sliceFiles = (files) => files.filter((f) => /(^|\/)slice[^/]*\.png$/.test(f.path));
export const fiberFile = (files) => files.find((f) => f.path === "fibers.hair") ?? null;
// The fibers as they were traced in a scan, before the seams of the tile were closed.
export const tracedFile = (files) => files.find((f) => f.path === "scan/fibers.hair") ?? null;
// How clearly the scan shows each point of the file; null without a scan.
export const contrastFile = (files) => files.find((f) => f.path === "scan/contrast.u8") ?? null;
export const residuals = (job) => ({
  fit: job.result?.fit_rel_rms, fitSe: job.result?.fit_rel_rms_se, held: job.result?.heldout_rel_rms, heldSe: job.result?.heldout_rel_rms_se,
  leftOut: job.result?.cross_validation?.rel_rms, leftOutSe: job.result?.cross_validation?.rel_rms_se, converged: job.result?.converged,
});
// The errors of a plain BRDF that was fitted to the same rows; undefined without one.
export const plainErrors = (job) => ({ fit: job.result?.skill?.plain_brdf?.fit_rel_rms, held: job.result?.skill?.plain_brdf?.heldout_rel_rms });
// Relative RMS errors of the channels apart: [{set, rgb: [{value, se}]}], without sets that have no rows.
export function channelErrors(job) {
  const of = (set, key) => ({ set, rgb: (job.result?.[key] ?? []).map((value, c) => ({ value, se: job.result[`${key}_se`]?.[c] })) });
  return [of("fitted", "fit_channel_rel_rms"), of("held out", "heldout_channel_rel_rms")].filter(({ rgb }) => rgb.length && rgb.every(({ value }) => isNumber(value)));
}
// The kinds of fibers in a scan: [{density, share, n, radius, radiusError}], density over the densest kind's
export const fiberKinds = (job) => (job.result?.geometry?.kinds ?? []).map((k) => ({ density: k.density, share: k.share, n: k.n_fiber, radius: k.radius_um, radiusError: k.radius_error_um }));

// The correlations of the parameters that are not fixed: {names, matrix}; null for fewer than two.
export function correlations(job) {
  const all = job.result?.parameters ?? [], full = job.result?.correlation;
  const free = all.map((_, i) => i).filter((i) => !all[i].fixed);
  if (!full || full.length !== all.length || free.length < 2) return null;
  return { names: free.map((i) => all[i].name), matrix: free.map((i) => free.map((j) => full[i][j])) };
}
// The reason for choosing the best of several models, as a sentence.
export const choiceOf = (job) => (job.result?.chosen_by === "cross_validation"
  ? "The best model has the lowest cross-validated error, over parts of the fitted rows that a fit to the others predicts; held-out rows have no part in the choice."
  : "The fitted rows are too few for cross-validation, so the best model has the lowest error over the fitted rows.");
export const finite = (x) => (isNumber(x) ? x : null);
