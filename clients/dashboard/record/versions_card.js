// The results of a job's earlier runs: a job that is edited and run again keeps them as numbered versions.
import { compareAddress } from "../compare/compare_page.js";
import { el, size, timeOf, verdictTag } from "../page_parts.js";
import { getJson } from "../server_link.js";

const SHOWN_FILES = ["report.html", "report.pdf", "result.json", "version.json"];

// The links of a version: report, result, document and the whole list of its files, which is got at a click.
function filesOf(version) {
  const list = el("ul", { class: "plain" });
  return el("details", { ontoggle: async (event) => {
    if (!event.target.open || list.childElementCount) return;
    try {
      const { files, inputs } = await getJson(version.url), first = files.filter((f) => SHOWN_FILES.includes(f.path)), rest = files.filter((f) => !SHOWN_FILES.includes(f.path));
      list.replaceChildren(...[...first, ...rest].map((f) => el("li", {}, el("a", { href: f.url, class: "mono", target: "_blank" }, f.path), ` ${size(f.size)}`)),
        ...(inputs ?? []).map((f) => el("li", {}, "input ", el("span", { class: "mono" }, f.name), ` ${size(f.size)}, SHA-256 `, el("span", { class: "mono hash" }, f.sha256 ?? "–"))));
    } catch (error) { list.replaceChildren(el("li", { class: "note bad" }, error.message)); }
  } }, el("summary", {}, `${version.n_file} files, ${size(version.bytes)}`), list);
}

const line = (version) => el("tr", { class: version.current ? "best" : "" }, el("td", { class: "number" }, String(version.version)),
  el("td", {}, timeOf(version.finished_unix_s)), el("td", {}, verdictTag(version.verdict), version.current ? el("span", { class: "tag" }, "present result") : null, version.damaged ? el("span", { class: "tag bad" }, "its description is damaged") : null),
  el("td", {}, filesOf(version)));

export class VersionsCard {
  constructor(parent, id) { this.parent = parent; this.id = id; this.known = ""; }

  async update(job) {
    const key = JSON.stringify([job.generation, job.state, job.attempt]);
    if (key === this.known) return;
    const versions = job.attempt > 0 && (job.generation > 1 || job.state === "draft") ? (await getJson(`/v1/jobs/${this.id}/versions`)).versions : [];
    this.known = key;
    const earlier = versions.filter((v) => !v.current);
    if (!earlier.length) { this.parent.replaceChildren(); return; }
    const all = versions.map((v) => (v.current ? this.id : `${this.id}@${v.version}`));
    this.parent.replaceChildren(el("section", { class: "card", id: "versions" }, el("h2", {}, "Versions of the result"),
      el("p", { class: "hint" }, "This job was edited and run again; the results of earlier runs are kept.", versions.length > 1 ? " " : "", versions.length > 1 ? el("a", { href: compareAddress(all.slice(-8)) }, "Compare them") : null),
      el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "versions of the result" }, el("table", { class: "record" },
        el("thead", {}, el("tr", {}, ["Run", "Finished", "Verdict", "Files"].map((name) => el("th", { scope: "col" }, name)))), el("tbody", {}, versions.map(line))))));
  }
}
