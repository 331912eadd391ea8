// The record of a job: settings of its document, input files with sizes and SHA-256, versions and dates. Long tables
// are shown a page at a time.
import { flatten } from "../compare/compare_documents.js";
import { card, duration, el, isNumber, size, timeOf } from "../page_parts.js";
import { PagedList } from "../paged_list.js";

const SHOWN = 20; // rows of a page

const pair = (name, ...value) => el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, ...value));

function dates(job, about) {
  const { result } = job;
  return el("table", { class: "record", id: "record-dates" }, el("tbody", {}, [
    pair("id", el("span", { class: "mono" }, job.id)),
    job.owner ? pair("owner", job.owner) : null,
    job.batch ? pair("batch", el("a", { href: `#batch/${job.batch.id}` }, job.batch.name)) : null,
    pair("computed by", result?.program ?? "–", el("span", { class: "hint" }, `  (this server: ${about.name} ${about.version})`)),
    result?.model ? pair("model", el("span", { class: "mono" }, result.model)) : null,
    result && Number.isSafeInteger(result.seed) ? pair("seed", el("span", { class: "mono" }, String(result.seed))) : null,
    pair("created", timeOf(job.created_unix_s)), pair("started", timeOf(job.started_unix_s)), pair("finished", timeOf(job.finished_unix_s)),
    pair("changed", timeOf(job.updated_unix_s)),
    isNumber(job.started_unix_s) && isNumber(job.finished_unix_s) ? pair("took", duration(job.finished_unix_s - job.started_unix_s)) : null,
    job.peak_rss_bytes > 0 ? pair("memory", size(job.peak_rss_bytes)) : null,
    pair("fresh starts, attempts", `${job.generation}, ${job.attempt}`),
  ].filter(Boolean)));
}

export function inputsOf(job) {
  const files = job.files ?? [], missing = (job.missing_files ?? []).filter((name) => !files.some((f) => f.name === name));
  if (files.length + missing.length === 0) return el("p", { class: "hint" }, "This job has no input files.");
  const line = (f) => el("tr", {}, el("td", {}, f.state === "complete" ? el("a", { href: f.url, class: "mono", download: f.name }, f.name) : el("span", { class: "mono" }, f.name)),
    el("td", {}, f.role.replaceAll("_", " ")), el("td", { class: "number" }, size(f.size)),
    el("td", { class: "mono hash" }, f.state === "complete" ? f.sha256 ?? "–" : el("span", { class: "tag warn" }, `${size(f.offset)} have arrived`)));
  const body = el("tbody"), rows = [...files.map(line), ...missing.map((name) => el("tr", {}, el("td", { class: "mono" }, name), el("td", {}), el("td", {}), el("td", {}, el("span", { class: "tag warn" }, "missing"))))];
  const pages = new PagedList(body, rows, SHOWN, "input files");
  return el("div", {}, el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "input files" }, el("table", { class: "record", id: "record-inputs" },
    el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "File"), el("th", { scope: "col" }, "What"), el("th", { scope: "col", class: "number" }, "Size"), el("th", { scope: "col" }, "SHA-256 of its bytes"))),
    body)), pages.pages);
}

function settings(job) {
  const body = el("tbody"), rows = [...flatten(job.document ?? {})].map(([path, value]) => pair(el("span", { class: "mono" }, path), el("span", { class: "mono" }, value)));
  const pages = new PagedList(body, rows, SHOWN, "settings");
  return [el("p", { class: "hint" }, "Settings of the job document; everything else has the default of the version that computed the job."),
    el("table", { class: "record", id: "record-settings" }, body), pages.pages];
}

export const jobRecord = (job, about) => el("div", { id: "record" }, card("Settings", ...settings(job)), card("Versions and dates", dates(job, about)));
