// A picture among the results of a job that may still run: the file at an address changes, so that it is read anew.
import { el } from "../page_parts.js";
import { raw } from "../server_link.js";

export function freshPicture(url, words) {
  const node = el("img", { alt: words });
  node.addEventListener("load", () => URL.revokeObjectURL(node.src));
  raw("GET", url).then((answer) => answer.blob()).then((blob) => { node.src = URL.createObjectURL(blob); }, () => {});
  return node;
}
