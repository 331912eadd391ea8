// Faults of a document and its files, and the files that the server has already: found while they are put
// together, before anything is sent.
import { el, size } from "../page_parts.js";
import { getJson, raw } from "../server_link.js";

const PAUSE_MS = 300, MAX_HASHED = 512 << 20;

// The browser's digest needs the whole file in memory, so larger files are sent without a checksum. One at a time.
const sums = new WeakMap();
let last = Promise.resolve();
export function sha256(file) {
  if (!globalThis.crypto?.subtle || file.size > MAX_HASHED) return Promise.resolve(null);
  if (!sums.has(file)) {
    const sum = last.then(async () => {
      const digest = await crypto.subtle.digest("SHA-256", await file.arrayBuffer());
      return [...new Uint8Array(digest)].map((b) => b.toString(16).padStart(2, "0")).join("");
    });
    last = sum.then(() => {}, () => {});
    sums.set(file, sum);
  }
  return sums.get(file);
}

// Why a file cannot be uploaded under the limits of /v1/about; null if it can.
export function fileFault(file, limits) {
  if (file.size === 0) return "is empty";
  if (limits?.max_file_bytes && file.size > limits.max_file_bytes) return `has ${size(file.size)}, and this server takes ${size(limits.max_file_bytes)}`;
  return null;
}

// Judges a document by the server's own check a moment after it was last changed, and files as they are added. changed()
// is called when something new is known.
export class LiveCheck {
  constructor(editor, changed) {
    this.node = el("div", { id: "faults", role: "status" });
    this.limits = null;
    this.known = new WeakMap(); // file -> true, false, or undefined while it is not known
    this.editor = editor;
    this.changed = changed;
    this.timer = null;
    this.turn = 0;
    getJson("/v1/about").then((about) => { this.limits = about.limits; changed(); }).catch(() => {});
  }

  document(source) {
    clearTimeout(this.timer);
    const turn = ++this.turn;
    this.timer = setTimeout(async () => {
      let faults;
      try { // sent as it was written, because JSON.parse does not keep numbers above 2^53
        const answer = await raw("POST", "/v1/check", { body: source, header: { "Content-Type": "application/json" } });
        faults = (await answer.json()).errors;
      } catch (error) { faults = error.status ? [{ field: "", detail: error.message }] : []; }
      if (turn === this.turn) this.show(faults);
    }, PAUSE_MS);
  }

  // Takes the faults away while the document is not complete.
  clear() {
    clearTimeout(this.timer);
    this.turn++;
    if (this.node.childElementCount) this.show([]);
  }

  show(faults) {
    const line = ({ field, detail }) => el("li", {}, field && !detail.includes(field) ? `${field}: ${detail}` : detail);
    this.node.replaceChildren(...(faults.length ? [el("p", { class: "note bad" }, faults.length === 1 ? "The job document has a fault:" : `The job document has ${faults.length} faults:`), el("ul", {}, faults.map(line))] : []));
    this.editor.faults(faults);
  }

  fault(file) { return fileFault(file, this.limits); }

  // Asks once whether the server has the bytes of a file.
  async file(file) {
    if (this.known.has(file)) return;
    this.known.set(file, undefined);
    try {
      const sum = await sha256(file);
      const { known } = sum === null || file.size === 0 ? { known: false } : await getJson(`/v1/inputs?sha256=${sum}`);
      this.known.set(file, known);
    } catch { this.known.set(file, false); } // it will be sent
    this.changed();
  }

  isKnown(file) { return this.known.get(file) === true; }
}
