// The list of jobs: filters, order and pages, which are in the address; live by long polls that transfer changed rows.
import { bulkActions } from "./bulk_actions.js";
import { JobTable } from "./job_table.js";
import { el, VERDICTS } from "../page_parts.js";
import { exampleOffer } from "../submit/example_job.js";
import { getJson, poll, raw } from "../server_link.js";

const PAGE_SIZE = 50, WAIT_S = 25, STATES = ["draft", "queued", "running", "paused", "succeeded", "failed", "cancelled"];
const VERDICT_CHOICES = [...Object.entries(VERDICTS).map(([code, [words]]) => [code, code === "usable" ? `${words} (older results)` : words]), ["none", "none"]];
const KEYS = ["sample", "state", "verdict", "tag", "from", "to", "batch", "sort", "order"];

// The beginning of a day in the reader's zone, in seconds since 1970; days: how many days later.
function dayStart(text, days = 0) {
  const [year, month, day] = text.split("-").map(Number);
  return new Date(year, month - 1, day + days).getTime() / 1000;
}

// The query of the API that corresponds to the address.
function queryOf(wanted) {
  const query = new URLSearchParams({ view: "row", limit: String(PAGE_SIZE) });
  for (const key of ["sample", "state", "verdict", "tag", "batch", "sort", "order"]) if (wanted.get(key)) query.set(key, wanted.get(key));
  if (wanted.get("from")) query.set("created_after", String(dayStart(wanted.get("from"))));
  if (wanted.get("to")) query.set("created_before", String(dayStart(wanted.get("to"), 1)));
  return query;
}

function choice(label, key, wanted, options, change) {
  return el("label", {}, label, el("select", { onchange: (e) => change(key, e.target.value) },
    el("option", { value: "" }, "any"), options.map(([value, text]) => el("option", { value, selected: wanted.get(key) === value }, text))));
}

function filters(wanted, change) {
  let timer = null;
  const soon = (e) => { clearTimeout(timer); timer = setTimeout(() => change("sample", e.target.value.trim()), 250); };
  const tags = el("datalist", { id: "known-tags" });
  getJson("/v1/tags").then(({ tags: list }) => tags.append(...list.map((t) => el("option", { value: t.tag }, `${t.jobs} jobs`)))).catch(() => {});
  const tag = el("input", { type: "text", value: wanted.get("tag") ?? "", size: 12, onchange: (e) => change("tag", e.target.value.trim()) });
  tag.setAttribute("list", "known-tags");
  const day = (label, key) => el("label", {}, label, el("input", { type: "date", value: wanted.get(key) ?? "", onchange: (e) => change(key, e.target.value) }));
  return el("form", { class: "filters", role: "search", onsubmit: (e) => e.preventDefault() },
    el("label", {}, "Sample", el("input", { type: "search", name: "sample", value: wanted.get("sample") ?? "", placeholder: "part of its name", oninput: soon })),
    choice("State", "state", wanted, STATES.map((s) => [s, s]), change), choice("Verdict", "verdict", wanted, VERDICT_CHOICES, change),
    el("label", {}, "Tag", tag, tags), day("Made from", "from"), day("to", "to"),
    wanted.get("batch") ? el("button", { type: "button", onclick: (e) => { e.target.remove(); change("batch", ""); } }, "Jobs of all batches") : null);
}

// A heading that sorts by its column.
function heading(text, key, wanted, change) {
  const now = wanted.get("sort") || "created", up = wanted.get("order") === "asc";
  const next = key === now ? (up ? "desc" : "asc") : key === "sample" ? "asc" : "desc";
  return el("th", { class: key === "created" ? "number" : "", "aria-sort": key === now ? (up ? "ascending" : "descending") : null },
    el("button", { type: "button", onclick: () => change("sort", key, "order", next) }, text));
}

export function listPage(page, asked) {
  const wanted = new URLSearchParams([...asked].filter(([key]) => KEYS.includes(key)));
  const picked = new Map(), body = el("tbody"), head = el("tr"), empty = el("p", { class: "hint hidden", id: "no-jobs" }), example = exampleOffer();
  example.classList.add("hidden");
  const cursors = [null]; // of the pages before, and of this one
  let tag = null, next = null, request = new AbortController();

  const again = () => { tag = null; request.abort(); request = new AbortController(); };
  const show = () => { table.clear(); again(); };
  const change = (...pairs) => {
    for (let i = 0; i < pairs.length; i += 2) { if (pairs[i + 1]) wanted.set(pairs[i], pairs[i + 1]); else wanted.delete(pairs[i]); }
    history.replaceState(null, "", [...wanted].length ? `#?${wanted}` : "#");
    cursors.length = 1;
    headings();
    show();
  };
  const byTag = (one) => { change("tag", one); page.querySelector(".filters").replaceWith(filters(wanted, change)); };
  const clear = () => { for (const id of [...picked.keys()]) { if (table.lines.has(id)) table.pick(id, false); else picked.delete(id); } bulk.changed(); };
  const bulk = bulkActions(picked, { clear, done: again });
  const all = el("input", { type: "checkbox", "aria-label": "select all jobs of this page", onchange: () => { for (const id of table.order) table.pick(id, all.checked); } });
  const table = new JobTable(body, picked, { changed: () => { all.checked = table.order.length > 0 && table.order.every((id) => picked.has(id)); bulk.changed(); }, renewed: bulk.show, byTag });
  const back = el("button", { type: "button", onclick: () => { cursors.pop(); show(); } }, "Newer"), forth = el("button", { type: "button", onclick: () => { cursors.push(next); show(); } }, "Older");
  const place = el("span", { class: "hint" });
  const headings = () => head.replaceChildren(el("th", { class: "pick" }, all), el("td", {}), heading("Sample", "sample", wanted, change), el("th", {}, "State"), el("th", {}, "Verdict"),
    el("th", {}, "Progress"), el("th", {}, "Stage or fault"), el("th", { class: "number" }, "Time left"), heading("Created", "created", wanted, change));
  headings();
  const card = el("section", { class: "card" }, el("h1", { class: "list" }, "Jobs"), filters(wanted, change), bulk.node,
    el("div", { class: "wide" }, el("table", { id: "jobs" }, el("thead", {}, head), body)), empty, example, el("div", { class: "pages" }, back, forth, place));
  page.append(card);

  const poller = poll(async () => {
    const query = queryOf(wanted), cursor = cursors[cursors.length - 1], have = table.digests(), signal = request.signal;
    if (cursor) query.set("cursor", cursor);
    if (tag && !document.hidden) query.set("wait", String(WAIT_S));
    const answer = await raw("GET", `/v1/jobs?${query}${have ? `&have=${have}` : ""}`, { header: tag ? { "If-None-Match": tag } : {}, signal });
    if (answer.status === 304) return 0.2;
    const { jobs, next_cursor: behind } = await answer.json();
    if (signal.aborted) return 0;
    tag = answer.headers.get("ETag");
    next = behind;
    table.update(jobs);
    const filtered = ["sample", "state", "verdict", "tag", "from", "to", "batch"].some((key) => wanted.get(key));
    empty.textContent = filtered ? "No job fits these filters." : "No jobs yet. Press “New job”, or drop the files of a sample or their folder on this page.";
    empty.classList.toggle("hidden", jobs.length > 0);
    const none = jobs.length === 0 && !filtered && cursors.length === 1;
    example.classList.toggle("hidden", !none);
    card.classList.toggle("without-jobs", none);
    back.disabled = cursors.length === 1;
    forth.disabled = next === null;
    const sorted = wanted.get("sort") === "sample" || wanted.get("order") === "asc";
    [back.textContent, forth.textContent] = sorted ? ["Previous", "Next"] : ["Newer", "Older"];
    place.textContent = cursors.length > 1 || next ? `page ${cursors.length}` : "";
    return 0.2;
  });
  return () => { poller.stop(); request.abort(); };
}
