// The table of jobs. It is brought up to date row by row, so that focus, selection and scroll position stay.
import { duration, el, isNumber, stateTag, timeLeft, timeOf, verdictTag, verdictWords } from "../page_parts.js";

const BUSY = new Set(["running", "queued", "paused"]);

function stateCell(job) {
  const place = isNumber(job.queue_position) ? el("div", { class: "hint" }, `place ${job.queue_position}`) : null;
  return [job.cancel_requested ? el("span", { class: "state cancelled" }, "stopping") : stateTag(job.state), place];
}

// The stage of the job, or why it has failed.
function whyCell(job) {
  if (job.state === "running") return job.stage ?? "";
  if (job.state === "failed" || job.error) return job.error?.text ?? "";
  return "";
}

function leftCell(job) {
  if (job.state === "running") return timeLeft(job);
  if (job.state !== "queued" || !job.expected_start_unix_s) return "";
  const wait = job.expected_start_unix_s - Date.now() / 1000;
  const ends = job.expected_end_unix_s ? `, ends in ${duration(job.expected_end_unix_s - Date.now() / 1000)}` : "";
  const title = `about ${new Date(1000 * job.expected_start_unix_s).toLocaleString()}`;
  return el("span", { title }, `${wait > 30 ? `starts in ${duration(wait)}` : "starts soon"}${ends}`);
}

function cells(job, owners, byTag) {
  const verdict = job.verdict ? verdictTag({ ...job.verdict, text: verdictWords(job.verdict.code) }) : null;
  const tags = (job.tags ?? []).map((tag) => el("button", { class: "tag link", title: `only jobs with the tag ${tag}`, onclick: (e) => { e.stopPropagation(); byTag(tag); } }, tag));
  return [
    el("td", { class: "thumb" }, job.thumbnail_url ? el("img", { src: job.thumbnail_url, alt: "", loading: "lazy" }) : null),
    el("td", { class: "sample" }, el("a", { href: `#${job.id}` }, job.sample || "(no name)"), owners && job.owner ? el("span", { class: "hint" }, ` ${job.owner}`) : null, tags.length ? el("div", {}, tags) : null),
    el("td", { class: "is" }, stateCell(job)),
    el("td", { class: "verdict" }, verdict),
    el("td", { class: "going" }, BUSY.has(job.state) && job.state !== "queued" ? el("progress", { max: 1, value: job.fraction ?? 0, "aria-label": "progress", title: `${Math.round(100 * (job.fraction ?? 0))} %` }) : null),
    el("td", { class: "why" }, whyCell(job)),
    el("td", { class: "number" }, leftCell(job)),
    el("td", { class: "number" }, timeOf(job.created_unix_s)),
  ];
}

// Replaces the cells behind the box. The focus stays on the element with the same address or text.
function redraw(line, job, owners, byTag) {
  const held = line.node.contains(document.activeElement) ? document.activeElement : null;
  while (line.node.childElementCount > 1) line.node.lastElementChild.remove();
  line.node.append(...cells(job, owners, byTag));
  if (held && !held.isConnected) [...line.node.querySelectorAll("a, button")].find((x) => x.textContent === held.textContent)?.focus();
}

// picked: a Map of id -> job, which the boxes fill; changed() is called when they have, renewed() when picked jobs are
// other than before.
export class JobTable {
  constructor(body, picked, { changed, renewed, byTag }) {
    this.body = body;
    this.picked = picked;
    this.changed = changed;
    this.renewed = renewed;
    this.byTag = byTag;
    this.lines = new Map(); // id -> {node, box, digest, job}
    this.order = [];
  }

  digests() { return this.order.map((id) => this.lines.get(id).digest).join(","); }

  clear() {
    this.lines.clear();
    this.order = [];
    this.body.replaceChildren();
  }

  #make(id) {
    const box = el("input", { type: "checkbox", checked: this.picked.has(id), "aria-label": "select", onchange: () => this.pick(id, box.checked), onclick: (e) => e.stopPropagation() });
    const node = el("tr", { class: "link", onclick: (e) => { if (!e.target.closest("a, input, button, .pick")) location.hash = id; } }, el("td", { class: "pick" }, box));
    return { node, box, digest: "", job: null };
  }

  pick(id, on) {
    const line = this.lines.get(id);
    if (on) this.picked.set(id, line.job);
    else this.picked.delete(id);
    line.box.checked = on;
    line.node.classList.toggle("picked", on);
    this.changed();
  }

  // rows: as the server gives them with view=row; a row without a sample is as it was.
  update(rows) {
    const owners = new Set(rows.map((r) => r.owner ?? this.lines.get(r.id)?.job.owner)).size > 1;
    const here = new Set(rows.map((r) => r.id));
    for (const [id, line] of this.lines) if (!here.has(id)) { line.node.remove(); this.lines.delete(id); }
    let before = null;
    for (const row of rows) {
      let line = this.lines.get(row.id);
      if (!line) this.lines.set(row.id, line = this.#make(row.id));
      if ("sample" in row && line.digest !== row.digest) {
        Object.assign(line, { job: row, digest: row.digest });
        if (this.picked.has(row.id)) { this.picked.set(row.id, row); this.renewed(); }
        line.box.setAttribute("aria-label", `select ${row.sample}`);
        redraw(line, row, owners, this.byTag);
        line.node.classList.toggle("picked", this.picked.has(row.id));
      }
      const place = before ? before.nextSibling : this.body.firstChild;
      if (place !== line.node) this.body.insertBefore(line.node, place);
      before = line.node;
    }
    this.order = rows.map((r) => r.id);
  }
}
