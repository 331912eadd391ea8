// Actions on the selected jobs of the list.
import { compareAddress, MOST_PLOTTED as MOST } from "../compare/compare_page.js";
import { el } from "../page_parts.js";
import { sendJson } from "../server_link.js";

const LIVE = new Set(["queued", "running", "paused"]), ENDED = new Set(["failed", "cancelled"]);
const WORDS = { cancel: "cancelled", retry: "queued again", delete: "deleted", tag: "tagged" };

// The outcome of an action in words: "3 deleted, 1 unchanged; 1 refused: ...".
function outcomeOf(action, results) {
  const n = (outcome) => results.filter((r) => r.outcome === outcome).length, refused = results.filter((r) => r.outcome === "refused");
  const parts = [n("done") ? `${n("done")} ${WORDS[action]}` : null, n("unchanged") ? `${n("unchanged")} unchanged` : null].filter(Boolean);
  if (refused.length) parts.push(`${refused.length} refused: ${refused[0].detail}`);
  return parts.join(", ");
}

// picked: the Map of selected jobs; clear() empties it; done() is called after a change.
export function bulkActions(picked, { clear, done }) {
  const tag = el("input", { type: "text", placeholder: "tag", "aria-label": "tag to add or remove", maxLength: 40 });
  const said = el("span", { role: "status" }), count = el("b", {});
  let sure = false; // Delete was pressed once
  const send = async (action, more = {}) => {
    const jobs = [...picked.keys()], results = [];
    try {
      for (let i = 0; i < jobs.length; i += 500) results.push(...(await sendJson("POST", "/v1/actions", { action, jobs: jobs.slice(i, i + 500), ...more })).results);
      if (action === "delete") clear();
      said.textContent = outcomeOf(action, results);
    } catch (error) { said.textContent = error.message; }
    show();
    done();
  };
  const withTag = (key) => () => { if (tag.value.trim()) send("tag", { [key]: tag.value.trim().split(/[\s,]+/) }); };
  const button = (text, onclick) => el("button", { type: "button", onclick }, text);
  const cancel = button("Cancel jobs", () => send("cancel")), retry = button("Retry", () => send("retry"));
  const compare = button("Compare", () => { location.hash = compareAddress([...picked.keys()]); });
  const copy = button("Copy", () => { location.hash = `#new?copy=${[...picked.keys()][0]}`; });
  const remove = button("Delete", () => { if (sure) send("delete"); sure = !sure; show(); });
  const node = el("div", { class: "bulk hidden", id: "bulk", role: "toolbar", "aria-label": "selected jobs" }, count, compare, copy, cancel, retry, remove, tag, button("Add tag", withTag("add_tags")),
    button("Remove tag", withTag("remove_tags")), button("Select none", () => { clear(); }), said);
  tag.addEventListener("keydown", (e) => { if (e.key === "Enter") withTag("add_tags")(); });
  function show() {
    const jobs = [...picked.values()];
    count.textContent = jobs.length ? `${jobs.length} selected` : "";
    cancel.disabled = !jobs.some((j) => LIVE.has(j.state) || j.state === "draft");
    retry.disabled = !jobs.some((j) => ENDED.has(j.state));
    compare.disabled = jobs.length < 2 || jobs.length > MOST;
    compare.title = compare.disabled ? `Select two to ${MOST} jobs to compare them.` : "side by side, and as plots";
    copy.disabled = jobs.length !== 1;
    copy.title = copy.disabled ? "Select one job to copy it." : "a new job with this document, to be changed";
    remove.textContent = sure ? `Really delete ${jobs.length}?` : "Delete";
    for (const control of [remove, tag]) control.disabled = jobs.length === 0;
    node.classList.toggle("hidden", jobs.length === 0 && said.textContent === "");
  }
  return { node, show, changed() { sure = false; if (picked.size) said.textContent = ""; show(); } };
}
