// The first card of a job's page: its verdict, one picture of the cloth, the twin and four numbers.
import { el, verdictTag } from "../page_parts.js";
import { twinCard } from "../twin/twin_card.js";
import { clothPicture, pictureNode } from "./cloth_picture.js";
import { keyNumbers, numbersNode } from "./key_numbers.js";

const SHOWN = 4; // reservations

// The verdict on the result: words, the sentence and the reservations.
function verdictNode(verdict) {
  if (!verdict) return null;
  const items = verdict.reservations.map((r) => el("li", { title: r.code }, r.text));
  return el("div", { id: "verdict" }, el("p", {}, verdictTag(verdict), ` ${verdict.text}`), items.length ? el("ul", {}, items.slice(0, SHOWN)) : null,
    items.length > SHOWN ? el("details", {}, el("summary", {}, `${items.length - SHOWN} more`), el("ul", {}, items.slice(SHOWN))) : null);
}

// {node, close} for a job that has ended with a result; {node: null} when there is nothing to show.
export function jobFront({ job, list, compared }) {
  const done = job.state === "succeeded" && job.result, picture = clothPicture(job, list.files), twin = done ? twinCard(job, list.files, compared) : null;
  const numbers = done && keyNumbers(job).length ? numbersNode(job) : null, verdict = done ? verdictNode(job.verdict) : null;
  if (!picture && !verdict && !numbers) return { node: null, close: () => {} };
  const pictures = el("div", { class: "looks" }, picture ? pictureNode(picture) : null, twin?.box);
  return { node: el("section", { class: `card front${twin ? " with-twin" : picture ? "" : " words"}${done ? "" : " early"}`, id: "front" }, verdict, picture || twin ? pictures : null, numbers), close: () => twin?.close() };
}
// The twin of a job may come after its result, and the picture grows.
export const frontKey = ({ job, list }) => [job.generation, job.state === "succeeded", job.verdict, clothPicture(job, list.files), list.files.some((f) => f.path === "twin/twin.json")];
