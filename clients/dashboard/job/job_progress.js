// How far a job is: its stages, the time left, and notes about faults and warnings.
import { duration, el, isNumber, percent, timeLeft, when } from "../page_parts.js";

export const LIVE = new Set(["queued", "running", "paused"]);
export const MAKING = new Set(["waiting", "running"]); // of the picture and the twin after the result
const SHOWN_WARNINGS = 2; // of a job that has no result

export function stagesOf(job, stages) {
  if (job.state === "succeeded" || job.state === "draft") return [];
  return stages.map((s, i) => {
    const over = job.i_stage !== null && i < job.i_stage, now = job.state === "running" && i === job.i_stage;
    const fill = el("div", { class: "fill" });
    if (!over && i === job.i_stage) fill.style.width = `${100 * (job.stage_fraction || 0)}%`;
    return el("div", { class: `stage${over ? " done" : ""}${now ? " now" : ""}`, title: s.title },
      el("div", { class: "track" }, fill), el("div", { class: "name" }, s.name));
  });
}

const fact = (name, value) => el("span", {}, `${name} `, el("b", {}, value));

// Facts about a job that has no result yet, or whose time of creation is all there is to say.
export function factsOf(job) {
  const facts = [];
  if (LIVE.has(job.state)) facts.push(fact("done", percent(job.fraction, 0)), fact("time left", timeLeft(job)));
  if (job.state === "running" && /^(fitting|fiber radius)/.test(job.message)) facts.push(fact("now", job.message));
  if (job.state === "paused" && job.message) facts.push(fact("paused:", job.message));
  if (LIVE.has(job.state) && isNumber(job.step)) facts.push(fact("step", String(job.step)));
  if (!LIVE.has(job.state) && isNumber(job.started_unix_s) && isNumber(job.finished_unix_s)) facts.push(fact(job.state === "succeeded" ? "finished" : "stopped", when(job.finished_unix_s)), fact("took", duration(job.finished_unix_s - job.started_unix_s)));
  if (job.attempt > 1) facts.push(fact("attempt", String(job.attempt)));
  facts.push(fact("created", when(job.created_unix_s)));
  return facts;
}

export function notesOf(job) {
  const warnings = job.warnings.map((w) => el("p", { class: "note" }, w));
  const open = job.state === "succeeded" ? 0 : SHOWN_WARNINGS, left = warnings.length - open; // the result comes first
  const notes = warnings.slice(0, open);
  if (left > 0) notes.push(el("details", { id: "warnings" }, el("summary", {}, `${left}${open ? " more" : ""} warning${left > 1 ? "s" : ""}`), el("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "more warnings" }, warnings.slice(open))));
  if (job.error && !LIVE.has(job.state)) {
    const field = job.error.field && !job.error.text.includes(job.error.field) ? `${job.error.field}: ` : "";
    notes.push(el("p", { class: "note bad" }, field + job.error.text));
  }
  if (job.missing_files?.length && job.state === "draft") notes.push(el("p", { class: "note" }, `Files still missing: ${job.missing_files.join(", ")}`));
  if (job.result?.converged === false && !job.warnings.some((w) => w.includes("not converged"))) notes.push(el("p", { class: "note" }, `The fit has not converged: ${job.result.reason ?? "the parameters are the best point found"}`));
  return notes;
}

// The picture and the twin that are made after the result: `state` of GET /v1/jobs/{id}/pictures, or null.
export function laterOf(pictures, act) {
  const words = { waiting: "A picture and the twin are made when no job waits or runs.", cancelled: "The picture and the twin were stopped.", failed: `There is no picture: ${pictures?.error}` }[pictures?.state];
  if (pictures?.state !== "running" && !words) return [];
  const making = MAKING.has(pictures.state);
  return [el("p", { class: "hint", id: "later" }, words ?? `A picture and the twin are being made: ${percent(pictures.fraction, 0)}. `, " ",
    el("button", { onclick: act(making ? "stop" : "start") }, making ? "Stop" : "Make them"))];
}
