// "#batches": the batches, newest first, with their progress.
import { el, timeOf } from "../page_parts.js";
import { getJson, poll } from "../server_link.js";
import { stateBar, stateWords } from "./state_bar.js";

const PAGE_SIZE = 50;

const lineOf = (batch) => el("tr", {},
  el("td", { class: "sample" }, el("a", { href: `#batch/${batch.id}` }, batch.name), batch.owner ? el("span", { class: "hint" }, ` ${batch.owner}`) : null),
  el("td", { class: "number" }, String(batch.n_sample)), el("td", { class: "going" }, stateBar(batch)), el("td", {}, stateWords(batch.states)),
  el("td", { class: "number" }, timeOf(batch.updated_unix_s)));

export function batchesPage(page) {
  document.title = "Batches – Selvedge";
  const body = el("tbody"), empty = el("p", { class: "hint hidden", id: "no-batches" },
    "No batches yet. `selvedge batch submit TEMPLATE.json TABLE.csv` makes one from a table of samples.");
  const cursors = [null];
  let next = null, shown = "";
  const back = el("button", { type: "button", onclick: () => { cursors.pop(); poller.wake(); } }, "Newer");
  const forth = el("button", { type: "button", onclick: () => { cursors.push(next); poller.wake(); } }, "Older");
  page.append(el("section", { class: "card" }, el("h1", { class: "list" }, "Batches"),
    el("div", { class: "wide" }, el("table", { id: "batches" }, el("thead", {}, el("tr", {}, el("th", {}, "Batch"), el("th", { class: "number" }, "Samples"), el("th", {}, "Progress"), el("th", {}, "States"), el("th", { class: "number" }, "Submitted"))), body)),
    empty, el("div", { class: "pages" }, back, forth)));
  const poller = poll(async () => {
    const cursor = cursors[cursors.length - 1];
    const { batches, next_cursor: behind } = await getJson(`/v1/batches?limit=${PAGE_SIZE}${cursor ? `&cursor=${cursor}` : ""}`);
    next = behind;
    if (JSON.stringify(batches) !== shown) {
      const held = document.activeElement?.closest("#batches") ? document.activeElement.getAttribute("href") : null;
      shown = JSON.stringify(batches);
      body.replaceChildren(...batches.map(lineOf));
      if (held) [...body.querySelectorAll("a")].find((a) => a.getAttribute("href") === held)?.focus();
    }
    empty.classList.toggle("hidden", batches.length > 0);
    back.disabled = cursors.length === 1;
    forth.disabled = next === null;
    return 2;
  });
  return () => poller.stop();
}
