// Tables of fitted parameters, each with its meaning from the catalogue of models, and the comparison of several models.
import { duration, el, isNumber, percentWithError, withError } from "../page_parts.js";
import { PagedList } from "../paged_list.js";

const SHOWN = 36;

const wide = (label, ...content) => el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": label }, ...content);
const heads = (...names) => el("thead", {}, el("tr", {}, names.map((n) => el("th", { class: n === "#Allowed" ? "number allowed" : n.startsWith("#") ? "number" : null }, n.replace("#", "")))));

// list: as fitted() gives it; meaning(parameter): a sentence or ""
export function parameterTable(list, meaning, id) {
  const body = el("tbody"), rows = list.flatMap((p, i) => {
    const words = meaning(p), again = i > 0 && p.set === list[i - 1].set && words === meaning(list[i - 1]); // r, g, b of one colour
    return [p.set !== "" && p.set !== list[i - 1]?.set ? el("tr", {}, el("th", { colspan: 5, class: "set" }, p.set)) : null,
      el("tr", {}, el("td", { class: "parameter" }, el("span", { class: "mono" }, p.name), words && !again ? el("div", { class: "hint" }, words) : null),
        el("td", { class: "number" }, withError(p.value, p.se)), el("td", {}, p.unit === "deg" ? "°" : p.unit),
        el("td", { class: "number hint allowed" }, isNumber(p.lower) ? `${Number(p.lower.toPrecision(4))} … ${Number(p.upper.toPrecision(4))}` : ""),
        el("td", {}, p.flags.map((f) => el("span", { class: "tag warn" }, f))))].filter((row) => row !== null);
  });
  const pages = new PagedList(body, rows, SHOWN, "parameters");
  return el("div", {}, wide("parameters", el("table", { id }, heads("Parameter", "#Value ± standard error", "", "#Allowed", "Remarks"), body)), pages.pages);
}

// Compares the models of a job that fits several. choice: the reason for the best one
export function modelTable(list, choice) {
  const rows = list.map((m) => el("tr", { class: m.best ? "best" : "" }, el("td", { title: m.title }, el("span", { class: "mono" }, m.id)), el("td", { class: "number" }, percentWithError(m.fit, m.fitSe)),
    el("td", { class: "number" }, percentWithError(m.leftOut, m.leftOutSe)), el("td", { class: "number" }, percentWithError(m.held, m.heldSe)),
    el("td", { class: "number" }, isNumber(m.paths) ? `${(m.paths / 1e6).toPrecision(3)} M` : "–"), el("td", { class: "number" }, duration(m.seconds)),
    el("td", {}, m.best ? el("span", { class: "tag good" }, "best") : null, m.converged ? null : el("span", { class: "tag warn" }, "not converged"))));
  return [el("p", { class: "hint" }, `Relative errors of mean radiances. ${choice} The rest of this page shows the best model.`),
    wide("models compared", el("table", { id: "models" }, heads("Model", "#Fitted rows", "#Cross-validated", "#Held-out rows", "#Paths", "#Time", "Remarks"), el("tbody", {}, rows)))];
}

// The models of a job with the profile of a single fiber.
export function profileModels(list) {
  const turned = list.some((m) => isNumber(m.turn_deg)), turn = (m) => (isNumber(m.turn_deg) ? `${withError(m.turn_deg, m.turn_se_deg || undefined)}°${m.turn_determined ? "" : " (not determined)"}` : "–");
  const rows = list.map((m) => el("tr", { class: m.best ? "best" : "" }, el("td", { title: m.title }, el("span", { class: "mono" }, m.id)), el("td", { class: "number" }, percentWithError(m.nrmse)),
    el("td", { class: "number" }, percentWithError(m.rel_rms)), el("td", { class: "number" }, withError(m.scale, m.scale_se || undefined)), turned ? el("td", { class: "number" }, turn(m)) : null, el("td", { class: "number" }, duration(m.fit_wall_s)),
    el("td", {}, m.best ? el("span", { class: "tag good" }, "best") : null, m.converged ? null : el("span", { class: "tag warn" }, "not converged"))));
  return wide("models of the profile", el("table", { id: "profile-models" }, heads("Model", "#Error, of the range", "#Relative error", "#Scale", ...(turned ? ["#Turn of the section"] : []), "#Time", "Remarks"), el("tbody", {}, rows)));
}
