// Repairing a job in place: after an error of its input, the field at fault with its value to edit and the file to
// replace; of a draft, the files that are missing. Then the job runs again.
import { memberText } from "../copied_job.js";
import { el, size } from "../page_parts.js";
import { raw, sendJson } from "../server_link.js";
import { filesOf } from "../submit/job_files.js";
import { declare, pieceBytes, removeFile, upload } from "../submit/uploads.js";
import { placeOf, replaced } from "./json_place.js";

const INPUT_ERRORS = new Set(["invalid", "format", "numeric", "unsupported", "not_found", "too_large"]), SHOWN_FILES = 6;

// True when the job failed by its input, so that running it again without a change fails again.
export const failedByInput = (job) => Boolean(job.error) && INPUT_ERRORS.has(job.error.code);
export const canBeRepaired = (job) => (job.state === "failed" && failedByInput(job)) || (job.state === "draft" && (failedByInput(job) || job.missing_files?.length > 0));

// The files at fault: the files that the message names, else the files of the field; and missing ones.
export function filesAtFault(job, value) {
  const all = filesOf(job.document ?? {}), said = job.error ? job.error.text : "";
  const names = new Set(typeof value === "string" ? [value] : Array.isArray(value) ? value : [value?.file, ...(value?.files ?? [])]);
  const named = all.filter((f) => said.includes(f.name)), ofField = all.filter((f) => names.has(f.name));
  const missing = all.filter((f) => job.missing_files?.includes(f.name));
  const fault = failedByInput(job) ? (named.length ? named : ofField) : [];
  return [...new Set([...fault, ...missing])];
}

// The faults that an error or a refused document states: [{field, detail}].
const faultsOf = (list) => (list ?? []).map(({ field, detail }) => ({ field: field ?? "", detail: detail ?? "" }));

// The values to edit: one for each place of the text that a fault points to, without those that lie within another.
function placesOf(source, faults) {
  const all = new Map();
  for (const fault of faults) {
    const place = placeOf(source, fault.field), known = all.get(place.from);
    if (known) known.faults.push(fault); else all.set(place.from, { ...place, faults: [fault] });
  }
  const found = [...all.values()], around = (p) => found.find((q) => q !== p && q.from <= p.from && q.to >= p.to);
  for (const p of found) if (around(p)) around(p).faults.push(...p.faults);
  return found.filter((p) => !around(p)).sort((p, q) => p.from - q.from);
}

export class RepairPanel {
  // again() is called when the job has been changed
  constructor(id, again) {
    this.node = el("div", { id: "repair" });
    this.id = id;
    this.again = again;
    this.key = null;
    this.busy = false;
    this.fault = ""; // of the last try: it stays when the panel is built anew for the changed job
    this.refused = null; // the text that the server has refused, and its faults, {text, faults}
    this.inputs = []; // {input, before: its text}
    this.chosen = new Map(); // the files that were chosen
    this.tag = null; // of the job that is shown
    this.written = ""; // the text written when another editor came first
  }

  async update(job) {
    const shown = canBeRepaired(job), key = shown ? JSON.stringify([job.state, job.error, job.generation, job.attempt, job.document, job.missing_files]) : "";
    if (this.busy || key === this.key || (shown && this.key !== null && this.dirty())) return;
    this.key = key;
    if (!shown) { this.fault = this.written = ""; this.refused = null; this.node.replaceChildren(); return; }
    const answer = await raw("GET", `/v1/jobs/${this.id}`); // as text, because numbers must not be rounded
    const source = memberText(await answer.text(), "document");
    if (source === null || key !== this.key) return;
    this.tag = answer.headers.get("ETag");
    const checked = failedByInput(job) ? await this.check(source) : [];
    if (key === this.key) this.build(job, source, checked);
  }

  // Further faults of the stored document; none for a reader who may not ask.
  async check(source) {
    try {
      const answer = await raw("POST", "/v1/check", { body: source, header: { "Content-Type": "application/json" } });
      return faultsOf((await answer.json()).errors);
    } catch (error) {
      if (error.status === 403) return [];
      throw error;
    }
  }

  // Whether something is written or chosen that was not saved: the panel then stays, and saving says that the job has changed.
  dirty() { return this.inputs.some(({ input, before }) => input.value !== before) || this.chosen.size > 0; }

  // The faults of the job: the one that it failed by, and all others that its document has.
  faults(job, checked) {
    if (this.refused) return this.refused.faults;
    if (!failedByInput(job)) return [];
    const own = { field: job.error.field ?? "", detail: "" };
    return [own, ...checked.filter((f) => f.field !== own.field)];
  }

  build(job, stored, checked) {
    const source = this.refused?.text ?? stored, faults = this.faults(job, checked), places = placesOf(source, faults);
    this.say = el("p", { class: this.fault ? "note bad" : "hint", role: "status", id: "repair-said" }, this.fault);
    this.fault = "";
    this.chosen = new Map();
    const title = faults.length === 0 ? "Files that this job still needs" : faults.length === 1 ? "Repair the input and run again" : `Repair the input and run again: ${faults.length} faults`;
    const parts = [el("h3", {}, title)], inputs = places.map((place, i) => this.valueLine(source, place, i, parts));
    this.inputs = inputs.map((input, i) => ({ input, before: source.slice(places[i].from, places[i].to) }));
    const value = (place) => { try { return JSON.parse(source.slice(place.from, place.to)); } catch { return null; } };
    const files = [...new Set(places.length ? places.flatMap((place) => filesAtFault(job, value(place))) : filesAtFault(job, null))];
    parts.push(el("ul", { class: "repair-files" }, files.slice(0, SHOWN_FILES).map((f) => this.fileLine(job, f))));
    if (files.length > SHOWN_FILES) parts.push(el("p", { class: "hint" }, `and ${files.length - SHOWN_FILES} more, when these have arrived`));
    if (this.written) parts.push(el("details", { open: true }, el("summary", {}, "What you had written"), el("pre", { class: "mono" }, this.written)));
    this.written = "";
    const go = el("button", { type: "button", class: "main", id: "repair-go", onclick: () => this.run(job, { stored, source, places, inputs }, go) }, "Save and run again");
    parts.push(el("div", { class: "repair-end" }, go, this.say));
    this.node.replaceChildren(...parts);
  }

  // Appends one value with its faults; returns its input.
  valueLine(source, place, i, parts) {
    const before = source.slice(place.from, place.to), lines = before.split("\n").length, long = before.length > 80 || lines > 1;
    const input = el(long ? "textarea" : "input", { id: i === 0 ? "repair-value" : `repair-value-${i}`, class: "mono", value: before, spellcheck: false, rows: long ? Math.min(16, Math.max(lines, Math.ceil(before.length / 100))) : null });
    const fields = [...new Set(place.faults.map((f) => f.field))], absent = fields.filter((field) => field && field !== place.path);
    parts.push(el("p", {}, fields.length > 1 ? "Fields at fault: " : "Field at fault: ", el("b", { class: "mono", id: i === 0 ? "repair-field" : null }, fields.filter(Boolean).join(", ") || "not known")),
      ...place.faults.filter((f) => f.detail).map((f) => el("p", { class: "note bad" }, f.detail)),
      el("label", { class: "repair-line" }, el("span", { class: "mono" }, place.path || "the whole document"), input));
    if (absent.length) parts.push(el("p", { class: "hint" }, `The document does not set ${absent.join(", ")}; this is what contains it.`));
    return input;
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

  // The stored text with all edits; null without one. Throws when it is no JSON.
  edited({ stored, source, places, inputs }) {
    let text = source;
    for (let i = places.length - 1; i >= 0; i--) {
      const { value } = inputs[i];
      if (value === source.slice(places[i].from, places[i].to)) continue;
      try { JSON.parse(value); } catch (error) { throw new Error(`The new value of ${places[i].path || "the document"} is no JSON: ${error.message}. Texts stand in quotation marks.`); }
      text = replaced(text, places[i], value);
    }
    return text === stored ? null : text;
  }

  // Saves the document, also one that is as before: the server refuses it if another editor has changed the job.
  async save(text, changed) {
    const header = { "Content-Type": "application/json", ...(this.tag ? { "If-Match": this.tag } : {}) };
    try {
      const answer = await raw("PUT", `/v1/jobs/${this.id}/document`, { body: text, header });
      this.refused = null;
      return (await answer.json()).missing_files;
    } catch (error) {
      if (error.status === 422 && error.body?.errors?.length) this.refused = { text, faults: faultsOf(error.body.errors) };
      if (error.status !== 412) throw error;
      this.refused = null;
      this.written = changed ? text : "";
      throw new Error("Somebody has changed this job meanwhile. Nothing of yours was saved; this is the job as it is now.");
    }
  }

  async send(job, say) {
    const piece = this.chosen.size ? await pieceBytes() : 0;
    for (const [f, file] of this.chosen) {
      say(`${f.name}: ${size(file.size)}`);
      if (job.files?.some((one) => one.name === f.name)) await removeFile(this.id, f.name);
      const state = await declare(this.id, f, file);
      if (state.state !== "complete") await upload(file, state.upload_url, piece, (n) => say(`${f.name}: ${size(n)} of ${size(file.size)}`));
    }
  }

  // The document first: when it is refused, no file has been replaced.
  async run(job, texts, go) {
    const say = (text, bad = false) => { this.say.textContent = text; this.say.className = bad ? "note bad" : "hint"; };
    let text = null;
    try { text = this.edited(texts); } catch (error) { say(error.message, true); return; }
    if (text === null && this.chosen.size === 0 && failedByInput(job)) { say("Nothing has changed: edit a value or choose a file.", true); return; }
    this.busy = go.disabled = true;
    try {
      const said = await this.save(text ?? texts.stored, text !== null);
      await this.send(job, say);
      const missing = said.filter((name) => ![...this.chosen.keys()].some((f) => f.name === name));
      if (missing.length) throw new Error(`Saved, but not started: ${missing.slice(0, SHOWN_FILES).join(", ")} ${missing.length > 1 ? "are" : "is"} missing.`);
      await sendJson("POST", `/v1/jobs/${this.id}/start`);
      say("Started.");
    } catch (error) {
      this.fault = error.message;
    }
    this.key = null;
    this.busy = go.disabled = false;
    this.again();
  }
}
