// The tab "Settings": the job document, versions and dates, and what the input files state.
import { el } from "../page_parts.js";
import { jobRecord } from "../record/job_record.js";
import { statements } from "../result_view.js";

function statementsCard(job) {
  const stated = statements(job);
  if (!stated.length) return "";
  return el("section", { class: "card", id: "statements" }, el("details", { open: !stated.every((s) => s.applied) },
    el("summary", {}, "Statements of the files"), el("ul", {}, stated.map((s) => el("li", {}, s.text)))));
}

export const settingsTab = {
  name: "settings",
  title: "Settings",
  has: () => true,
  key: ({ job }) => [job.state, job.generation, job.attempt, job.finished_unix_s, job.document, job.result_url],
  make: ({ job, about }) => ({ node: el("div", {}, jobRecord(job, about), statementsCard(job)) }),
};
