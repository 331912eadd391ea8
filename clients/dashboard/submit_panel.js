// The page of a new job. Files or a folder are dropped; the job document is written from them, from the answers to a few questions and from the
// angles, unless a job document (*.json) is among them or a job is copied: then that document holds, and names the files.
import { copiedJob } from "./copied_job.js";
import { documentEditor, holdsLargeNumber } from "./document_editor.js";
import { droppedFiles } from "./dropped_files.js";
import { el, size } from "./page_parts.js";
import { Problem, raw, sendJson } from "./server_link.js";
import { AngleGrid, unplaced } from "./submit/angle_grid.js";
import { exampleOffer } from "./submit/example_job.js";
import { fileLines } from "./submit/file_list.js";
import { guessedKinds, kindOfJson } from "./submit/guessed_kinds.js";
import { forgetUpload, offerUpload, rememberUpload } from "./submit/interrupted_upload.js";
import { filesOf } from "./submit/job_files.js";
import { LiveCheck } from "./submit/live_check.js";
import { missingParts, PresetCards, presetOf } from "./submit/presets.js";
import { Questions } from "./submit/questions.js";
import { RigPicker, rigOf } from "./submit/rig_picker.js";
import { tableHead, withAllRotations } from "./submit/table_head.js";
import { thumbnail } from "./submit/thumbnails.js";
import { sendFiles, UploadBar } from "./submit/uploads.js";
import { statesVoxelSize } from "./submit/voxel_statement.js";
import { writeFiles } from "./submit/written_document.js";
import { stemOf } from "./submit/name_angles.js";

const newKey = () => [...crypto.getRandomValues(new Uint8Array(16))].map((b) => b.toString(16).padStart(2, "0")).join("");

// handed: {files, folder} that were dropped on another page, or null. copy: the id of a job whose document is the beginning.
export function submitPanel(handed = null, copy = null) {
  const dropped = new Map(), json = new Map(), chosen = new Map();
  let kinds = new Map(), doc = null, source = null, busy = false, before = null, resumed = null;
  let written = copy === null; // by this page, from the files; otherwise the document was dropped or is a copy
  let preset = null, picked = null, statesVoxel = true, table = null, notes = [], open = [];
  // kept while the document is the same, so that another try continues an interrupted submit
  let key = null, sent = new Map();
  let accepted = null; // the document whose warnings were shown
  const list = el("ul", { id: "new-files", tabIndex: 0, "aria-label": "files of the job" }), message = el("p", { class: "hint", id: "send-state", role: "status" });
  const go = el("button", { class: "main", id: "send", disabled: true }, "Submit"), bar = new UploadBar(), interrupted = el("div"), remarks = el("div", { id: "file-notes" });
  const say = (text, bad) => { message.textContent = text; message.className = bad ? "note bad" : "hint"; };
  const wanted = () => (doc ? filesOf(doc) : []);
  // the file itself, or the input of the copied job, whose bytes are on the server
  const fileOf = (name) => dropped.get(name) ?? (before?.files.get(name)?.sha256 ? before.files.get(name) : undefined);
  const faultOf = (name) => (dropped.has(name) ? check.fault(dropped.get(name)) : null);
  const allow = () => { go.disabled = busy || doc === null || (written && open.length > 0) || wanted().some((f) => !fileOf(f.name) || faultOf(f.name)); };
  // The entry of a file in the copied job.
  const otherSize = (name) => {
    const known = before?.files.get(name)?.size, now = dropped.get(name)?.size, where = resumed ? "" : " in the copied job", offset = before?.files.get(name)?.offset;
    if (known === undefined || now === known) return null;
    if (now === undefined && fileOf(name)) return el("span", { class: "hint" }, `${size(known)}${where}, on the server already: it is not sent again`);
    if (now === undefined) return el("span", { class: "hint" }, resumed ? `${size(offset ?? 0)} of ${size(known)} have arrived` : `${size(known)}${where}`);
    return el("span", { class: "tag warn" }, `another file: ${size(known)}${where || " before"}`);
  };
  const stateOf = (name) => {
    const file = dropped.get(name);
    if (!file) return fileOf(name) ? null : el("span", { class: "tag warn" }, "still missing");
    if (faultOf(name)) return el("span", { class: "tag bad" }, faultOf(name));
    return check.isKnown(file) ? el("span", { class: "hint" }, "on the server already: it is not sent again") : null;
  };
  const named = (f) => el("li", { "data-file": f.name }, dropped.has(f.name) ? thumbnail(dropped.get(f.name), () => show()) : el("span", { class: "thumbnail", "aria-hidden": "true" }, el("span", { class: "sign" }, "?")),
    el("span", { class: "name" }, el("span", { class: "mono" }, f.name), dropped.has(f.name) ? el("span", { class: "size" }, size(dropped.get(f.name).size)) : null), el("span", { class: "said" }, otherSize(f.name), " ", stateOf(f.name)));
  const lines = () => {
    const names = new Set(wanted().map((f) => f.name));
    if (!written) {
      const unused = [...dropped.keys()].filter((name) => !names.has(name) && !name.endsWith(".json"));
      return [...wanted().map(named), ...(doc && unused.length ? [el("li", { class: "hint" }, `Not named by the document, so not sent: ${unused.slice(0, 6).join(", ")}${unused.length > 6 ? ` and ${unused.length - 6} more` : ""}`)] : [])];
    }
    return [...fileLines({ files: dropped, kinds, stateOf, choose: (of, kind) => { for (const name of of) chosen.set(name, kind); sync(); }, changed: () => show() }),
      ...wanted().filter((f) => !dropped.has(f.name)).map(named)];
  };
  const tableNotes = () => {
    const [name] = [...kinds].find(([, kind]) => kind === "table") ?? [], head = name && doc?.measurements?.file === name ? table : null;
    if (!head) return [];
    return [head.exchanged ? el("p", { class: "note" }, `${name}: ${head.exchanged}`) : null, head.turned ? null : el("div", { class: "note", id: "no-rotation" },
      el("p", {}, `${name} does not say how the cloth was turned, and its lamps all stand on one side: its rows count as measured with the warp along 90°. Is it a material that looks the same from all sides, or a mean over all turns?`),
      el("button", { type: "button", onclick: async () => { await take([await withAllRotations(dropped.get(name), head.by)]); } }, "They are means over all turns"))];
  };
  const show = () => {
    const missing = wanted().filter((f) => !fileOf(f.name)), faulty = wanted().filter((f) => faultOf(f.name)), focused = document.activeElement?.getAttribute("aria-label");
    const locked = doc && holdsLargeNumber(doc) ? "Views cannot be chosen here: the document holds a whole number above 2^53." : null;
    list.replaceChildren(...lines());
    const again = focused && [...list.querySelectorAll("select")].find((s) => s.getAttribute("aria-label") === focused);
    if (again instanceof HTMLElement) again.focus();
    preset = picked ?? presetOf(kinds);
    presets.show(doc ?? {}, preset);
    questions.node.classList.toggle("hidden", !written || (dropped.size === 0 && picked === null));
    presets.node.classList.toggle("hidden", !written);
    example.classList.toggle("hidden", !written || dropped.size > 0 || source !== null);
    open = written ? questions.show(doc ?? {}, { preset, statesVoxel }) : [];
    if (written) open.push(...missingParts(doc ?? {}, preset));
    const angles = unplaced(doc).length;
    if (written && angles) open.push(`the angles of ${angles} photographs`);
    remarks.replaceChildren(...notes.map((text) => el("p", { class: "note" }, text)), ...tableNotes().filter(Boolean));
    rig.show(doc, locked);
    grid.show(locked ? null : doc, rig.rig !== null && (doc?.photographs ?? []).every((p) => p.view !== undefined));
    allow();
    if (busy || (accepted !== null && accepted === source)) return;
    if (written && open.length && doc) say(`Still to give: ${open.join("; ")}.`);
    else if (doc && missing.length) say(`${missing.length} of ${wanted().length} files are still missing; drop them here.`);
    else if (doc && faulty.length) say(`${faulty[0].name} ${faultOf(faulty[0].name)}.`, true);
    else if (doc) say("Ready.");
  };
  const use = (now) => {
    if (now !== source) { key = newKey(); sent = new Map(); accepted = null; go.textContent = "Submit"; }
    source = now;
    doc = null; // when it is no JSON
    doc = JSON.parse(source);
  };
  const checked = () => { if (!written || open.length === 0) check.document(source); else check.clear(); };
  const editor = documentEditor((now) => { use(now); show(); checked(); });
  const check = new LiveCheck(editor, () => show());
  const change = (now) => {
    const text = JSON.stringify(now, null, 2);
    if (text !== source) { use(text); editor.show(text); }
    show();
    checked();
  };
  const rig = new RigPicker(change), grid = new AngleGrid(change), questions = new Questions(change);
  const presets = new PresetCards((id) => { picked = id; change(doc ?? {}); }), example = exampleOffer();
  // Brings a written document in step with the files.
  const sync = (folderName = "") => {
    const now = doc ?? {}, names = [...dropped.keys()];
    kinds = guessedKinds(names, json, rig.rig, grid.pattern, chosen);
    notes = writeFiles(now, kinds, grid.patternOf(names.filter((n) => kinds.get(n) === "photograph")), rig.rig);
    if (now.volume && now.cloth && Object.keys(now.cloth).every((k) => ["weave", "warp_per_cm", "weft_per_cm"].includes(k))) delete now.cloth;
    const scan = [...kinds].find(([, kind]) => kind === "scan" || kind === "slice")?.[0], rows = [...kinds].find(([, kind]) => kind === "table")?.[0];
    const named = folderName || stemOf(scan ?? now.fibers?.file ?? now.cloth?.draft_file ?? rows ?? "");
    if (now.sample === undefined && named) now.sample = named;
    statesVoxel = true;
    table = null;
    if (scan) statesVoxelSize(dropped.get(scan)).then((states) => { if (states !== statesVoxel) { statesVoxel = states; show(); } });
    if (rows) tableHead(dropped.get(rows)).then((head) => { table = head; show(); });
    change(now);
  };
  const take = async (files, folderName = "") => {
    let isOther = false;
    accepted = null;
    go.textContent = "Submit";
    for (const file of files) {
      dropped.set(file.name, file);
      if (!file.name.endsWith(".json")) { check.file(file); continue; }
      const now = await file.text(), described = rigOf(now), kind = kindOfJson(now);
      json.set(file.name, kind);
      if (described) rig.use(file.name, described);
      if (described || kind === "noise") check.file(file);
      if (kind !== "document" && (written || kind !== "unused")) continue;
      written = false;
      try { use(now); } catch (error) { say(`${file.name}: ${error.message}`, true); return; } finally { editor.show(now); }
      isOther = true;
    }
    if (written) {
      sync(folderName);
      return;
    }
    if (!doc) say("Drop the job document (.json) as well.");
    show();
    if (isOther) check.document(source);
  };
  const input = el("input", { type: "file", multiple: true, onchange: () => take(input.files) });
  const folder = el("input", { type: "file", webkitdirectory: true, onchange: () => take([...folder.files].filter((f) => !f.name.startsWith(".")), folder.files[0]?.webkitRelativePath.split("/")[0]) });
  const drop = el("div", { class: "drop" }, el("p", {}, "Drop the files of a sample here, or a folder: scan, photographs, table, draft, rig, or a job document (.json). Or choose ", el("label", { class: "file" }, "files", input), " or ",
    el("label", { class: "file" }, "a folder", folder), "."));
  const from = el("p", { class: "hint" });
  const useBefore = async (job) => {
    before = job;
    written = false;
    use(editor.load(before.source));
    check.document(source);
    if (doc.rig?.file && before.files.has(doc.rig.file)) {
      const described = await raw("GET", `/v1/jobs/${before.id}/files/${encodeURIComponent(doc.rig.file)}`).then((answer) => answer.text()).then(rigOf).catch(() => null); // not complete
      if (described) rig.use(doc.rig.file, described);
    }
    show();
  };
  const begin = async () => {
    try {
      await useBefore(await copiedJob(copy));
      from.append("A copy of ", el("a", { href: `#${before.id}` }, before.sample || "(no name)"), ". Change the document below, then submit it: the earlier job stays as it is.");
    } catch (error) { say(error.status === 404 ? `The job to copy is not there: ${error.message}` : error.message, true); }
  };
  const goOn = async (job) => {
    await useBefore(job);
    resumed = { id: job.id, source };
    from.append("Browsers do not keep files over a reload: drop the same files again. Each is recognised by its name, its size and its content, and goes on where it was.");
    show();
  };
  if (copy !== null) begin(); else offerUpload(interrupted, goOn);
  if (handed) take(handed.files, handed.folder);
  // The files can be used, but look as if something were wrong: the job starts when the button is pressed again.
  const warn = (list) => {
    accepted = source;
    go.textContent = "Start all the same";
    message.className = "note";
    message.textContent = [list.length === 1 ? "The files can be used, but:" : `The files can be used, but there are ${list.length} warnings:`, ...list.map((w) => w.detail)].join("\n");
  };
  const submit = async () => {
    busy = true;
    allow();
    const files = wanted();
    try {
      // sent as it was written, because JSON.parse does not keep numbers above 2^53
      const job = resumed && resumed.source === source ? resumed
        : await (await raw("POST", "/v1/jobs", { body: source, header: { "Content-Type": "application/json", "Idempotency-Key": key } })).json();
      rememberUpload(job.id);
      say("Sending the files ...");
      const gone = (name) => {
        before.files.get(name).sha256 = null;
        show();
        throw new Error(`${name} of the copied job is not on the server any more; drop it here.`);
      };
      await sendFiles({ job: job.id, files, fileOf, known: sent, bar, gone });
      say("Looking into the files ...");
      if (accepted !== source) {
        const judged = await sendJson("POST", `/v1/jobs/${job.id}/check`);
        if (!judged.valid) throw new Problem(422, { detail: judged.errors[0]?.detail, field: judged.errors[0]?.field, errors: judged.errors });
        if (judged.warnings.length) { warn(judged.warnings); return; }
      }
      await sendJson("POST", `/v1/jobs/${job.id}/start`);
      forgetUpload();
      key = newKey(); // submitting the same document again makes another job
      sent = new Map();
      location.hash = job.id;
    } catch (error) {
      const faults = error.body?.errors ?? [];
      if (error.name === "AbortError") say("Cancelled. The job stays a draft with the files that have arrived; Submit goes on.");
      else say(faults.length > 1 ? [`The input has ${faults.length} faults:`, ...faults.map((f) => (f.field ? `${f.field}: ${f.detail}` : f.detail))].join("\n") : error.message, true);
      if (faults.length > 1) for (const f of faults) if (f.field) await editor.mark(f.field, f.detail);
      if (faults.length <= 1 && error.body?.field) editor.mark(error.body.field, error.message);
    } finally {
      busy = false;
      allow();
    }
  };
  go.addEventListener("click", submit);
  const node = el("section", { id: "submit" }, el("div", { class: "card" }, el("h1", {}, copy === null ? "New job" : "New job, from another one"), from, interrupted, presets.node, drop, example, list, remarks, questions.node),
    rig.node, grid.node, el("div", { class: "card" }, editor.node), el("div", { class: "card send" }, check.node, message, bar.node, go));
  node.addEventListener("dragover", (e) => { e.preventDefault(); drop.classList.add("over"); });
  node.addEventListener("dragleave", () => drop.classList.remove("over"));
  node.addEventListener("drop", (e) => { e.preventDefault(); drop.classList.remove("over"); droppedFiles(e.dataTransfer).then(({ files, folder: name }) => take(files, name)); });
  show();
  return node;
}
