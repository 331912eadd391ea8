// The jobs that show the result of a finished one: their progress, what they have made, and links to their files.
import { el, percent, refill, stateTag, timeLeft } from "../page_parts.js";
import { getJson, poll } from "../server_link.js";
import { exportErrors } from "./export_errors.js";

const LIVE = new Set(["draft", "queued", "running", "paused"]);
const MOST = 50;

// Of a picture the view for the eye, else the picture as rendered.
function pictureOf(files) {
  return files.find((f) => f.path === "pictures/on-1-filtered.png") ?? files.find((f) => f.path === "pictures/on-1.png");
}

async function resultOf(job) {
  const { files, archive } = await getJson(`/v1/jobs/${job.id}/results`), picture = pictureOf(files);
  const formats = [...new Set(files.map((f) => f.path.match(/^export\/([^/]+)\//)?.[1]).filter(Boolean))];
  const result = formats.length ? files.find((f) => f.path === "result.json") : null, errors = result ? exportErrors({ result: await getJson(result.url) }) : null;
  return el("div", { class: "made-result" },
    picture ? el("a", { href: `#${job.id}` }, el("img", { src: picture.url, alt: job.sample })) : "",
    el("div", { class: "made-links" },
      picture ? el("a", { class: "button", href: picture.url, download: `${job.id.slice(0, 8)}.png` }, "Picture") : "",
      files.some((f) => f.path === "twin/twin.bin") ? el("a", { class: "button", href: `#${job.id}` }, "Turn the cloth") : "",
      files.some((f) => f.path === "report.pdf") ? el("a", { class: "button", href: files.find((f) => f.path === "report.pdf").url, target: "_blank" }, "Report as PDF") : "",
      formats.length ? el("a", { class: "button", href: archive, download: `${formats.join("-")}-${job.id.slice(0, 8)}.tar` }, `Files (${formats.join(", ")})`) : "",
      el("a", { href: `#${job.id}` }, "Page of this job")), errors ?? "");
}

export class MadeJobs {
  #id;
  #shown = new Map(); // id -> {node, head, body, done}
  #poller;

  constructor(id) {
    this.#id = id;
    this.list = el("ul", { class: "made" });
    this.node = el("section", { class: "card", id: "made", hidden: true }, el("h2", {}, "Made from this job"), this.list);
    this.#poller = poll(() => this.#update());
  }

  async #update() {
    const { jobs } = await getJson(`/v1/jobs?tag=of:${this.#id.slice(0, 8)}&limit=${MOST}`);
    for (const job of jobs) if (!this.#shown.has(job.id)) this.#shown.set(job.id, { head: el("div", { class: "made-head" }), body: el("div"), done: false });
    const rows = jobs.map((job) => {
      const row = this.#shown.get(job.id);
      row.node ??= el("li", { "data-job": job.id }, row.head, row.body);
      return row;
    });
    if (rows.some((row, i) => this.list.children[i] !== row.node) || rows.length !== this.list.childElementCount) this.list.replaceChildren(...rows.map((row) => row.node));
    this.node.hidden = rows.length === 0;
    for (const job of jobs) await this.#show(job, this.#shown.get(job.id));
    return jobs.some((job) => LIVE.has(job.state)) ? 1 : 15;
  }

  async #show(job, row) {
    refill(row.head, [job.sample, job.state, job.fraction, job.eta_s, job.error], () => [el("a", { href: `#${job.id}` }, job.sample), stateTag(job.state),
      LIVE.has(job.state) ? el("progress", { max: 1, value: job.fraction, "aria-label": `progress of ${job.sample}` }) : "",
      job.state === "running" ? el("span", { class: "hint" }, `${percent(job.fraction, 0)}, ${timeLeft(job)} left`) : "",
      job.error ? el("p", { class: "note bad" }, job.error.text) : ""]);
    if (row.done || job.state !== "succeeded") return;
    row.done = true;
    row.body.replaceChildren(await resultOf(job));
  }

  // Looks at once, as after a job was made.
  wake() { this.#poller.wake(); }

  close() { this.#poller.stop(); }
}
