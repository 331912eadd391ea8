// Uploads the files of a job by tus: they go on after a broken connection, can be cancelled, and show their speed.
import { duration, el, size } from "../page_parts.js";
import { getJson, raw, sendJson } from "../server_link.js";
import { sha256 } from "./live_check.js";

const PIECE = 8 << 20, MAX_TRY = 6, SPEED_OVER_MS = 8000;

export async function pieceBytes() {
  const limit = (await getJson("/v1/about")).limits?.max_patch_bytes;
  return limit > 0 ? Math.min(PIECE, limit) : PIECE;
}

// progress(n) is called with the bytes that the server has. signal: of an AbortController, or null.
export async function upload(file, url, piece, progress, signal = null) {
  const tus = { "Tus-Resumable": "1.0.0" };
  let offset = null, tries = 0;
  while (offset === null || offset < file.size) {
    try {
      if (offset === null) offset = Number((await raw("HEAD", url, { header: tus, signal })).headers.get("Upload-Offset"));
      else {
        const answer = await raw("PATCH", url, {
          body: file.slice(offset, offset + piece),
          header: { ...tus, "Upload-Offset": String(offset), "Content-Type": "application/offset+octet-stream" }, signal,
        });
        offset = Number(answer.headers.get("Upload-Offset"));
        tries = 0;
      }
      progress(offset);
    } catch (error) {
      if (signal?.aborted || (error.status && error.status !== 409 && error.status !== 503)) throw error;
      if (++tries > MAX_TRY) throw error;
      offset = null;
      await new Promise((wake) => setTimeout(wake, 500 * 2 ** tries));
    }
  }
}

export function removeFile(job, name) {
  return raw("DELETE", `/v1/jobs/${job}/files/${encodeURIComponent(name)}`).catch((error) => { if (error.status !== 404) throw error; });
}

// file: a dropped file, or {size, sha256} of an input of the copied job.
export async function declare(job, f, file) {
  const url = `/v1/jobs/${job}/files`, sum = file instanceof File ? await sha256(file) : file.sha256;
  const ask = { name: f.name, role: f.role, size: file.size, sha256: sum };
  try { return await sendJson("POST", url, ask); } catch (error) { if (error.body?.code !== "exists") throw error; }
  await removeFile(job, f.name); // the file has changed since an earlier try
  return sendJson("POST", url, ask);
}

// The bar of an upload: which file, bytes, speed and time left, and a button that cancels it. A page that is left meanwhile warns.
export class UploadBar {
  constructor() {
    this.bar = el("progress", { max: 1, value: 0, "aria-label": "bytes that have arrived" });
    this.words = el("span", { class: "number" });
    this.button = el("button", { type: "button", onclick: () => this.control?.abort() }, "Cancel");
    this.node = el("div", { id: "upload", class: "hidden" }, this.bar, this.words, this.button);
    this.warn = (event) => { event.preventDefault(); event.returnValue = ""; };
  }

  // total: bytes of all files
  begin(total) {
    this.total = total;
    this.done = 0; // of the files before this one
    this.marks = [];
    this.control = new AbortController();
    this.node.classList.remove("hidden");
    this.at("", 0);
    window.addEventListener("beforeunload", this.warn);
    return this.control.signal;
  }

  // n: bytes of this file that the server has
  at(name, n) {
    const now = performance.now(), bytes = this.done + n;
    this.marks = this.marks.filter((m) => now - m.ms < SPEED_OVER_MS && m.bytes <= bytes);
    const first = this.marks[0], speed = first && now - first.ms > 200 ? (bytes - first.bytes) / (now - first.ms) * 1000 : 0;
    this.marks.push({ ms: now, bytes });
    this.bar.value = this.total > 0 ? bytes / this.total : 0;
    this.words.textContent = [name, `${size(bytes)} of ${size(this.total)}`, speed > 0 ? `${size(speed)}/s` : null,
      speed > 0 ? `${duration((this.total - bytes) / speed)} left` : null].filter(Boolean).join(", ");
  }

  // A file that is on the server, whether it was sent or known: known bytes do not count as speed.
  next(bytes, wasSent) {
    this.done += bytes;
    if (!wasSent) this.marks = [];
  }

  end() {
    this.control = null;
    this.node.classList.add("hidden");
    window.removeEventListener("beforeunload", this.warn);
  }
}

// Sends the files of a job. fileOf(name): a File, or {size, sha256} of an input on the server. known: Map of name -> mark of the files that were sent
// before. gone(name) is called for an input that is not on the server any more; then this throws.
export async function sendFiles({ job, files, fileOf, known, bar, gone }) {
  const signal = bar.begin(files.reduce((sum, f) => sum + fileOf(f.name).size, 0));
  try {
    const piece = await pieceBytes();
    for (const [i, f] of files.entries()) {
      const file = fileOf(f.name), mark = `${job} ${file.size} ${file.lastModified}`, label = `${i + 1} of ${files.length}: ${f.name}`;
      bar.at(label, 0);
      // a different file of the same name: its bytes must not continue the first file
      if (known.has(f.name) && known.get(f.name) !== mark) await removeFile(job, f.name);
      known.set(f.name, mark);
      const state = await declare(job, f, file);
      signal.throwIfAborted();
      if (state.state !== "complete" && !(file instanceof File)) gone(f.name); // deleted meanwhile, or of another owner
      if (state.state !== "complete") await upload(file, state.upload_url, piece, (n) => bar.at(label, n), signal);
      bar.next(file.size, state.state !== "complete");
    }
  } finally { bar.end(); }
}
