// The numbers at the top of a job's page: its error, how many parameters are determined, the geometry, and the time.
import { duration, el, isNumber, percent, percentWithError, withError } from "../page_parts.js";
import { fitted, residuals } from "../result_view.js";

const MOST = 4;
const GRADES = { resolved: "shows single fibers", partly: "shows single fibers in part", unresolved: "does not show single fibers" };

// The error that judges the fit: of rows that no fit has seen, where there are any.
function errorOf(job) {
  const { fit, fitSe, leftOut, leftOutSe, held, heldSe } = residuals(job), best = job.result?.profile?.models?.find((m) => m.best);
  if (isNumber(held)) return [percentWithError(held, heldSe), "error over held-out rows", "relative RMS error of rows that were never fitted"];
  if (isNumber(leftOut)) return [percentWithError(leftOut, leftOutSe), "error, cross-validated", "relative RMS error over parts of the rows that a fit to the others predicts"];
  if (isNumber(fit)) return [percentWithError(fit, fitSe), "error over fitted rows", "relative RMS error"];
  return best ? [percentWithError(best.rel_rms), "error over the profile", "relative RMS residual of the fitted model"] : null;
}

function determinedOf(job) {
  const best = job.result?.profile?.models?.find((m) => m.best), free = fitted(best ?? job).filter((p) => !p.flags.includes("fixed"));
  if (!free.length) return null;
  const known = free.filter((p) => !p.flags.includes("not determined")).length;
  return [`${known} of ${free.length}`, "parameters determined", "by the measurements; the others could have other values"];
}

function geometryOf(g) {
  if (!g || !isNumber(g.n_fiber)) return [];
  const fibers = [String(g.n_fiber), "fibers", `${Number((g.total_length_mm ?? 0).toPrecision(3))} mm in one tile`];
  const radius = isNumber(g.mean_radius_um) ? [`${withError(g.mean_radius_um, g.radius_se_um?.[0])} µm`, "mean fiber radius", ""] : null;
  const grade = g.grade ? [percent(g.grade.safe_share, 0), "of the fiber length is sure", `the scan ${GRADES[g.grade.verdict] ?? g.grade.verdict}`] : null;
  return [grade ?? fibers, grade ? fibers : radius, grade ? radius : null].filter(Boolean);
}

// Returns [[value, name, explanation]], four at most.
export function keyNumbers(job) {
  const took = isNumber(job.started_unix_s) && isNumber(job.finished_unix_s) ? [duration(job.finished_unix_s - job.started_unix_s), "to compute", "hours, minutes and seconds"] : null;
  const fit = [errorOf(job), determinedOf(job)].filter(Boolean);
  return [...fit, ...geometryOf(job.result?.geometry).slice(0, MOST - fit.length - (took ? 1 : 0)), took].filter(Boolean);
}

export const numbersNode = (job) => el("dl", { class: "key-numbers", id: "key-numbers" },
  keyNumbers(job).map(([value, name, title]) => el("div", { title }, el("dt", {}, name), el("dd", {}, value))));
