// The relative error of each row as a bar; a click leads to the row's pair.
import { el, isNumber, percentWithError } from "../page_parts.js";
import { PagedList } from "../paged_list.js";

const SHOWN = 30;
const degrees = (x) => (isNumber(x) ? `${Number(x.toFixed(1))}°` : "–");
const whereOf = (a) => `light ${degrees(a.light_theta_deg)}, ${degrees(a.light_phi_deg)}; camera ${degrees(a.camera_theta_deg)}, ${degrees(a.camera_phi_deg)}; cloth turned ${a.all_rotations ? "by all angles" : degrees(a.cloth_rotation_deg)}`;

const sum = (rgb) => rgb[0] + rgb[1] + rgb[2];

function side(c) {
  if (!c.measured || !c.rendered) return "";
  return sum(c.rendered) > sum(c.measured) ? "rendered brighter" : "rendered darker";
}

// open(i) shows the pair of row i.
export function residualBars(list, open) {
  const most = Math.max(1e-9, ...list.map((c) => (isNumber(c.error) ? c.error + 2 * (c.errorSe ?? 0) : 0)));
  const share = (x) => `${100 * Math.min(1, Math.max(0, x / most))}%`;
  const rows = list.map((c, i) => {
    const bar = el("span", { class: "length" }), whisker = el("span", { class: "whisker" });
    if (isNumber(c.error)) {
      bar.style.width = share(c.error);
      if (isNumber(c.errorSe)) {
        whisker.style.left = share(c.error - 2 * c.errorSe);
        whisker.style.width = share(Math.min(4 * c.errorSe, c.error + 2 * c.errorSe));
      }
    }
    return { i, c, node: el("li", {}, el("button", { type: "button", class: c.held ? "held" : "", title: whereOf(c.angles), onclick: () => open(i) },
      el("span", { class: "mono name" }, c.name, c.held ? [" ", el("span", { class: "tag" }, "held out")] : null), el("span", { class: "track" }, bar, whisker),
      el("span", { class: "number" }, percentWithError(c.error, c.errorSe, 1)), el("span", { class: "hint" }, side(c)))) };
  });
  const box = el("ol", { class: "residuals", id: "residuals" }), pages = new PagedList(box, rows.map((r) => r.node), SHOWN, "rows");
  const order = el("select", { id: "residual-order", onchange: () => {
    const sorted = order.value === "error" ? [...rows].sort((a, b) => (b.c.error ?? -1) - (a.c.error ?? -1)) : rows;
    pages.reorder(sorted.map((r) => r.node));
  } }, el("option", { value: "rows" }, "as in the document"), el("option", { value: "error" }, "worst first"));
  return [el("p", { class: "hint" }, "Bars with two standard errors either way; held-out rows are hatched. A bar leads to its pictures. ", el("label", {}, "Order ", order)), box, pages.pages];
}
