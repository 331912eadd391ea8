// The job whose files were being sent when the page was left: the browser keeps its id, the server its document and the bytes that have arrived.
import { copiedJob } from "../copied_job.js";
import { el, size } from "../page_parts.js";
import { raw } from "../server_link.js";
import { filesOf } from "./job_files.js";

const KEY = "selvedge.upload";

export function rememberUpload(id) { try { localStorage.setItem(KEY, id); } catch { /* without storage there is no offer after a reload */ } }
export function forgetUpload() { try { localStorage.removeItem(KEY); } catch { /* nothing was kept */ } }

// Offers to go on with an upload that was interrupted. goOn(job) is called with the copied job.
export async function offerUpload(node, goOn) {
  let id = null;
  try { id = localStorage.getItem(KEY); } catch { return; }
  if (id === null) return;
  let job;
  try { job = await copiedJob(id); } catch (error) { if (error.status === 404) forgetUpload(); return; }
  if (job.state !== "draft") { forgetUpload(); return; }
  const files = [...job.files.values()], whole = files.filter((f) => f.sha256), bytes = files.reduce((sum, f) => sum + (f.sha256 ? f.size : f.offset ?? 0), 0);
  const close = () => node.replaceChildren();
  node.replaceChildren(el("div", { class: "note", id: "interrupted" },
    el("p", {}, `The upload of “${job.sample || "a job without a name"}” was interrupted: ${whole.length} of ${filesOf(JSON.parse(job.source)).length} files have arrived whole, ${size(bytes)} in all.`),
    el("button", { type: "button", class: "main", onclick: () => { close(); goOn(job); } }, "Go on"),
    el("button", { type: "button", onclick: async () => { close(); forgetUpload(); await raw("DELETE", `/v1/jobs/${id}`).catch(() => {}); } }, "Discard it"),
    el("button", { type: "button", onclick: () => { close(); forgetUpload(); } }, "Keep the draft for later")));
}
