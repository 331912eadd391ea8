// Tables of the comparison: verdicts and errors, parameters, errors by row. A column is {id, letter, job, urls, list}.
import { duration, el, isNumber, percent, percentWithError, verdictTag, withError } from "../page_parts.js";
import { PagedList } from "../paged_list.js";
import { models, plainErrors, residuals } from "../result_view.js";

const SHOWN_ROWS = 25;
const MARK = 2; // standard errors of the difference from which on it is marked

// The difference of two values in standard errors of the difference, taken as independent. A value without a standard
// error is exact when `exact` says so; null: nothing can be said.
export function apart(a, b) {
  if (!isNumber(a.value) || !isNumber(b.value)) return null;
  if (![a, b].every((x) => isNumber(x.se) || x.exact)) return null;
  const difference = a.value - b.value, se = Math.hypot(isNumber(a.se) ? a.se : 0, isNumber(b.se) ? b.se : 0);
  return difference === 0 ? 0 : se > 0 ? difference / se : Math.sign(difference) * Infinity;
}

const isMarked = (n) => n !== null && Math.abs(n) > MARK;

function markOf(n, base) {
  if (!isMarked(n)) return null;
  const text = Number.isFinite(n) ? `${n > 0 ? "+" : "−"}${Math.abs(n).toPrecision(2)} s.e.` : "differs";
  return el("span", { class: "tag warn", title: `from ${base.letter}, in standard errors of the difference` }, text);
}

// A table that scrolls by itself, with a column for each job. rows: [title, [cell, ...]] or a heading as text
export function sideBySide(label, columns, rows, first = "") {
  const head = columns.map((c) => el("th", { class: "number", title: c.job.sample, scope: "col" }, el("span", { class: "letter" }, c.letter), " ", el("span", { class: "name" }, c.job.sample)));
  const body = rows.map((row) => (typeof row === "string" ? el("tr", {}, el("th", { class: "set", colSpan: columns.length + 1, scope: "colgroup" }, row))
    : el("tr", {}, el("th", { scope: "row" }, row[0]), row[1].map((cell) => el("td", { class: "number" }, cell)))));
  return el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": label }, el("table", { class: "side" }, el("thead", {}, el("tr", {}, el("td", {}, first), head)), el("tbody", {}, body)));
}

// The same, a page at a time.
function pagedRows(label, columns, rows) {
  const table = sideBySide(label, columns, rows), body = table.querySelector("tbody"), pages = new PagedList(body, [...body.children], SHOWN_ROWS, "rows");
  return el("div", { class: "scroll-rows" }, table, pages.pages);
}

const errorCell = (value, se) => (isNumber(value) ? percentWithError(value, se) : "–");

// rows: as pictureRows() gives them
export function errorTable(columns, base, rows) {
  const each = (make) => columns.map((c) => (c.job.result ? make(c) : "–"));
  const of = (c) => residuals(c.job), plain = (c) => plainErrors(c.job);
  const compared = (key) => each((c) => [c === base ? null : markOf(apart({ value: of(c)[key], se: of(c)[`${key}Se`] }, { value: of(base)[key], se: of(base)[`${key}Se`] }), base), " ", errorCell(of(c)[key], of(c)[`${key}Se`])]);
  const table = sideBySide("verdicts and errors", columns, [
    ["verdict", each((c) => verdictTag(c.job.verdict) ?? "–")],
    ["model", each((c) => el("span", { class: "mono" }, c.job.result.model ?? "–"))],
    ["error, fitted", compared("fit")], ["rows left out", each((c) => errorCell(of(c).leftOut, of(c).leftOutSe))], ["held out", compared("held")],
    ["plain BRDF, fitted", each((c) => errorCell(plain(c).fit))], ["plain BRDF, held out", each((c) => errorCell(plain(c).held))],
    ["rows, fitted + held out", each((c) => `${c.list.filter((r) => !r.held).length} + ${c.list.filter((r) => r.held).length}`)],
    ["converged", each((c) => (typeof of(c).converged !== "boolean" ? "–" : of(c).converged ? "yes" : "no"))],
    ["took", columns.map((c) => (isNumber(c.job.finished_unix_s) ? duration(c.job.finished_unix_s - c.job.started_unix_s) : "–"))],
  ]);
  const same = (held) => columns.every((c) => !c.job.result || rows.filter((r) => r.cells.some((x) => x?.held === held)).every((r) => r.cells[c.place]?.held === held));
  const differ = [same(false) ? null : "fitted", same(true) ? null : "held-out"].filter(Boolean);
  return el("div", {}, differ.length ? el("p", { class: "note" }, `The ${differ.join(" and ")} rows are not the same in all jobs, so that these errors are about different measurements. Compare them row by row.`) : null,
    el("p", { class: "hint" }, `Relative RMS errors ± standard errors by tracing. Marked: more than ${MARK} standard errors of the difference from ${base.letter}.`), table);
}

// Models of a job, also of a result that does not list them.
function modelsOf({ job }) {
  const list = models(job);
  return list.length ? list : [{ id: job.result.model ?? "", best: true, parameters: [] }];
}

function parameterCell(p, other, base, isBase) {
  if (!p) return "–";
  const as = (x) => ({ value: x?.value, se: x?.se, exact: x?.flags.includes("fixed") });
  const n = isBase || !other || p.flags.includes("not determined") || other.flags.includes("not determined") ? null : apart(as(p), as(other));
  return [markOf(n, base), " ", ...p.flags.flatMap((f) => [el("span", { class: "tag" }, f), " "]), el("span", { class: isMarked(n) ? "apart" : "" }, withError(p.value, p.se))];
}

// A table for each model that a job has fitted: parameters are compared within a model, in one unit.
// meanings: by "MODEL NAME", of parameterMeanings()
export function parameterTables(columns, base, meanings) {
  const ids = [...new Set(columns.flatMap((c) => modelsOf(c).map((m) => m.id)))];
  const tables = ids.map((id) => {
    const having = columns.map((c) => ({ c, model: modelsOf(c).find((m) => m.id === id) })).filter((x) => x.model);
    const against = having.find((x) => x.c === base) ?? having[0], keys = new Map();
    const keyOf = (p) => `${p.set}\n${p.name}\n${p.unit}`;
    for (const { model } of having) for (const p of model.parameters) if (!keys.has(keyOf(p))) keys.set(keyOf(p), p);
    const find = (x, key) => x.model.parameters.find((p) => keyOf(p) === key), rows = [];
    let set = "", before = null;
    for (const [key, p] of keys) {
      if (p.set !== set) { rows.push(p.set); before = null; }
      ({ set } = p);
      const meaning = meanings.get(`${id} ${p.name}`), again = meaning === before; // r, g, b of one colour
      before = meaning;
      rows.push([[el("span", { class: "mono" }, `${p.name}${p.unit ? ` ${p.unit === "deg" ? "°" : p.unit}` : ""}`), meaning && !again ? el("div", { class: "hint" }, meaning) : null], having.map((x) => parameterCell(find(x, key), find(against, key), against.c, x === against))]);
    }
    const best = having.filter((x) => x.model.best).map((x) => x.c.letter);
    return rows.length === 0 ? null : el("div", {}, el("h3", {}, el("span", { class: "mono" }, id), ids.length > 1 ? el("span", { class: "hint" }, best.length ? ` best model of ${best.join(", ")}` : " best model of none") : null),
      sideBySide(`parameters of ${id}`, having.map((x) => x.c), rows));
  }).filter(Boolean);
  if (tables.length) tables.unshift(el("p", { class: "hint" }, `Value ± standard error. Marked: more than ${MARK} standard errors of the difference from ${base.letter}, the errors taken as independent. Not marked: what the measurements do not determine. Jobs are compared model by model.`));
  return tables;
}

// Errors of each row of measurements, and how they differ.
export function rowTable(columns, base, rows) {
  const at = base.place;
  const cell = (row, c) => {
    const x = row.cells[c.place], other = row.cells[at];
    if (!x || !isNumber(x.error)) return "–";
    const n = c === base || !other ? null : apart({ value: x.error, se: x.errorSe }, { value: other.error, se: other.errorSe });
    return [markOf(n, base), " ", x.held ? el("span", { class: "tag" }, "held out") : null, " ", isNumber(x.errorSe) ? percentWithError(x.error, x.errorSe, 1) : percent(x.error)];
  };
  return [el("p", { class: "hint" }, `Relative error of each row ± standard error by tracing. A row is the same in two jobs when its name and its angles are. Marked: more than ${MARK} standard errors of the difference from ${base.letter}.`),
    pagedRows("errors by row", columns, rows.map((row) => [[el("span", { class: "mono" }, row.name), el("div", { class: "hint" }, row.where)], columns.map((c) => cell(row, c))]))];
}
