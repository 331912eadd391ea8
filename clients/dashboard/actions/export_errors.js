// The errors of files for other programs in words, beside the buttons that make them and the links to them.
import { el, isNumber, percent, percentWithError } from "../page_parts.js";
import { exportsOf } from "../result_view.js";

const MARKED = 0.1; // as the report marks errors

function sentence(e) {
  if (!isNumber(e.error)) return "no difference from this job's renderings is stated";
  const most = isNumber(e.worst) ? `, ${percent(e.worst, 0)} at most${e.row ? ` (row ${e.row})` : ""}` : "";
  return `${percentWithError(e.error, e.errorSe, 1)} from this job's renderings over its rows${most}`;
}

// What a job with a result says of one of its exports.
function item(e) {
  const far = e.error > MARKED;
  return el("li", { class: far ? "far" : "" }, el("b", {}, e.format), ` ${sentence(e)}.`, far ? el("strong", {}, " More than 10 %: look before you use it.") : "",
    e.exact ? " exact.xml shows the fitted scattering itself." : "", e.warnings.filter((w) => !far || !w.startsWith("the cloth with")).map((w) => el("span", { class: "note" }, ` ${w}.`)));
}

// The list of a job's exports; null without one.
export function exportErrors(job) {
  const list = exportsOf(job);
  return list.length ? el("ul", { class: "export-errors" }, list.map(item)) : null;
}
