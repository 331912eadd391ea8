// The states of a batch's jobs as a bar, and in words.
import { el } from "../page_parts.js";

const ORDER = ["succeeded", "failed", "cancelled", "running", "paused", "queued", "draft"];

export const stateWords = (states) => ORDER.filter((s) => states[s] > 0).map((s) => `${states[s]} ${s}`).join(", ");

// A strip for each state, as wide as its share of the jobs.
export function stateBar({ states, n_sample: n }) {
  const strips = ORDER.filter((s) => states[s] > 0).map((s) => {
    const strip = el("span", { class: `strip ${s}`, title: `${states[s]} ${s}` });
    strip.style.flexGrow = String(states[s]);
    return strip;
  });
  return el("div", { class: "batch-states", role: "img", "aria-label": n ? stateWords(states) : "no samples" }, strips);
}
