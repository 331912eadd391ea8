// The correlations of the fitted parameters, as a shaded table and in words.
import { el, isNumber } from "../page_parts.js";
import { correlations } from "../result_view.js";

const STRONG = 0.7, SHOWN = 8; // pairs that are named
const text = (r) => (isNumber(r) ? r.toFixed(2).replace("-", "−") : "–");

// Returns [{a, b, r}] of the pairs from `least` on, strongest first.
export function strongPairs({ names, matrix }, least) {
  const pairs = names.flatMap((a, i) => names.slice(0, i).map((b, j) => ({ a: b, b: a, r: matrix[i][j] })));
  return pairs.filter(({ r }) => isNumber(r) && Math.abs(r) >= least).sort((p, q) => Math.abs(q.r) - Math.abs(p.r));
}

function inWords(found) {
  const pairs = strongPairs(found, STRONG), more = pairs.length - SHOWN;
  const named = pairs.slice(0, SHOWN).map(({ a, b, r }) => `${a} and ${b} (${text(r)})`).join(", ");
  const what = pairs.length ? `Strongest: ${named}${more > 0 ? `, and ${more} more pairs of ${STRONG} or above` : ""}. The measurements tell such pairs together better than each alone.` : `No two parameters are correlated by ${STRONG} or more.`;
  return el("p", { class: "hint", id: "correlation-words" }, what, " Standard errors contain this. Correlations are those in the coordinates of the fit; fixed parameters are left out.");
}

function cell(r, own) {
  const node = el("td", { class: own ? "own" : r < 0 ? "minus" : "plus" }, own ? "1" : text(r));
  if (!own && isNumber(r)) node.style.setProperty("--share", `${Math.round(45 * Math.min(1, Math.abs(r)))}%`);
  return node;
}

// Returns the content of the card, or null for a job with fewer than two fitted parameters.
export function correlationTable(job) {
  const found = correlations(job);
  if (!found) return null;
  const { names, matrix } = found;
  const head = el("tr", {}, el("td", {}), names.map((n) => el("th", { scope: "col" }, el("span", { class: "mono" }, n))));
  const rows = names.map((n, i) => el("tr", {}, el("th", { scope: "row" }, el("span", { class: "mono" }, n)), names.map((_, j) => cell(matrix[i][j], i === j))));
  return [inWords(found), el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "correlations of the parameters" },
    el("table", { id: "correlation", "aria-describedby": "correlation-words" }, el("thead", {}, head), el("tbody", {}, rows)))];
}
