// The page of one job: state, stages and live curves; after the end also parameters, comparison, fibers and downloads.
import { radiusPlot, scatterPlot } from "./comparison.js";
import { fiberView } from "./fiber_view.js";
import { SharedFibers } from "./fibers/hair_file.js";
import { fitDetails } from "./fit_details.js";
import { JobCharts } from "./job_charts.js";
import { LogTail, WholeLog } from "./log_tail.js";
import { RepairPanel, failedByInput } from "./repair/repair_panel.js";
import { duration, el, isNumber, percent, percentWithError, refill, size, stateTag, timeLeft, verdictTag, when, withError } from "./page_parts.js";
import { pairsCard } from "./pairs/pairs_card.js";
import { qualityCard } from "./quality_card.js";
import { correlationTable } from "./record/correlation_table.js";
import { jobRecord } from "./record/job_record.js";
import { VersionsCard } from "./record/versions_card.js";
import { channelErrors, choiceOf, configurations, contrastFile, fiberFile, fitted, models, radiusSearch, residuals, sliceFiles, tracedFile, statements } from "./result_view.js";
import { getJson, poll, sendJson } from "./server_link.js";
import { sliceView } from "./slices/slice_view.js";
import { SurfacePictures } from "./surface_card.js";
import { twinCard } from "./twin/twin_card.js";

const SHOWN_WARNINGS = 2;
const LIVE = new Set(["queued", "running", "paused"]);

function card(title, ...content) {
  return el("section", { class: "card" }, el("h2", {}, title), ...content);
}

function stagesOf(job, stages) {
  return stages.map((s, i) => {
    const over = job.state === "succeeded" || (job.i_stage !== null && i < job.i_stage);
    const now = job.state === "running" && i === job.i_stage;
    const fill = el("div", { class: "fill" });
    if (!over && i === job.i_stage) fill.style.width = `${100 * (job.stage_fraction || 0)}%`;
    return el("div", { class: `stage${over ? " done" : ""}${now ? " now" : ""}`, title: s.title },
      el("div", { class: "track" }, fill), el("div", { class: "name" }, s.name));
  });
}

function fact(name, value) {
  return el("span", {}, `${name} `, el("b", {}, value));
}

function factsOf(job) {
  const facts = [];
  if (LIVE.has(job.state)) facts.push(fact("done", percent(job.fraction, 0)), fact("time left", timeLeft(job)));
  if (job.state === "running" && /^(fitting|fiber radius)/.test(job.message)) facts.push(fact("now", job.message));
  if (isNumber(job.step)) facts.push(fact("step", String(job.step)));
  const { result } = job; // after the end there is one objective, of the best model, computed with fresh paths
  if (isNumber(result?.objective)) facts.push(fact("objective, fresh paths", withError(result.objective, result.objective_se)));
  else if (isNumber(job.objective)) facts.push(fact("objective of this step", withError(job.objective, job.objective_se)));
  const { fit, fitSe, leftOut, leftOutSe, held, heldSe } = residuals(job);
  if (isNumber(fit)) facts.push(fact("relative RMS error, fitted", percentWithError(fit, fitSe)));
  if (isNumber(leftOut)) facts.push(fact("left out in turn", percentWithError(leftOut, leftOutSe)));
  if (isNumber(held)) facts.push(fact("held out", percentWithError(held, heldSe)));
  for (const { set, rgb } of channelErrors(job)) facts.push(fact(`red, green, blue apart, ${set}`, rgb.map(({ value, se }) => percentWithError(value, se)).join(", ")));
  const radius = radiusSearch(job);
  if (radius) facts.push(fact("fiber radius, fitted", `${withError(radius.value, radius.se)} µm ${radius.flags.join(", ")}`));
  if (isNumber(job.started_unix_s) && isNumber(job.finished_unix_s)) facts.push(fact("took", duration(job.finished_unix_s - job.started_unix_s)));
  if (job.attempt > 1) facts.push(fact("attempt", String(job.attempt)));
  if (job.peak_rss_bytes > 0) facts.push(fact("memory", size(job.peak_rss_bytes)));
  facts.push(fact("created", when(job.created_unix_s)));
  return facts;
}

// The verdict on the result: words, the sentence and the reservations.
function verdictOf(verdict) {
  if (!verdict) return null;
  return el("div", { id: "verdict" }, el("p", {}, el("b", {}, "Verdict "), verdictTag(verdict), ` ${verdict.text}`),
    verdict.reservations.length ? el("ul", {}, verdict.reservations.map((r) => el("li", { title: r.code }, r.text))) : null);
}

function notesOf(job) {
  const warnings = job.warnings.map((w) => el("p", { class: "note" }, w));
  const notes = warnings.slice(0, SHOWN_WARNINGS);
  if (warnings.length > SHOWN_WARNINGS) notes.push(el("details", {}, el("summary", {}, `${warnings.length - SHOWN_WARNINGS} more warnings`), warnings.slice(SHOWN_WARNINGS)));
  if (job.error && !LIVE.has(job.state)) {
    const field = job.error.field && !job.error.text.includes(job.error.field) ? `${job.error.field}: ` : "";
    notes.push(el("p", { class: "note bad" }, field + job.error.text));
  }
  if (job.missing_files?.length && job.state === "draft") notes.push(el("p", { class: "note" }, `Files still missing: ${job.missing_files.join(", ")}`));
  if (residuals(job).converged === false && !job.warnings.some((w) => w.includes("not converged"))) notes.push(el("p", { class: "note" }, `The fit has not converged: ${job.result.reason ?? "the parameters are the best point found"}`));
  return notes;
}

// Compares the models of a job that fits several.
function modelTable(list, choice) {
  const rows = list.map((m) => el("tr", { class: m.best ? "best" : "" }, el("td", { title: m.title }, el("span", { class: "mono" }, m.id)), el("td", { class: "number" }, percentWithError(m.fit, m.fitSe)),
    el("td", { class: "number" }, isNumber(m.leftOut) ? percentWithError(m.leftOut, m.leftOutSe) : "–"), el("td", { class: "number" }, percentWithError(m.held, m.heldSe)),
    el("td", { class: "number" }, isNumber(m.paths) ? `${(m.paths / 1e6).toPrecision(3)} M` : "–"), el("td", { class: "number" }, duration(m.seconds)),
    el("td", {}, m.best ? el("span", { class: "tag" }, "best") : null, m.converged ? null : el("span", { class: "tag warn" }, "not converged"))));
  return [el("p", { class: "hint" }, `Relative RMS errors of mean radiances. ${choice} The rest of this page shows the best model.`),
    el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "models compared" }, el("table", { id: "models" }, el("thead", {}, el("tr", {}, el("th", {}, "Model"), el("th", { class: "number" }, "Fitted"), el("th", { class: "number" }, "Left out in turn"), el("th", { class: "number" }, "Held out"),
      el("th", { class: "number" }, "Paths"), el("th", { class: "number" }, "Time"), el("th", {}, "Remarks"))), el("tbody", {}, rows))),
    ...list.filter((m) => !m.best).map((m) => el("details", {}, el("summary", {}, `Parameters of ${m.id}`), parameterTable(m.parameters)))];
}

function parameterTable(list, id) {
  const rows = list.flatMap((p, i) => [p.set !== "" && p.set !== list[i - 1]?.set ? el("tr", {}, el("th", { colspan: 5, class: "set" }, p.set)) : null, el("tr", {}, el("td", { class: "mono" }, p.name), el("td", { class: "number" }, withError(p.value, p.se)),
    el("td", {}, p.unit === "deg" ? "°" : p.unit), el("td", { class: "number hint" }, isNumber(p.lower) ? `${Number(p.lower.toPrecision(4))} … ${Number(p.upper.toPrecision(4))}` : ""),
    el("td", {}, p.flags.map((f) => el("span", { class: "tag warn" }, f))))]).filter((row) => row !== null);
  return el("table", { id }, el("thead", {}, el("tr", {}, el("th", {}, "Parameter"), el("th", { class: "number" }, "Value ± standard error"), el("th", {}, ""),
    el("th", { class: "number" }, "Allowed"), el("th", {}, "Remarks"))), el("tbody", {}, rows));
}

// The link to the report as a page or as PDF, when the job has one.
function report(list, path, text) {
  const page = list.files.find((f) => f.path === path);
  return page ? el("a", { class: "button main", href: page.url, target: "_blank" }, text) : "";
}

function downloads(job, list) {
  const rows = list.files.map((f) => el("tr", {}, el("td", {}, el("a", { href: f.url, class: "mono", download: f.path.split("/").pop() }, f.path)), el("td", { class: "number" }, size(f.size))));
  return [el("p", {}, report(list, "report.html", "Report"), report(list, "report.pdf", "Report as PDF"), el("a", { class: "button", href: list.archive, download: `selvedge-${job.id}.tar` }, "Everything (tar)")), el("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "files" }, el("table", { id: "files" }, el("tbody", {}, rows)))];
}

// The fit to the profile of a single fiber.
function profileCards(profile) {
  if (!profile) return [];
  const rows = profile.models.map((m) => el("tr", { class: m.best ? "best" : "" }, el("td", { title: m.title }, el("span", { class: "mono" }, m.id)), el("td", { class: "number" }, percentWithError(m.nrmse)),
    el("td", { class: "number" }, percentWithError(m.rel_rms)), el("td", { class: "number" }, withError(m.scale, m.scale_se || undefined)), el("td", { class: "number" }, duration(m.fit_wall_s)),
    el("td", {}, m.best ? el("span", { class: "tag" }, "best") : null, m.converged ? null : el("span", { class: "tag warn" }, "not converged"))));
  const table = el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "models of the profile" }, el("table", { id: "profile-models" }, el("thead", {}, el("tr", {}, el("th", {}, "Model"), el("th", { class: "number" }, "Residual, of the range"),
    el("th", { class: "number" }, "Relative residual"), el("th", { class: "number" }, "Scale"), el("th", { class: "number" }, "Time"), el("th", {}, "Remarks"))), el("tbody", {}, rows)));
  return [card("Models fitted to the profile", table, el("p", { class: "hint" }, "The report shows the profile, measured and fitted.")),
    ...profile.models.map((m) => card(`Parameters of ${m.id}`, parameterTable(fitted(m), m.best ? "parameters" : undefined)))];
}

export function jobPage(page, id) {
  const head = el("div", { class: "head" }), stages = el("div", { class: "stages" }), facts = el("div", { class: "facts" }), verdict = el("div"), notes = el("div");
  const fitCard = el("div"), curveCard = el("div"), surfaces = el("div"), results = el("div", { id: "results" }), record = el("div"), versionsNode = el("div"), logNode = el("pre", { class: "log", tabIndex: 0, role: "region", "aria-label": "the last lines of the log" });
  const charts = new JobCharts(fitCard, curveCard), log = new LogTail(logNode), repair = new RepairPanel(id, () => poller.wake()), pictures = new SurfacePictures(surfaces, id), versions = new VersionsCard(versionsNode, id);
  const wholeLog = el("details", { id: "whole-log", ontoggle: () => {
    if (!wholeLog.open || wholeLog.childElementCount > 1) return;
    const whole = new WholeLog(id);
    wholeLog.append(whole.node);
    whole.show(0);
  } }, el("summary", {}, "Whole log"));
  const curves = el("div", { class: "columns" }, card("Fit", fitCard), card("Parameters over the steps", curveCard));
  page.append(el("section", { class: "card", id: "state" }, head, stages, verdict, facts, notes, repair.node),
    curves, surfaces, results, versionsNode, record,
    el("section", { class: "card" }, el("h2", {}, "Log ", el("small", {}, "its last lines")), logNode, wholeLog));
  let about = null, generation = null, closeFibers = null, closeTwin = null, closePairs = null, gone = false;

  const act = (verb) => async (event) => {
    event.target.disabled = true;
    try {
      if (verb === "delete") {
        if (!confirm("Delete this job with all its files?")) { event.target.disabled = false; return; }
        await sendJson("DELETE", `/v1/jobs/${id}`);
        location.hash = "";
      } else await sendJson("POST", `/v1/jobs/${id}/${verb}`);
      poller.wake();
    } catch (error) { notes.replaceChildren(el("p", { class: "note bad" }, error.message)); event.target.disabled = false; }
  };
  const buttons = (job) => [
    job.state === "draft" && !job.missing_files.length ? el("button", { class: "main", onclick: act("start") }, "Start") : null,
    LIVE.has(job.state) ? el("button", { onclick: act("cancel"), disabled: job.cancel_requested }, job.cancel_requested ? "Stopping ..." : "Cancel") : null,
    job.state === "failed" || job.state === "cancelled" ? el("button", { class: failedByInput(job) ? "" : "main", onclick: act("retry") }, "Retry from checkpoint") : null,
    el("a", { class: "button", href: `#new?copy=${id}` }, "Copy with changes"),
    LIVE.has(job.state) ? null : el("button", { onclick: act("delete") }, "Delete"),
  ];

  const showResults = async (job) => {
    if (job.state !== "succeeded" || results.childElementCount > 0) return;
    const list = await getJson(`/v1/jobs/${id}/results`);
    if (gone || results.childElementCount > 0) return;
    const compared = configurations(job, new Map(list.files.map((f) => [f.path, f.url])));
    const slices = sliceFiles(list.files), hair = fiberFile(list.files);
    const details = fitDetails(job), correlated = correlationTable(job);
    const traced = tracedFile(list.files), seen = traced ? new SharedFibers(traced, contrastFile(list.files)) : null;
    const fibers = hair ? fiberView(new SharedFibers(hair, null), seen) : null, scan = sliceView(list.files, seen);
    const quality = qualityCard(job, list.files);
    closeFibers = () => { fibers?.close(); scan?.close(); };
    const twin = twinCard(job, list.files, compared);
    closeTwin = twin?.close ?? null;
    const pairs = compared.length ? pairsCard(compared, job.result?.png_exposure) : null;
    closePairs = pairs?.close ?? null;
    const compete = models(job), radius = radiusSearch(job), stated = statements(job);
    results.append(
      twin ? card("The twin under the mouse", twin.box) : "",
      compete.length > 1 ? card("Models compared", modelTable(compete, choiceOf(job))) : "",
      ...profileCards(job.result?.profile),
      job.result?.models?.length === 0 ? "" : // a job of geometry only has none
        el("div", { class: "columns" }, card("Fitted parameters", parameterTable(fitted(job), "parameters")), card("Measured and rendered means", scatterPlot(compared))),
      details ? card("More results of the fit", details) : "",
      correlated ? card("Correlation of the parameters", correlated) : "",
      radius ? card("Fiber radius", radiusPlot(radius)) : "",
      pairs ? card("Measured and rendered pictures", pairs.box) : "",
      quality ? card("Quality of the geometry", quality) : "",
      scan ? card("Slices of the scan", scan.box) : slices.length ? card("Slices of the scan, detected fibers in red", el("div", { class: "slices" }, slices.map((f) => el("figure", {}, el("img", { src: f.url, alt: f.path, loading: "lazy" }), el("figcaption", {}, f.path))))) : "",
      fibers ? card("Fibers", fibers.box) : "",
      stated.length ? el("section", { class: "card", id: "statements" }, el("details", { open: !stated.every((s) => s.applied) }, el("summary", {}, "Statements of the files"), el("ul", {}, stated.map((s) => el("li", {}, s.text))))) : "",
      card("Downloads", downloads(job, list)));
  };

  // A job that does not exist, or no longer: the page says so instead of staying empty.
  const missing = (error) => {
    gone = true;
    poller.stop();
    document.title = "No such job – Selvedge";
    page.replaceChildren(el("section", { class: "card", id: "no-job" }, el("h1", {}, "There is no such job"), el("p", {}, error.message),
      el("p", {}, "It was deleted, belongs to somebody else, or the address is mistyped. ", el("a", { href: "#" }, "All jobs"))));
  };

  const poller = poll(async () => {
    about ??= await getJson("/v1/about");
    const job = await getJson(`/v1/jobs/${id}`).then((known) => ({ ...known })).catch((error) => {
      if (error.status === 404) missing(error);
      throw error;
    });
    job.result = job.result_url ? await getJson(job.result_url) : null; // answered with 304 while it is the same
    job.parameters = job.result?.parameters ?? null;
    if (gone) return 5;
    document.title = `${job.state === "running" ? `${Math.round(100 * job.fraction)} % ` : ""}${job.sample} – Selvedge`;
    if (job.generation !== generation) { generation = job.generation; log.reset(); pictures.reset(); results.replaceChildren(); closeFibers?.(); closeTwin?.(); closePairs?.(); closeFibers = closeTwin = closePairs = null; }
    refill(head, [job.sample, job.state, job.error?.code, job.cancel_requested, job.missing_files], () => [el("h1", {}, job.sample), stateTag(job.state), el("span", { class: "space" }), ...buttons(job)]);
    refill(stages, [job.state, job.i_stage, job.stage_fraction], () => stagesOf(job, about.stages));
    refill(facts, [job.state, job.message, job.fraction, job.eta_s, job.step, job.objective, job.attempt, job.peak_rss_bytes, job.finished_unix_s], () => factsOf(job));
    refill(verdict, job.verdict, () => [verdictOf(job.verdict)]);
    refill(notes, [job.warnings, job.error, job.state, job.missing_files], () => notesOf(job));
    refill(record, [job.state, job.generation, job.attempt, job.finished_unix_s, job.missing_files, job.document, job.result_url, job.files], () => [jobRecord(job, about)]);
    curves.hidden = !job.document?.photographs && !job.document?.measurements; // nothing is fitted
    await charts.update(job);
    await repair.update(job);
    await log.update(id);
    await pictures.update(job);
    await versions.update(job);
    await showResults(job);
    return job.state === "running" ? 1 : LIVE.has(job.state) ? 2 : 10;
  });
  return () => { gone = true; poller.stop(); charts.destroy(); pictures.reset(); closeFibers?.(); closeTwin?.(); closePairs?.(); };
}
