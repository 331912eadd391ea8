// The list of all jobs, newest first, with a drop area for new ones.
import { el, refill, stateTag, timeLeft, verdictTag, when } from "./page_parts.js";
import { getJson, poll } from "./server_link.js";
import { submitPanel } from "./submit_panel.js";

const PAGE_SIZE = 100;

// mixed: the list has jobs of several owners, so each row states its own.
function row(job, mixed) {
  const busy = job.state === "running" || job.state === "queued" || job.state === "paused";
  return el("tr", { class: "link", onclick: () => { location.hash = job.id; } },
    el("td", {}, el("a", { href: `#${job.id}` }, job.sample || "(no name)"), mixed && job.owner ? el("span", { class: "hint" }, ` ${job.owner}`) : null),
    el("td", {}, stateTag(job.state)),
    el("td", { class: "verdict" }, verdictTag(job.verdict)),
    el("td", {}, busy ? el("progress", { max: 1, value: job.fraction, title: `${Math.round(100 * job.fraction)} %` }) : null),
    el("td", {}, job.state === "running" ? job.stage ?? "" : job.state === "failed" ? job.error?.text ?? "" : ""),
    el("td", { class: "number" }, busy ? timeLeft(job) : ""),
    el("td", { class: "number" }, when(job.created_unix_s)));
}

export function listPage(page) {
  const body = el("tbody");
  const empty = el("p", { class: "hint hidden" }, "No jobs yet. Drop a job document and its files below, or use `selvedge submit JOB.json`.");
  const more = el("button", { class: "hidden", onclick: () => { limit += PAGE_SIZE; poller.wake(); } }, "Show more");
  let limit = PAGE_SIZE;
  page.append(
    el("section", { class: "card" }, el("h2", {}, "Jobs"),
      el("table", { id: "jobs" },
        el("thead", {}, el("tr", {}, el("th", {}, "Sample"), el("th", {}, "State"), el("th", {}, "Verdict"), el("th", { width: "170" }, "Progress"), el("th", {}, ""),
          el("th", { class: "number" }, "Time left"), el("th", { class: "number" }, "Created"))), body),
      empty, more),
    submitPanel());
  const poller = poll(async () => {
    const { jobs, next_cursor: next } = await getJson(`/v1/jobs?limit=${Math.min(limit, 500)}`);
    const mixed = new Set(jobs.map((j) => j.owner)).size > 1;
    refill(body, jobs, () => jobs.map((j) => row(j, mixed)));
    empty.classList.toggle("hidden", jobs.length > 0);
    more.classList.toggle("hidden", next === null || next === undefined || limit >= 500);
    return jobs.some((j) => j.state === "running" || j.state === "queued") ? 2 : 8;
  });
  return () => poller.stop();
}
