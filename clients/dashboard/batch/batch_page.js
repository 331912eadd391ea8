// "#batch/ID": one batch. Its progress, failures with their reasons and a button that runs them again, and its results.
import { el, isNumber, percent, refill, stateTag, timeOf, verdictTag, verdictWords, withError } from "../page_parts.js";
import { getJson, poll, sendJson } from "../server_link.js";
import { stateBar, stateWords } from "./state_bar.js";

const ACTIONS = { start: "started", retry: "queued again", cancel: "cancelled" };
const ROWS_SHOWN = 200;

function summary(batch) {
  const verdicts = Object.entries(batch.verdicts).map(([code, n]) => `${n} ${verdictWords(code)}`).join(", ");
  const fact = (name, ...value) => [el("dt", {}, name), el("dd", {}, ...value)];
  return [el("h1", {}, batch.name), stateBar(batch), el("dl", { class: "batch-facts" },
    fact("Samples", `${batch.n_sample}: ${stateWords(batch.states)}`), fact("Done", percent(batch.fraction)),
    batch.expected_end_unix_s ? fact("Ends about", timeOf(batch.expected_end_unix_s)) : [],
    verdicts ? fact("Verdicts", verdicts) : [], fact("Submitted", timeOf(batch.updated_unix_s)))];
}

// Failures with the same reason stand together.
function failureList(failures) {
  const byReason = new Map();
  for (const f of failures) {
    const reason = f.field && !f.text.includes(f.field) ? `${f.field}: ${f.text}` : f.text;
    if (!byReason.has(reason)) byReason.set(reason, []);
    byReason.get(reason).push(f);
  }
  return [...byReason].map(([reason, list]) => el("li", {}, el("p", { class: "why" }, reason),
    el("p", {}, list.length > 1 ? `${list.length} samples: ` : "", list.flatMap((f, i) => [i ? ", " : "", el("a", { href: `#${f.job}` }, f.sample)]))));
}

const parameterText = (p) => (p.fixed ? `${withError(p.value, null)} (fixed)` : p.determined ? withError(p.value, p.standard_error) : `${withError(p.value, p.standard_error)} ?`);

function resultLine(row, names) {
  const byName = new Map(row.parameters.map((p) => [p.name, p]));
  return el("tr", {}, el("th", { scope: "row" }, el("a", { href: `#${row.job}` }, row.sample)), el("td", {}, stateTag(row.state)),
    el("td", {}, row.verdict ? verdictTag({ code: row.verdict, words: verdictWords(row.verdict), text: "" }) : ""),
    el("td", { class: "number" }, isNumber(row.heldout_rel_rms) ? percent(row.heldout_rel_rms, 2) : ""),
    el("td", {}, row.flags.map((f) => f.replaceAll("_", " ")).join(", ")),
    names.map((name) => el("td", { class: "number" }, byName.has(name) ? parameterText(byName.get(name)) : "")));
}

function resultTable(samples) {
  const names = [...new Set(samples.flatMap((s) => s.parameters.map((p) => p.name)))];
  const head = ["Sample", "State", "Verdict", "Held-out error", "Reservations", ...names].map((text) => el("th", { scope: "col" }, text));
  return [el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "table of results" }, el("table", { id: "batch-table" }, el("thead", {}, el("tr", {}, head)), el("tbody", {}, samples.slice(0, ROWS_SHOWN).map((s) => resultLine(s, names))))),
    samples.length > ROWS_SHOWN ? el("p", { class: "hint" }, `The first ${ROWS_SHOWN} of ${samples.length} samples; the downloads have all.`) : null];
}

export function batchPage(page, id) {
  const url = `/v1/batches/${id}`, head = el("section", { class: "card" }), said = el("p", { role: "status", class: "batch-said" });
  const failed = el("section", { class: "card hidden", id: "failures" }), list = el("ul", { class: "batch-failures" }), results = el("section", { class: "card", id: "batch-results" });
  const facts = el("div"), table = el("div");
  let seen = "";
  const act = async (action) => {
    try {
      const done = await sendJson("POST", `${url}/${action}`);
      const refused = done.refused.length ? `; ${done.refused.length} refused, such as ${done.refused[0].sample}: ${done.refused[0].detail}` : "";
      said.textContent = `${done.n_changed} jobs ${ACTIONS[action]}${refused}`;
    } catch (error) { said.textContent = error.message; }
    poller.wake();
  };
  const button = (text, action, main = "") => el("button", { type: "button", class: main, onclick: () => act(action) }, text);
  const start = button("Start", "start", "main"), cancel = button("Cancel all", "cancel"), retry = button("Retry all failed", "retry", "main");
  head.append(facts, el("div", { class: "batch-actions" }, start, cancel, el("a", { class: "button", href: `#?batch=${id}` }, "List its jobs")), said);
  failed.append(el("h2", {}, "Failures"), retry, list);
  results.append(el("h2", {}, "Results"), el("p", { class: "batch-actions" }, el("a", { class: "button", href: `${url}/results.csv`, download: "results.csv" }, "Download CSV"),
    el("a", { class: "button", href: `${url}/results.json`, download: "results.json" }, "Download JSON")), table);
  page.append(head, failed, results);

  const poller = poll(async () => {
    const batch = await getJson(url);
    document.title = `${batch.name} – Selvedge`;
    refill(facts, [batch.name, batch.states, batch.fraction, batch.expected_end_unix_s, batch.verdicts], () => summary(batch));
    start.disabled = batch.states.draft + batch.states.cancelled === 0;
    cancel.disabled = batch.states.draft + batch.states.queued + batch.states.running + batch.states.paused === 0;
    failed.classList.toggle("hidden", batch.failures.length === 0);
    refill(list, batch.failures, () => failureList(batch.failures));
    const states = JSON.stringify([batch.states, batch.updated_unix_s]); // results are read again only when a job has ended
    if (states !== seen) {
      const { samples } = await getJson(`${url}/results.json`);
      refill(table, samples, () => resultTable(samples));
      seen = states;
    }
    return 2;
  });
  return () => poller.stop();
}
