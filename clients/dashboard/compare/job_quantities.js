// The quantities by which many jobs are plotted: errors, times, dates, tags, and the parameters of their best models.
import { fitted, residuals } from "../result_view.js";
import { isNumber, percent, withError } from "../page_parts.js";

const HOUR_S = 3600;

function parametersOf(jobs) {
  const found = new Map();
  for (const { job } of jobs)
    for (const p of fitted(job)) {
      const key = `${job.result.model} ${p.set}.${p.name}`, name = `${p.set ? `${p.set} ` : ""}${p.name}${p.unit ? ` (${p.unit === "deg" ? "degrees" : p.unit})` : ""}`;
      if (!found.has(key)) found.set(key, { key, name, model: job.result.model, set: p.set, own: p.name });
    }
  const models = new Set([...found.values()].map((p) => p.model)).size;
  return [...found.values()].map((p) => ({
    key: p.key, name: models > 1 ? `${p.name}, ${p.model}` : p.name, group: "Parameters", show: (v) => String(Number(v.toPrecision(4))),
    of: (job) => {
      const mine = job.result.model === p.model ? fitted(job).find((q) => q.set === p.set && q.name === p.own) : null;
      return mine ? { value: mine.value, se: mine.flags.includes("fixed") ? null : mine.se } : null;
    },
  }));
}

const error = (key, name) => ({ key, name, group: "Errors", show: (v) => percent(v, 1), of: (job) => ({ value: residuals(job)[key], se: residuals(job)[`${key}Se`] }) });

// jobs: columns with results. Returns [{key, name, group, show(value), of(job): {value, se} or null, texts?}]; texts: the
// value is a number of this list of words.
export function quantities(jobs) {
  const tags = [...new Set(jobs.flatMap(({ job }) => job.tags ?? []))].sort();
  const words = [...tags, "no tag"];
  const list = [
    error("held", "error over held-out rows"), error("leftOut", "error, cross-validated"), error("fit", "error over fitted rows"),
    { key: "finished", name: "date of the result", group: "Jobs", show: (v) => new Date(1000 * v).toLocaleDateString(), of: (job) => ({ value: job.finished_unix_s, se: null }) },
    { key: "took", name: "time to compute (hours)", group: "Jobs", show: (v) => withError(v, null), of: (job) => ({ value: (job.finished_unix_s - job.started_unix_s) / HOUR_S, se: null }) },
    ...(tags.length ? [{ key: "tag", name: "tag (the first)", group: "Jobs", texts: words, show: (v) => words[Math.round(v)] ?? "", of: (job) => ({ value: words.indexOf((job.tags ?? [])[0] ?? "no tag"), se: null }) }] : []),
    ...parametersOf(jobs),
  ];
  return list.filter((q) => jobs.some(({ job }) => isNumber(q.of(job)?.value)));
}

// True where the jobs do not all have the same value.
export function varies(quantity, jobs) {
  const values = jobs.map(({ job }) => quantity.of(job)?.value).filter(isNumber);
  return values.length > 1 && Math.max(...values) > Math.min(...values);
}
