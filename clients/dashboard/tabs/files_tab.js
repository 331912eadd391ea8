// The tab "Files": results to download, inputs with their hashes, and results of earlier runs.
import { card, el, size } from "../page_parts.js";
import { PagedList } from "../paged_list.js";
import { inputsOf } from "../record/job_record.js";
import { VersionsCard } from "../record/versions_card.js";

const SHOWN = 25;

// The link to the report as a page or as PDF, when the job has one.
function report(files, path, text) {
  const page = files.find((f) => f.path === path);
  return page ? el("a", { class: "button main", href: page.url, target: "_blank" }, text) : null;
}

function downloads(job, list) {
  const body = el("tbody"), rows = list.files.map((f) => el("tr", {}, el("td", {}, el("a", { href: f.url, class: "mono", download: f.path.split("/").pop() }, f.path)), el("td", { class: "number" }, size(f.size))));
  const pages = new PagedList(body, rows, SHOWN, "files");
  return [el("p", { class: "buttons" }, report(list.files, "report.html", "Report"), report(list.files, "report.pdf", "Report as PDF"), el("a", { class: "button", href: list.archive, download: `selvedge-${job.id}.tar` }, "Everything (tar)")),
    el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "files" }, el("table", { id: "files" }, body)), pages.pages];
}

export const filesTab = {
  name: "files",
  title: "Files",
  has: ({ job, list }) => list.files.length > 0 || job.files?.length > 0 || job.missing_files?.length > 0 || job.generation > 1,
  key: ({ job, list }) => [job.state, job.generation, job.attempt, job.missing_files, job.files, list.files.map((f) => [f.path, f.size])],
  make({ id, job, list }) {
    const earlier = el("div"), versions = new VersionsCard(earlier, id);
    return {
      node: el("div", {}, list.files.length ? card(job.state === "succeeded" ? "Results" : "Results so far", ...downloads(job, list)) : "", earlier, card("Inputs", inputsOf(job))),
      update: ({ job: now }) => versions.update(now),
    };
  },
};
