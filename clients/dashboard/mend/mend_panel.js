// Mending a job in place: after an error of its input, the field at fault with its value to edit and the file to
// replace; of a draft, the files that are missing. Then the job runs again.
import { memberText } from "../copied_job.js";
import { el, size } from "../page_parts.js";
import { raw, sendJson } from "../server_link.js";
import { declare, filesOf, pieceBytes, removeFile, upload } from "../submit_panel.js";
import { placeOf, replaced } from "./json_place.js";

const INPUT_ERRORS = new Set(["invalid", "format", "numeric", "unsupported", "not_found", "too_large"]), SHOWN_FILES = 6;

// True when the job failed by its input, so that running it again without a change fails again.
export const failedByInput = (job) => Boolean(job.error) && INPUT_ERRORS.has(job.error.code);
export const canBeMended = (job) => (job.state === "failed" && failedByInput(job)) || (job.state === "draft" && (failedByInput(job) || job.missing_files?.length > 0));

// The files at fault: those that the message names, else those of the field; and those that are missing.
export function filesAtFault(job, value) {
  const all = filesOf(job.document ?? {}), said = job.error ? job.error.text : "";
  const names = new Set(typeof value === "string" ? [value] : Array.isArray(value) ? value : [value?.file, ...(value?.files ?? [])]);
  const named = all.filter((f) => said.includes(f.name)), ofField = all.filter((f) => names.has(f.name));
  const missing = all.filter((f) => job.missing_files?.includes(f.name));
  const fault = failedByInput(job) ? (named.length ? named : ofField) : [];
  return [...new Set([...fault, ...missing])];
}

export class MendPanel {
  // again() is called when the job has been changed
  constructor(id, again) {
    this.node = el("div", { id: "mend" });
    this.id = id;
    this.again = again;
    this.key = null;
    this.busy = false;
    this.fault = ""; // of the last try: it stays when the panel is built anew for the changed job
  }

  async update(job) {
    const shown = canBeMended(job), key = shown ? JSON.stringify([job.state, job.error, job.generation, job.attempt, job.document, job.missing_files]) : "";
    if (this.busy || key === this.key) return;
    this.key = key;
    if (!shown) { this.fault = ""; this.node.replaceChildren(); return; }
    const answer = await raw("GET", `/v1/jobs/${this.id}`); // as text, because numbers must not be rounded
    const source = memberText(await answer.text(), "document");
    if (source !== null && key === this.key) this.build(job, source);
  }

  build(job, source) {
    const field = failedByInput(job) ? job.error.field ?? "" : null, place = field === null ? null : placeOf(source, field);
    const before = place ? source.slice(place.from, place.to) : "";
    this.say = el("p", { class: this.fault ? "note bad" : "hint", role: "status", id: "mend-said" }, this.fault);
    this.fault = "";
    this.chosen = new Map();
    const parts = [field === null ? el("h3", {}, "Files that this job still needs") : el("h3", {}, "Mend the input and run again")];
    let input = null;
    if (place) {
      const lines = before.split("\n").length, long = before.length > 80 || lines > 1;
      input = el(long ? "textarea" : "input", { id: "mend-value", class: "mono", value: before, spellcheck: false, rows: long ? Math.min(16, Math.max(lines, Math.ceil(before.length / 100))) : null });
      parts.push(el("p", {}, "Field at fault: ", el("b", { class: "mono", id: "mend-field" }, field || "not known")),
        el("label", { class: "mend-line" }, el("span", { class: "mono" }, place.path || "the whole document"), input),
        place.path !== field && field ? el("p", { class: "hint" }, `The document does not set ${field}; this is what contains it.`) : null);
    }
    const files = filesAtFault(job, place ? JSON.parse(before) : null);
    parts.push(el("ul", { class: "mend-files" }, files.slice(0, SHOWN_FILES).map((f) => this.fileLine(job, f))),
      files.length > SHOWN_FILES ? el("p", { class: "hint" }, `and ${files.length - SHOWN_FILES} more, when these have arrived`) : null);
    const go = el("button", { type: "button", class: "main", id: "mend-go", onclick: () => this.run(job, source, place, input, go) }, "Save and run again");
    parts.push(el("div", { class: "mend-end" }, go, this.say));
    this.node.replaceChildren(...parts.filter(Boolean));
  }

  fileLine(job, f) {
    const now = job.files?.find((one) => one.name === f.name && one.state === "complete"), picked = el("span", { class: "hint" });
    const choose = el("input", { type: "file", "aria-label": `${now ? "replacement for" : "file for"} ${f.name}`, onchange: () => {
      const file = choose.files[0];
      if (file) this.chosen.set(f, file); else this.chosen.delete(f);
      picked.textContent = !file ? "" : file.name === f.name ? size(file.size) : `${size(file.size)}; it will have the name ${f.name}`;
    } });
    return el("li", {}, el("span", { class: "mono" }, f.name), el("span", { class: "hint" }, now ? `${size(now.size)} on the server` : "missing"),
      el("label", {}, now ? "Replace by " : "Upload ", choose), picked);
  }

  // The document first: when it is refused, no file has been replaced.
  async run(job, source, place, input, go) {
    const say = (text, bad = false) => { this.say.textContent = text; this.say.className = bad ? "note bad" : "hint"; };
    const text = place && input.value !== source.slice(place.from, place.to) ? input.value : null;
    if (text !== null) {
      try { JSON.parse(text); } catch (error) { say(`The new value is no JSON: ${error.message}. Texts stand in quotation marks.`, true); return; }
    }
    if (text === null && this.chosen.size === 0 && failedByInput(job)) { say("Nothing has changed: edit the value or choose a file.", true); return; }
    this.busy = go.disabled = true;
    try {
      let missing = job.missing_files ?? [];
      if (text !== null) {
        const answer = await raw("PUT", `/v1/jobs/${this.id}/document`, { body: replaced(source, place, text), header: { "Content-Type": "application/json" } });
        missing = (await answer.json()).missing_files;
      }
      const piece = this.chosen.size ? await pieceBytes() : 0;
      for (const [f, file] of this.chosen) {
        say(`${f.name}: ${size(file.size)}`);
        if (job.files?.some((one) => one.name === f.name)) await removeFile(this.id, f.name);
        const state = await declare(this.id, f, file);
        if (state.state !== "complete") await upload(file, state.upload_url, piece, (n) => say(`${f.name}: ${size(n)} of ${size(file.size)}`));
      }
      missing = missing.filter((name) => ![...this.chosen.keys()].some((f) => f.name === name));
      if (missing.length) throw new Error(`Saved, but not started: ${missing.slice(0, SHOWN_FILES).join(", ")} ${missing.length > 1 ? "are" : "is"} missing.`);
      await sendJson("POST", `/v1/jobs/${this.id}/start`);
      say("Started.");
      this.key = null;
    } catch (error) {
      this.fault = error.message;
      this.key = null;
    }
    this.busy = go.disabled = false;
    this.again();
  }
}
