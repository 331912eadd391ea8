// The page of a new job. Files or a folder are dropped; the job document is written from them, from the answers to a few questions and from the
// angles, unless a job document (*.json) is among them or a job is copied: then that document holds, and names the files.
import { copiedJob } from "./copied_job.js";
import { documentEditor, holdsLargeNumber } from "./document_editor.js";
import { droppedFiles } from "./dropped_files.js";
import { el, size } from "./page_parts.js";
import { Problem, raw, sendJson } from "./server_link.js";
import { AngleGrid, unplaced } from "./submit/angle_grid.js";
import { exampleOffer } from "./submit/example_job.js";
import { exposureFault, nameFault } from "./submit/file_faults.js";
import { fileLines } from "./submit/file_list.js";
import { guessedKinds, kindOfJson } from "./submit/guessed_kinds.js";
import { forgetUpload, offerUpload, rememberUpload } from "./submit/interrupted_upload.js";
import { filesOf } from "./submit/job_files.js";
import { LiveCheck } from "./submit/live_check.js";
import { stemOf } from "./submit/name_angles.js";
import { missingParts, PresetCards, presetOf } from "./submit/presets.js";
import { Questions } from "./submit/questions.js";
import { RigPicker, rigOf } from "./submit/rig_picker.js";
import { tableHead, withAllRotations } from "./submit/table_head.js";
import { thumbnail } from "./submit/thumbnails.js";
import { removeFile, sendFiles, UploadBar } from "./submit/uploads.js";
import { statesVoxelSize } from "./submit/voxel_statement.js";
import { writeFiles } from "./submit/written_document.js";

const newKey = () => [...crypto.getRandomValues(new Uint8Array(16))].map((b) => b.toString(16).padStart(2, "0")).join("");

class SubmitPanel {
  // handed: {files, folder} that were dropped on another page, or null. copy: the id of a job whose document is the beginning, or null.
  constructor(handed, copy) {
    this.dropped = new Map(); // name -> File
    this.json = new Map(); // name -> kind of a JSON file
    this.chosen = new Map(); // name -> kind that the user has set
    this.kinds = new Map(); // name -> kind
    this.doc = null;
    this.source = null; // the document as text
    this.written = copy === null; // by this page, from the files; otherwise the document was dropped or is a copy
    this.before = null; // the copied job
    this.resumed = false; // whether an interrupted upload goes on
    this.draft = null; // {id, source} of the job that was made by an earlier press of the button, and has not started
    this.picked = null; // the preset that the user has chosen
    this.preset = null;
    this.statesVoxel = true;
    this.table = null; // the head of the table
    this.notes = []; // on files that a job cannot use besides the others
    this.twice = null; // a sentence on names that several files have
    this.open = []; // what must be known and is not
    this.busy = false;
    this.key = null; // of the document, so that a request that is sent twice makes one job
    this.sent = new Map(); // name -> mark of the files that were sent
    this.accepted = null; // the document whose warnings were shown
    this.timer = null;
    this.build(copy);
    if (copy !== null) this.beginCopy(copy); else offerUpload(this.interrupted, (job) => this.goOn(job));
    if (handed) this.take(handed.files, handed.folder);
    this.show();
  }

  build(copy) {
    const change = (now) => this.change(now);
    this.list = el("ul", { id: "new-files", tabIndex: 0, "aria-label": "files of the job" });
    this.message = el("p", { class: "hint", id: "send-state", role: "status" });
    this.go = el("button", { class: "main", id: "send", disabled: true, onclick: () => this.submit() }, "Submit");
    this.bar = new UploadBar();
    this.interrupted = el("div");
    this.remarks = el("div", { id: "file-notes" });
    this.from = el("p", { class: "hint" });
    this.example = exampleOffer();
    this.editor = documentEditor((now) => { this.use(now); this.show(); this.judge(); });
    this.check = new LiveCheck(this.editor, () => this.soon());
    this.rig = new RigPicker(change);
    this.grid = new AngleGrid(change);
    this.questions = new Questions(change);
    this.presets = new PresetCards((id) => { this.picked = id; this.change(this.doc ?? {}); });
    const drop = this.dropZone();
    this.node = el("section", { id: "submit" }, el("div", { class: "card" }, el("h1", {}, copy === null ? "New job" : "New job, from another one"), this.from, this.interrupted,
      this.presets.node, drop, this.example, this.list, this.remarks, this.questions.node),
    this.rig.node, this.grid.node, el("div", { class: "card" }, this.editor.node), el("div", { class: "card send" }, this.check.node, this.message, this.bar.node, this.go));
    this.node.addEventListener("dragover", (e) => { e.preventDefault(); drop.classList.add("over"); });
    this.node.addEventListener("dragleave", () => drop.classList.remove("over"));
    this.node.addEventListener("drop", (e) => { e.preventDefault(); drop.classList.remove("over"); droppedFiles(e.dataTransfer).then(({ files, folder }) => this.take(files, folder)); });
  }

  dropZone() {
    const files = el("input", { type: "file", multiple: true, onchange: () => this.take(files.files) });
    const folder = el("input", { type: "file", webkitdirectory: true,
      onchange: () => this.take([...folder.files].filter((f) => !f.name.startsWith(".")), folder.files[0]?.webkitRelativePath.split("/")[0]) });
    return el("div", { class: "drop" }, el("p", {}, "Drop the files of a sample here, or a folder: scan, photographs, table, draft, rig, or a job document (.json). Or choose ",
      el("label", { class: "file" }, "files", files), " or ", el("label", { class: "file" }, "a folder", folder), "."));
  }

  say(text, className = "hint") { this.message.textContent = text; this.message.className = className; }

  // ---- files ----

  wanted() { return this.doc ? filesOf(this.doc) : []; }

  // The file itself, or the input of the copied job, whose bytes are on the server.
  fileOf(name) { return this.dropped.get(name) ?? (this.before?.files.get(name)?.sha256 ? this.before.files.get(name) : undefined); }

  faultOf(name) { return this.dropped.has(name) ? this.check.fault(this.dropped.get(name)) : null; }

  // The entry of a file in the copied job.
  otherSize(name) {
    const known = this.before?.files.get(name)?.size, now = this.dropped.get(name)?.size, where = this.resumed ? "" : " in the copied job";
    if (known === undefined || now === known) return null;
    if (now === undefined && this.fileOf(name)) return el("span", { class: "hint" }, `${size(known)}${where}, on the server already: it is not sent again`);
    if (now === undefined) return el("span", { class: "hint" }, this.resumed ? `${size(this.before.files.get(name).offset ?? 0)} of ${size(known)} have arrived` : `${size(known)}${where}`);
    return el("span", { class: "tag warn" }, `another file: ${size(known)}${where || " before"}`);
  }

  stateOf(name) {
    const file = this.dropped.get(name);
    if (!file) return this.fileOf(name) ? null : el("span", { class: "tag warn" }, "still missing");
    if (this.faultOf(name)) return el("span", { class: "tag bad" }, this.faultOf(name));
    return this.check.isKnown(file) ? el("span", { class: "hint" }, "on the server already: it is not sent again") : null;
  }

  // The line of a file that the document names.
  named({ name }) {
    const file = this.dropped.get(name), picture = file ? thumbnail(file, () => this.soon()) : el("span", { class: "thumbnail", "aria-hidden": "true" }, el("span", { class: "sign" }, "?"));
    return el("li", { "data-file": name }, picture, el("span", { class: "name" }, el("span", { class: "mono" }, name), file ? el("span", { class: "size" }, size(file.size)) : null),
      el("span", { class: "said" }, this.otherSize(name), " ", this.stateOf(name)));
  }

  lines() {
    if (this.written) {
      const choose = (names, kind) => { for (const name of names) this.chosen.set(name, kind); this.sync(); };
      return [...fileLines({ files: this.dropped, kinds: this.kinds, stateOf: (name) => this.stateOf(name), choose, changed: () => this.soon() }),
        ...this.wanted().filter((f) => !this.dropped.has(f.name)).map((f) => this.named(f))];
    }
    const names = new Set(this.wanted().map((f) => f.name)), unused = [...this.dropped.keys()].filter((name) => !names.has(name) && !name.endsWith(".json"));
    const more = unused.length > 6 ? ` and ${unused.length - 6} more` : "";
    return [...this.wanted().map((f) => this.named(f)), this.doc && unused.length ? el("li", { class: "hint" }, `Not named by the document, so not sent: ${unused.slice(0, 6).join(", ")}${more}`) : null].filter(Boolean);
  }

  tableNotes() {
    const name = this.nameOf("table"), head = name && this.doc?.measurements?.file === name ? this.table : null;
    if (!head) return [];
    const turn = async () => this.take([await withAllRotations(this.dropped.get(name), head.by)]);
    return [head.exchanged ? el("p", { class: "note" }, `${name}: ${head.exchanged}`) : null, head.turned ? null : el("div", { class: "note", id: "no-rotation" },
      el("p", {}, `${name} does not say how the cloth was turned, and its lamps all stand on one side: its rows count as measured with the warp along 90°. Is it a material that looks the same from all sides, or a mean over all turns?`),
      el("button", { type: "button", onclick: turn }, "They are means over all turns"))].filter(Boolean);
  }

  nameOf(...wanted) { return [...this.kinds].find(([, kind]) => wanted.includes(kind))?.[0]; }

  // ---- the page as a whole ----

  // Shows the page a moment later, once for all that becomes known until then: of a thousand slices, say.
  soon() { this.timer ??= setTimeout(() => { this.timer = null; this.show(); }, 100); }

  show() {
    const doc = this.doc ?? {}, focused = document.activeElement?.getAttribute("aria-label");
    const locked = this.doc && holdsLargeNumber(this.doc) ? "Views cannot be chosen here: the document holds a whole number above 2^53." : null;
    this.list.replaceChildren(...this.lines());
    const again = focused && [...this.list.querySelectorAll("select")].find((s) => s.getAttribute("aria-label") === focused);
    if (again instanceof HTMLElement) again.focus();
    this.preset = this.picked ?? presetOf(this.kinds);
    this.presets.show(doc, this.preset);
    this.presets.node.classList.toggle("hidden", !this.written);
    this.questions.node.classList.toggle("hidden", !this.written || (this.dropped.size === 0 && this.picked === null));
    this.example.classList.toggle("hidden", !this.written || this.dropped.size > 0 || this.source !== null);
    this.open = this.written ? this.questionsLeft(doc) : [];
    const pictures = [...this.dropped.values()].filter((file) => this.kinds.get(file.name) === "photograph");
    this.remarks.replaceChildren(...[...this.notes, this.twice, exposureFault(pictures)].filter(Boolean).map((text) => el("p", { class: "note" }, text)), ...this.tableNotes());
    this.rig.show(this.doc, locked);
    this.grid.show(locked ? null : this.doc, this.rig.rig !== null && (doc.photographs ?? []).every((p) => p.view !== undefined));
    this.allow();
    if (!this.busy && this.doc && this.accepted !== this.source) this.sayState();
  }

  questionsLeft(doc) {
    const asked = this.questions.show(doc, { preset: this.preset, statesVoxel: this.statesVoxel }), angles = unplaced(doc).length;
    const open = [...asked, ...missingParts(doc, this.preset).filter((part) => !asked.some((word) => part.includes(word)))];
    if (angles) open.push(`the angles of ${angles} photographs`);
    return open;
  }

  sayState() {
    const wanted = this.wanted(), missing = wanted.filter((f) => !this.fileOf(f.name)), faulty = wanted.find((f) => this.faultOf(f.name));
    if (this.open.length) this.say(`Still to give: ${this.open.join("; ")}.`);
    else if (missing.length) this.say(`${missing.length} of ${wanted.length} files are still missing; drop them here.`);
    else if (faulty) this.say(`${faulty.name} ${this.faultOf(faulty.name)}.`, "note bad");
    else this.say("Ready.");
  }

  allow() {
    this.go.disabled = this.busy || this.doc === null || this.open.length > 0 || this.wanted().some((f) => !this.fileOf(f.name) || this.faultOf(f.name));
    this.go.textContent = this.accepted !== null && this.accepted === this.source ? "Start all the same" : "Submit";
  }

  // ---- the document ----

  use(now) {
    if (now !== this.source) { this.key = newKey(); this.accepted = null; }
    this.source = now;
    this.doc = null; // when it is no JSON
    this.doc = JSON.parse(now);
  }

  // The server's check, when nothing is left open.
  judge() { if (this.open.length === 0) this.check.document(this.source); else this.check.clear(); }

  change(now) {
    const text = JSON.stringify(now, null, 2);
    if (text !== this.source) { this.use(text); this.editor.show(text); }
    this.show();
    this.judge();
  }

  // Brings a written document in step with the files.
  sync(folder = "") {
    const now = this.doc ?? {}, names = [...this.dropped.keys()];
    this.kinds = guessedKinds(names, this.json, this.rig.rig, this.grid.pattern, this.chosen);
    this.notes = writeFiles(now, this.kinds, this.grid.patternOf(names.filter((n) => this.kinds.get(n) === "photograph")), this.rig.rig);
    if (now.volume && now.cloth && Object.keys(now.cloth).every((k) => ["weave", "warp_per_cm", "weft_per_cm"].includes(k))) delete now.cloth;
    const scan = this.nameOf("scan", "slice"), rows = this.nameOf("table"), name = folder || stemOf(scan ?? now.fibers?.file ?? now.cloth?.draft_file ?? rows ?? "");
    if (now.sample === undefined && name) now.sample = name;
    this.statesVoxel = true;
    this.table = null;
    if (scan) statesVoxelSize(this.dropped.get(scan)).then((states) => { if (states !== this.statesVoxel) { this.statesVoxel = states; this.show(); } });
    if (rows) tableHead(this.dropped.get(rows)).then((head) => { this.table = head; this.show(); });
    this.change(now);
  }

  async take(files, folder = "") {
    this.accepted = null;
    this.twice = nameFault([...files]);
    for (const file of files) {
      this.dropped.set(file.name, file);
      if (!file.name.endsWith(".json")) { this.check.file(file); continue; }
      if (!await this.takeJson(file)) return;
    }
    if (this.written) { this.sync(folder); return; }
    if (!this.doc) this.say("Drop the job document (.json) as well.");
    this.show();
    if (this.doc) this.check.document(this.source);
  }

  // A rig, the noise of a camera, or the job document. Returns false when it is no JSON.
  async takeJson(file) {
    const text = await file.text(), described = rigOf(text), kind = kindOfJson(text);
    this.json.set(file.name, kind);
    if (described) this.rig.use(file.name, described);
    if (described || kind === "noise") this.check.file(file);
    if (kind !== "document" && (this.written || kind !== "unused")) return true;
    this.written = false;
    try { this.use(text); } catch (error) { this.say(`${file.name}: ${error.message}`, "note bad"); return false; } finally { this.editor.show(text); }
    return true;
  }

  // ---- a copy, and an upload that goes on ----

  async useBefore(job) {
    this.before = job;
    this.written = false;
    this.use(this.editor.load(job.source));
    this.check.document(this.source);
    const name = this.doc.rig?.file;
    if (name && job.files.has(name)) {
      const described = await raw("GET", `/v1/jobs/${job.id}/files/${encodeURIComponent(name)}`).then((answer) => answer.text()).then(rigOf).catch(() => null); // not complete
      if (described) this.rig.use(name, described);
    }
    this.show();
  }

  async beginCopy(id) {
    try {
      await this.useBefore(await copiedJob(id));
      this.from.append("A copy of ", el("a", { href: `#${this.before.id}` }, this.before.sample || "(no name)"), ". Change the document below, then submit it: the earlier job stays as it is.");
    } catch (error) { this.say(error.status === 404 ? `The job to copy is not there: ${error.message}` : error.message, "note bad"); }
  }

  async goOn(job) {
    await this.useBefore(job);
    this.resumed = true;
    this.draft = { id: job.id, source: this.source };
    this.from.append("Browsers do not keep files over a reload: drop the same files again. Each is recognised by its name, its size and its content, and goes on where it was.");
    this.show();
  }

  // ---- sending ----

  async submit() {
    this.busy = true;
    this.allow();
    try {
      await this.send();
    } catch (error) {
      await this.refused(error);
    } finally {
      this.busy = false;
      this.allow();
    }
  }

  // The job of this page: made once, then its document is replaced when it has changed, and files that it no longer names are removed.
  async makeDraft() {
    // sent as it was written, because JSON.parse does not keep numbers above 2^53
    const header = { "Content-Type": "application/json" }, body = this.source;
    if (this.draft && this.draft.source !== body) {
      try {
        await raw("PUT", `/v1/jobs/${this.draft.id}/document`, { body, header });
        const names = new Set(this.wanted().map((f) => f.name));
        for (const name of [...this.sent.keys()].filter((n) => !names.has(n))) { await removeFile(this.draft.id, name); this.sent.delete(name); }
        this.draft.source = body;
      } catch (error) {
        if (error.status !== 404 && error.status !== 409) throw error;
        this.draft = null; // deleted or started elsewhere
      }
    }
    this.draft ??= { id: (await (await raw("POST", "/v1/jobs", { body, header: { ...header, "Idempotency-Key": this.key } })).json()).id, source: body };
    return this.draft;
  }

  async send() {
    const job = await this.makeDraft();
    rememberUpload(job.id);
    this.say("Sending the files ...");
    await sendFiles({ job: job.id, files: this.wanted(), fileOf: (name) => this.fileOf(name), known: this.sent, bar: this.bar, gone: (name) => this.gone(name) });
    if (this.accepted !== this.source) {
      this.say("Looking into the files ...");
      const judged = await sendJson("POST", `/v1/jobs/${job.id}/check`);
      if (!judged.valid) throw new Problem(422, { detail: judged.errors[0]?.detail, field: judged.errors[0]?.field, errors: judged.errors });
      if (judged.warnings.length) { this.warn(judged.warnings); return; }
    }
    await sendJson("POST", `/v1/jobs/${job.id}/start`);
    forgetUpload();
    this.draft = null; // submitting the same document again makes another job
    this.key = newKey();
    this.sent = new Map();
    location.hash = job.id;
  }

  gone(name) {
    this.before.files.get(name).sha256 = null;
    this.show();
    throw new Error(`${name} of the copied job is not on the server any more; drop it here.`);
  }

  // The files can be used, but look as if something were wrong: the job starts when the button is pressed again.
  warn(list) {
    this.accepted = this.source;
    this.say([list.length === 1 ? "The files can be used, but:" : `The files can be used, but there are ${list.length} warnings:`, ...list.map((w) => w.detail)].join("\n"), "note");
  }

  async refused(error) {
    const faults = error.body?.errors ?? [];
    if (error.status === 404) this.draft = null; // deleted elsewhere: the next press makes another one
    if (error.name === "AbortError") this.say("Cancelled. The job stays a draft with the files that have arrived; Submit goes on.");
    else if (faults.length > 1) this.say([`The input has ${faults.length} faults:`, ...faults.map((f) => (f.field ? `${f.field}: ${f.detail}` : f.detail))].join("\n"), "note bad");
    else this.say(error.message, "note bad");
    if (faults.length > 1) for (const f of faults) if (f.field) await this.editor.mark(f.field, f.detail);
    if (faults.length <= 1 && error.body?.field) this.editor.mark(error.body.field, error.message);
  }
}

export const submitPanel = (handed = null, copy = null) => new SubmitPanel(handed, copy).node;
