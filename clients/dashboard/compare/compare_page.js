// Two to eight jobs side by side, and up to a hundred in plots: "#compare/ID,ID@2", where @2 is the result of run 2 of a job;
// "#compare/ID,ID/plots" is one of its tabs. Each of the first eight has the same letter everywhere.
import { comparedPictures, pictureRows } from "./compare_pictures.js";
import { comparePlots } from "./compare_plots.js";
import { documentTable } from "./compare_documents.js";
import { comparedTwins, withTwin } from "./compare_twins.js";
import { errorTable, parameterTables, rowTable } from "./compare_tables.js";
import { el, stateTag, timeLeft, verdictTag } from "../page_parts.js";
import { configurations, parameterMeanings } from "../result_view.js";
import { getJson, poll } from "../server_link.js";
import { TabBar } from "../tabs/tab_bar.js";

export const MOST = 8, MOST_PLOTTED = 100; // jobs in tables, and in plots
const AT_ONCE = 8; // requests
const TABS = [{ name: "result", title: "Result" }, { name: "parameters", title: "Parameters" }, { name: "plots", title: "Plots" }, { name: "rows", title: "Rows" }, { name: "pictures", title: "Pictures" }, { name: "twins", title: "Twins" }, { name: "settings", title: "Settings" }];
const LIVE = new Set(["queued", "running", "paused"]);

export const compareAddress = (ids) => `#compare/${ids.join(",")}`;

// Gets the result of an earlier run, ID@RUN, in the place of the job's present one; returns the addresses of its files. Its list of inputs is not kept.
async function fetchVersion(job, run) {
  const version = await getJson(`/v1/jobs/${job.id}/versions/${run}`), urls = new Map(version.files.map((f) => [f.path, f.url]));
  const result = await getJson(`${version.url}/result.json`);
  Object.assign(job, { sample: `${version.sample}, run ${run}`, state: "succeeded", error: null, started_unix_s: version.started_unix_s, finished_unix_s: version.finished_unix_s, verdict: version.verdict, document: version.document, files: null, result, parameters: result.parameters ?? null });
  return urls;
}

// Gets a job with its result and the addresses of its files: {id, job, urls}, or {id, missing} when there is no such job.
async function fetchColumn(id) {
  const [, ofJob, run] = /^([A-Za-z0-9_-]{1,80})(?:@([1-9]\d{0,8}))?$/.exec(id) ?? [];
  if (!ofJob) return { id, missing: "This is no id of a job." };
  try {
    const job = { ...await getJson(`/v1/jobs/${ofJob}`) };
    if (run) return { id, job, urls: await fetchVersion(job, run) };
    job.result = job.result_url ? await getJson(job.result_url) : null;
    job.parameters = job.result?.parameters ?? null;
    const list = job.result ? await getJson(`/v1/jobs/${id}/results`) : { files: [] };
    return { id, job, urls: new Map(list.files.map((f) => [f.path, f.url])) };
  } catch (error) {
    if (error.status === 404) return { id, missing: "There is no such job or version: it was deleted, belongs to somebody else, or the address is mistyped." };
    throw error;
  }
}

// Why a job has nothing to compare but its settings; null when it has a result.
function lackOf({ job }) {
  if (job.result) return null;
  if (LIVE.has(job.state)) return `has no result yet (${job.state}${job.state === "running" ? `, ${timeLeft(job)} left` : ""}). This page shows it when it is there.`;
  if (job.error) return `has no result: ${job.error.text}`;
  return job.state === "draft" ? "has no result: it was not started." : "has no result.";
}

function notes(columns, unknown, asked) {
  const list = [];
  if (asked > MOST) list.push(`Tables show the first ${MOST} of these ${asked} jobs; the plots show ${asked > MOST_PLOTTED ? `the first ${MOST_PLOTTED}` : "all of them"}.`);
  for (const { id, missing } of unknown) list.push(`${id}: ${missing}`);
  for (const c of columns) if (lackOf(c)) list.push(`${c.letter}, ${c.job.sample}, ${lackOf(c)}`);
  if (columns.length < 2) list.push("There are not two jobs to compare. Select two to eight jobs in the list, then press “Compare”.");
  return list.map((text) => el("p", { class: "note" }, text));
}

function headCard(columns, ids, reference, choose) {
  const without = (id) => ids.filter((other) => other !== id);
  const people = columns.map((c) => el("li", {}, el("b", { class: "letter" }, c.letter), el("div", {}, el("a", { href: `#${c.job.id}` }, c.job.sample || "(no name)"), " ", stateTag(c.job.state), " ", verdictTag(c.job.verdict)),
    columns.length > 2 ? el("a", { class: "button", href: compareAddress(without(c.id)), "aria-label": `leave ${c.letter}, ${c.job.sample}, out` }, "Leave out") : null));
  const select = el("select", { onchange: () => choose(select.value) }, columns.map((c) => el("option", { value: c.id, selected: c.id === reference }, `${c.letter}, ${c.job.sample}`)));
  return [el("ul", { class: "compared" }, people), columns.length > 1 ? el("label", { class: "reference" }, "Differences are from ", select) : null];
}

const card = (id, title, ...content) => el("section", { class: "card", id }, el("h2", {}, title), ...content);

// The tabs with content, each a function that makes it. columns: [{id, letter, job, urls, list}]; the first one is not always
// the reference; others: jobs beyond the tables
function contents(columns, others, reference, choice, meanings) {
  const ended = columns.filter((c) => c.job.result), base = ended.find((c) => c.id === reference) ?? ended[0], made = new Map();
  if (ended.length) {
    const rows = pictureRows(ended);
    made.set("result", () => [card("compare-errors", "Verdicts and errors", errorTable(columns, base, rows))]);
    if (ended.some((c) => c.job.parameters?.length)) made.set("parameters", () => [card("compare-parameters", "Parameters", ...parameterTables(ended, base, meanings))]);
    if (ended.length + others.length > 1) made.set("plots", () => [comparePlots([...columns, ...others], choice)]);
    if (rows.length) made.set("rows", () => [card("compare-rows", "Errors by row", ...rowTable(ended, base, rows))]);
    if (rows.length) made.set("pictures", () => [card("compare-pictures", "The same photograph with each rendering", ...comparedPictures(ended, rows))]);
  }
  if (withTwin(ended).length > 1) made.set("twins", () => [comparedTwins(withTwin(ended), base)]);
  if (columns.length > 1) made.set("settings", () => [card("compare-settings", "Settings that differ", ...documentTable(columns))]);
  return made;
}

// The jobs beyond the tables, read once, a few at a time.
async function fetchOthers(ids) {
  const found = [];
  for (let i = 0; i < ids.length; i += AT_ONCE) found.push(...await Promise.all(ids.slice(i, i + AT_ONCE).map(fetchColumn)));
  return found.filter((c) => c.job?.result);
}

export function comparePage(page, text, tab) {
  const asked = [...new Set(text.split(",").filter((id) => id !== ""))], ids = asked.slice(0, MOST);
  const head = el("section", { class: "card", id: "compare" }), rest = el("div", { class: "tab-panel", id: "tab" }), bar = new TabBar(`compare/${text}`, TABS, "parts of this comparison"), choice = {};
  let reference = ids[0], shown = "", columns = [], unknown = [], others = null, gone = false, wanted = tab, made = new Map(), drawn = "", meanings = null;
  document.title = "Comparison – Selvedge";
  page.append(head, bar.node, rest);

  const leaveTab = () => { for (const node of rest.children) node.leave?.(); };
  const showTab = () => {
    const name = made.has(wanted) ? wanted : [...made.keys()][0] ?? "";
    bar.offer([...made.keys()], name);
    if (name === drawn) return;
    drawn = name;
    leaveTab();
    rest.replaceChildren(...(made.get(name)?.() ?? []));
  };
  const show = () => {
    head.replaceChildren(el("h1", {}, "Comparison"), ...headCard(columns, ids, reference, (id) => { reference = id; show(); head.querySelector("select").focus(); }).filter(Boolean), ...notes(columns, unknown, asked.length));
    made = contents(columns, others ?? [], reference, choice, meanings);
    drawn = "";
    showTab();
  };
  const poller = poll(async () => {
    meanings ??= parameterMeanings((await getJson("/v1/options")).models);
    const all = await Promise.all(ids.map(fetchColumn));
    others ??= await fetchOthers(asked.slice(MOST, MOST_PLOTTED));
    if (gone) return 5;
    columns = all.filter((c) => c.job).map((c, i) => ({ ...c, letter: "ABCDEFGH"[i], list: configurations(c.job, c.urls) }));
    unknown = all.filter((c) => c.missing);
    const key = JSON.stringify(all.map(({ id, job }) => [id, job?.state, job?.generation, job?.sample, job?.verdict, job?.error, job?.document, job?.result_url]));
    if (key !== shown) { shown = key; show(); }
    return columns.some((c) => LIVE.has(c.job.state)) ? 3 : 30;
  });
  return { turn: (name) => { wanted = name; showTab(); }, leave: () => { gone = true; leaveTab(); poller.stop(); } };
}
