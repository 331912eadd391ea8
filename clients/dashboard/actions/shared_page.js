// The page behind a link (#share/SECRET): one job and its results, read only, for someone without an account. The secret
// stands in the fragment, which no browser sends to a server; it is exchanged for a cookie that counts for this job alone.
import { scatterPlot } from "../comparison.js";
import { jobFront } from "../job/job_front.js";
import { parameterTable } from "../job/parameter_table.js";
import { card, el, percent, size, stateTag, timeLeft, when } from "../page_parts.js";
import { PagedList } from "../paged_list.js";
import { configurations, fitted } from "../result_view.js";
import { getJson, poll, sendJson } from "../server_link.js";

const SHOWN = 25;
const LIVE = new Set(["draft", "queued", "running", "paused"]);

function filesCard(job, { files, archive }) {
  const body = el("tbody"), rows = files.map((f) => el("tr", {}, el("td", {}, el("a", { href: f.url, class: "mono", download: f.path.split("/").pop() }, f.path)), el("td", { class: "number" }, size(f.size))));
  const pages = new PagedList(body, rows, SHOWN, "files"), report = (path, words) => {
    const file = files.find((f) => f.path === path);
    return file ? el("a", { class: "button main", href: file.url, target: "_blank" }, words) : null;
  };
  return card("Files", el("p", { class: "buttons" }, report("report.html", "Report"), report("report.pdf", "Report as PDF"), el("a", { class: "button", href: archive, download: `selvedge-${job.id}.tar` }, "Everything (tar)")),
    el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": "files" }, el("table", { id: "files" }, body)), pages.pages);
}

export function sharedPage(page, secret) {
  document.body.classList.add("shared");
  document.title = "A job – Selvedge";
  let front = null, shown = false, gone = false, opened = null;
  const head = el("section", { class: "card", id: "state" }), content = el("div");
  page.append(head, content);

  const ended = (error) => {
    gone = true;
    poller.stop();
    head.replaceChildren(el("h1", {}, "This link shows nothing any more"), el("p", {}, "It has ended, was revoked, or its address is incomplete. Ask whoever gave it to you for a new one."),
      error.status === 404 ? "" : el("p", { class: "hint" }, error.message));
    content.replaceChildren();
  };

  const showHead = (job) => head.replaceChildren(el("div", { class: "head" }, el("h1", {}, job.sample), stateTag(job.state)),
    el("div", { class: "facts" }, el("span", {}, LIVE.has(job.state) ? `${percent(job.fraction, 0)} done, ${timeLeft(job)} left` : `finished ${when(job.finished_unix_s)}`),
      el("span", {}, `this link is valid until ${when(opened.expires_unix_s)}`)));

  const show = async (job) => {
    shown = true;
    const list = await getJson(`/v1/jobs/${job.id}/results`);
    if (gone) return;
    const compared = configurations(job, new Map(list.files.map((f) => [f.path, f.url]))), parameters = fitted(job);
    front = jobFront({ job, list, compared });
    content.replaceChildren(front.node ?? "", parameters.length ? card("Parameters", parameterTable(parameters, () => "", "parameters")) : "",
      compared.some((c) => c.rendered) ? card("Measured and rendered means", scatterPlot(compared)) : "", filesCard(job, list));
  };

  const poller = poll(async () => {
    try {
      opened ??= await sendJson("POST", "/v1/shared", { secret });
    } catch (error) {
      if (error.status === 404 || error.status === 422) { ended(error); return 60; }
      throw error;
    }
    const job = { ...await getJson(`/v1/jobs/${opened.job}`) };
    if (gone) return 60;
    showHead(job);
    if (job.state !== "succeeded") return LIVE.has(job.state) ? 5 : 60;
    job.result = job.result_url ? await getJson(job.result_url) : null;
    job.parameters = job.result?.parameters ?? null;
    if (!shown) await show(job);
    return 600;
  });
  return () => { gone = true; poller.stop(); front?.close(); document.body.classList.remove("shared"); };
}
