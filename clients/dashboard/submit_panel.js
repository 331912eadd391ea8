// Drag and drop of a job document (*.json) and the files that it names. Files are uploaded by tus; uploads continue
// after a broken connection.
import { copiedJob } from "./copied_job.js";
import { documentEditor, holdsLargeNumber } from "./document_editor.js";
import { droppedFiles } from "./dropped_files.js";
import { el, size } from "./page_parts.js";
import { getJson, raw, sendJson } from "./server_link.js";
import { LiveCheck, sha256 } from "./submit/live_check.js";
import { RigPicker, rigOf } from "./submit/rig_picker.js";

const PIECE = 8 << 20, MAX_TRY = 6;

function filesOf(doc) {
  const list = [];
  const add = (name, role) => { if (typeof name === "string" && !list.some((f) => f.name === name)) list.push({ name, role }); };
  for (const name of doc.volume?.files ?? []) add(name, "volume");
  add(doc.fibers?.file, "fibers");
  add(doc.cloth?.draft_file, "draft");
  add(doc.cloth?.texture, "photograph");
  add(doc.environment?.file, "environment");
  add(doc.measurements?.file, "measurements");
  add(doc.rig?.file, "rig");
  add(doc.profile?.file, "profile");
  add(doc.camera?.noise_file, "camera_noise");
  for (const name of doc.camera?.dark_frames ?? []) add(name, "dark_frame");
  add(doc.color?.chart?.file, "chart");
  add(doc.color?.chart?.reference, "measurements");
  add(doc.color?.white?.file, "white_reference");
  for (const p of doc.photographs ?? []) for (const q of [p, ...(p?.more_exposures ?? [])]) add(q?.file, "photograph");
  add(doc.profile?.bowl?.mask, "photograph");
  for (const p of doc.profile?.bowl?.photographs ?? []) {
    for (const q of [p, ...(p?.more_exposures ?? [])]) add(q?.file, "photograph");
    add(p?.background, "photograph");
  }
  for (const p of doc.pictures ?? []) add(p?.mesh_file, "mesh");
  return list;
}

async function pieceBytes() {
  const limit = (await getJson("/v1/about")).limits?.max_patch_bytes;
  return limit > 0 ? Math.min(PIECE, limit) : PIECE;
}

async function upload(file, url, piece, progress) {
  const tus = { "Tus-Resumable": "1.0.0" };
  let offset = null, tries = 0;
  while (offset === null || offset < file.size) {
    try {
      if (offset === null) offset = Number((await raw("HEAD", url, { header: tus })).headers.get("Upload-Offset"));
      else {
        const answer = await raw("PATCH", url, {
          body: file.slice(offset, offset + piece),
          header: { ...tus, "Upload-Offset": String(offset), "Content-Type": "application/offset+octet-stream" },
        });
        offset = Number(answer.headers.get("Upload-Offset"));
        tries = 0;
      }
      progress(offset);
    } catch (error) {
      if (error.status && error.status !== 409 && error.status !== 503) throw error;
      if (++tries > MAX_TRY) throw error;
      offset = null;
      await new Promise((wake) => setTimeout(wake, 500 * 2 ** tries));
    }
  }
}

const newKey = () => [...crypto.getRandomValues(new Uint8Array(16))].map((b) => b.toString(16).padStart(2, "0")).join("");

function removeFile(job, name) {
  return raw("DELETE", `/v1/jobs/${job}/files/${encodeURIComponent(name)}`).catch((error) => { if (error.status !== 404) throw error; });
}

// file: a dropped file, or {size, sha256} of an input of the copied job.
async function declare(job, f, file) {
  const url = `/v1/jobs/${job}/files`, sum = file instanceof File ? await sha256(file) : file.sha256;
  const ask = { name: f.name, role: f.role, size: file.size, sha256: sum };
  try { return await sendJson("POST", url, ask); } catch (error) { if (error.body?.code !== "exists") throw error; }
  await removeFile(job, f.name); // the file has changed since an earlier try
  return sendJson("POST", url, ask);
}

// handed: files that were dropped on another page. copy: the id of a job whose document is the beginning.
export function submitPanel(handed = [], copy = null) {
  const dropped = new Map();
  let doc = null, source = null, busy = false, before = null;
  // kept while the document is the same, so that another try continues an interrupted submit
  let key = null, sent = new Map();
  const list = el("ul", { tabIndex: 0, "aria-label": "files of the job" }), message = el("p", { class: "hint" }), go = el("button", { class: "main", disabled: true }, "Submit");
  const say = (text, bad) => { message.textContent = text; message.className = bad ? "note bad" : "hint"; };
  const wanted = () => (doc ? filesOf(doc) : []);
  // the file itself, or the input of the copied job, whose bytes are on the server
  const fileOf = (name) => dropped.get(name) ?? (before?.files.get(name)?.sha256 ? before.files.get(name) : undefined);
  const faultOf = (name) => (dropped.has(name) ? check.fault(dropped.get(name)) : null);
  const allow = () => { go.disabled = busy || doc === null || wanted().some((f) => !fileOf(f.name) || faultOf(f.name)); };
  // The entry of a file in the copied job.
  const otherSize = (name) => {
    const known = before?.files.get(name)?.size, now = dropped.get(name)?.size;
    if (known === undefined || now === known) return null;
    if (now === undefined && fileOf(name)) return el("span", { class: "hint" }, `${size(known)} in the copied job, on the server already: it is not sent again`);
    return now === undefined ? el("span", { class: "hint" }, `${size(known)} in the copied job`) : el("span", { class: "tag warn" }, `another file: ${size(known)} in the copied job`);
  };
  const stateOf = (name) => {
    const file = dropped.get(name);
    if (!file) return fileOf(name) ? null : el("span", { class: "tag warn" }, "still missing");
    if (faultOf(name)) return el("span", { class: "tag bad" }, faultOf(name));
    return el("span", {}, size(file.size), check.isKnown(file) ? el("span", { class: "hint" }, ", on the server already: it is not sent again") : null);
  };
  const show = () => {
    const missing = wanted().filter((f) => !fileOf(f.name)), faulty = wanted().filter((f) => faultOf(f.name)), names = new Set(wanted().map((f) => f.name));
    const unused = [...dropped.keys()].filter((name) => !names.has(name) && !name.endsWith(".json"));
    list.replaceChildren(...wanted().map((f) => el("li", {}, el("span", { class: "mono" }, f.name),
      el("span", {}, otherSize(f.name), " ", stateOf(f.name)))),
      ...(doc && unused.length ? [el("li", { class: "hint" }, `Not named by the document, so not sent: ${unused.slice(0, 6).join(", ")}${unused.length > 6 ? ` and ${unused.length - 6} more` : ""}`)] : []));
    rig.show(doc, doc && holdsLargeNumber(doc) ? "Views cannot be chosen here: the document holds a whole number above 2^53." : null);
    allow();
    if (busy) return;
    if (doc && missing.length) say(`${missing.length} of ${wanted().length} files are still missing; drop them here.`);
    else if (doc && faulty.length) say(`${faulty[0].name} ${faultOf(faulty[0].name)}.`, true);
    else if (doc) say("Ready.");
  };
  const use = (now) => {
    if (now !== source) { key = newKey(); sent = new Map(); }
    source = now;
    doc = null; // when it is no JSON
    doc = JSON.parse(source);
    check.document(source);
  };
  const editor = documentEditor((now) => { use(now); show(); });
  const check = new LiveCheck(editor, () => show());
  const rig = new RigPicker((now) => {
    const text = JSON.stringify(now, null, 2);
    use(text);
    editor.show(text);
    show();
  });
  const take = async (files) => {
    for (const file of files) {
      dropped.set(file.name, file);
      if (!file.name.endsWith(".json")) check.file(file);
      if (!file.name.endsWith(".json")) continue;
      const now = await file.text(), described = rigOf(now);
      if (described) { rig.use(file.name, described); check.file(file); continue; }
      try { use(now); } catch (error) { say(`${file.name}: ${error.message}`, true); return; } finally { editor.show(now); }
    }
    if (!doc) say("Drop the job document (.json) as well.");
    show();
  };
  const input = el("input", { type: "file", multiple: true, onchange: () => take(input.files) });
  const folder = el("input", { type: "file", webkitdirectory: true, onchange: () => take([...folder.files].filter((f) => !f.name.startsWith("."))) });
  const drop = el("div", { class: "drop" }, "Drop a job document (.json) and its files here, or a folder; or choose ", el("label", { class: "file" }, "files", input), " or ",
    el("label", { class: "file" }, "a folder", folder), list, check.node, message, go);
  const from = el("p", { class: "hint" });
  const begin = async () => {
    try {
      before = await copiedJob(copy);
      const safe = editor.load(before.source);
      use(safe);
      if (doc.rig?.file && before.files.has(doc.rig.file)) {
        const described = await raw("GET", `/v1/jobs/${before.id}/files/${encodeURIComponent(doc.rig.file)}`).then((answer) => answer.text()).then(rigOf).catch(() => null); // not complete
        if (described) rig.use(doc.rig.file, described);
      }
      from.append("A copy of ", el("a", { href: `#${before.id}` }, before.sample || "(no name)"), ". Change the document below, then submit it: the earlier job stays as it is.");
      show();
    } catch (error) { say(error.status === 404 ? `The job to copy is not there: ${error.message}` : error.message, true); }
  };
  if (copy !== null) begin();
  if (handed.length) take(handed);
  drop.addEventListener("dragover", (e) => { e.preventDefault(); drop.classList.add("over"); });
  drop.addEventListener("dragleave", () => drop.classList.remove("over"));
  drop.addEventListener("drop", (e) => { e.preventDefault(); drop.classList.remove("over"); droppedFiles(e.dataTransfer).then(take); });
  go.addEventListener("click", async () => {
    busy = true;
    allow();
    const files = wanted(), known = sent;
    try {
      // sent as it was written, because JSON.parse does not keep numbers above 2^53
      const job = await (await raw("POST", "/v1/jobs", { body: source, header: { "Content-Type": "application/json", "Idempotency-Key": key } })).json();
      const piece = await pieceBytes();
      for (const [i, f] of files.entries()) {
        const file = fileOf(f.name), mark = `${job.id} ${file.size} ${file.lastModified}`;
        const label = (n) => say(`${i + 1} of ${files.length}: ${f.name}, ${size(n)} of ${size(file.size)}`);
        label(0);
        // a different file of the same name: its bytes must not continue the first file
        if (known.has(f.name) && known.get(f.name) !== mark) await removeFile(job.id, f.name);
        known.set(f.name, mark);
        const state = await declare(job.id, f, file);
        if (state.state !== "complete" && !(file instanceof File)) {
          before.files.get(f.name).sha256 = null; // deleted meanwhile, or of another owner
          show();
          throw new Error(`${f.name} of the copied job is not on the server any more; drop it here.`);
        }
        if (state.state !== "complete") await upload(file, state.upload_url, piece, label);
      }
      say("Looking into the files ...");
      await sendJson("POST", `/v1/jobs/${job.id}/start?check=1`);
      key = newKey(); // submitting the same document again makes another job
      sent = new Map();
      location.hash = job.id;
    } catch (error) {
      const faults = error.body?.errors ?? [];
      say(faults.length > 1 ? [`The input has ${faults.length} faults:`, ...faults.map((f) => (f.field ? `${f.field}: ${f.detail}` : f.detail))].join("\n") : error.message, true);
      if (faults.length > 1) for (const f of faults) if (f.field) await editor.mark(f.field, f.detail);
      if (faults.length <= 1 && error.body?.field) editor.mark(error.body.field, error.message);
    }
    busy = false;
    allow();
  });
  return el("section", { class: "card", id: "submit" }, el("h2", {}, copy === null ? "New job" : "New job, from another one"), from, drop, rig.node, editor.node);
}

export { declare, filesOf, pieceBytes, removeFile, upload };
