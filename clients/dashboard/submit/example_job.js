// The example behind one button: a described cloth and a table of reflectances that come with the dashboard (submit/example.json).
import { el } from "../page_parts.js";
import { raw, sendJson } from "../server_link.js";
import { declare, pieceBytes, upload } from "./uploads.js";

async function submitExample() {
  const example = await (await raw("GET", "submit/example.json")).json();
  const job = await sendJson("POST", "/v1/jobs", example.document), piece = await pieceBytes();
  const file = new File([`${example.table.join("\n")}\n`], example.document.measurements.file, { type: "text/csv" });
  const state = await declare(job.id, { name: file.name, role: "measurements" }, file);
  if (state.state !== "complete") await upload(file, state.upload_url, piece, () => {});
  await sendJson("POST", `/v1/jobs/${job.id}/start`);
  return job.id;
}

// A button that submits the example and goes to its page, with a sentence on it.
export function exampleOffer() {
  const said = el("span", { class: "hint", role: "status" }, "A blue twill and 40 measured values come with this page: after a minute or two there is a cloth to turn with the mouse.");
  const button = el("button", { type: "button", id: "example", onclick: async () => {
    button.disabled = true;
    try { location.hash = await submitExample(); } catch (error) { said.className = "note bad"; said.textContent = error.message; button.disabled = false; }
  } }, "Try an example");
  return el("div", { class: "example" }, button, said);
}
