// Shows the end of a job's log: starts 64 KiB before its end, keeps at most MAX_LINE lines, and follows it while the
// reader is at the bottom. Earlier parts are read on request, a piece at a time.
import { el, size } from "../page_parts.js";
import { raw } from "../server_link.js";

const MAX_LINE = 1000, START_BYTES = 65536, PIECE = 262144, MAX_PIECE_A_ROUND = 4;

export class LogTail {
  constructor(node) {
    this.node = node;
    this.reset();
  }

  reset() {
    this.lines = [];
    this.rest = "";
    this.offset = null;
    this.node.textContent = "";
  }

  async update(id) {
    for (let i = 0; i < MAX_PIECE_A_ROUND; i++) {
      const answer = await raw("GET", `/v1/jobs/${id}/log?offset=${this.offset ?? -START_BYTES}&max_bytes=${PIECE}`);
      const text = answer.status === 204 ? "" : await answer.text();
      const next = Number(answer.headers.get("Selvedge-Next-Offset")), all = Number(answer.headers.get("Selvedge-Log-Size"));
      if (this.offset !== null && next < this.offset) this.reset(); // the log was started again
      const first = this.offset === null;
      this.offset = next;
      if (text === "") break;
      this.take(first && all > START_BYTES ? text.slice(text.indexOf("\n") + 1) : text);
      if (next >= all) break;
    }
  }

  take(text) {
    const parts = (this.rest + text).split("\n");
    this.rest = parts.pop();
    this.lines.push(...parts);
    if (this.lines.length > MAX_LINE) this.lines.splice(0, this.lines.length - MAX_LINE);
    const follow = this.node.scrollHeight - this.node.scrollTop - this.node.clientHeight < 30;
    this.node.textContent = this.lines.join("\n");
    if (follow) this.node.scrollTop = this.node.scrollHeight;
  }
}

const PAGE = 262144;

// The whole log, a piece of 256 KiB at a time, with its first and its last piece within reach.
export class WholeLog {
  constructor(id) {
    this.url = `/v1/jobs/${id}/log`;
    this.text = el("pre", { class: "log", tabIndex: 0, role: "region", "aria-label": "a part of the log" });
    this.place = el("span", { class: "hint", role: "status" });
    const button = (text, act) => el("button", { type: "button", onclick: act }, text);
    this.first = button("First", () => this.show(0));
    this.back = button("Earlier", () => this.show(Math.max(0, this.from - PAGE)));
    this.forth = button("Later", () => this.show(this.to));
    this.last = button("Last", () => this.show(-PAGE));
    this.node = el("div", { class: "whole-log" }, el("div", { class: "pages" }, this.first, this.back, this.forth, this.last, this.place,
      button("Save the whole log", () => this.save())), this.text);
    this.from = this.to = 0;
  }

  async piece(offset, most) {
    const answer = await raw("GET", `${this.url}?offset=${offset}&max_bytes=${most}`);
    const bytes = await answer.arrayBuffer(), next = Number(answer.headers.get("Selvedge-Next-Offset"));
    return { bytes, from: next - bytes.byteLength, to: next, all: Number(answer.headers.get("Selvedge-Log-Size")) };
  }

  async show(offset) {
    try {
      const { bytes, from, to, all } = await this.piece(offset, PAGE);
      this.from = from;
      this.to = to;
      this.text.textContent = new TextDecoder().decode(bytes);
      this.text.scrollTop = 0;
      this.place.textContent = `bytes ${from} to ${to} of ${all} (${size(all)})`;
      this.first.disabled = this.back.disabled = from <= 0;
      this.forth.disabled = this.last.disabled = to >= all;
    } catch (error) { this.place.textContent = error.message; }
  }

  // By ranges, because one answer has a megabyte at most.
  async save() {
    const parts = [];
    try {
      for (let at = 0, all = 1; at < all;) {
        const got = await this.piece(at, 1 << 20);
        if (got.bytes.byteLength === 0) break;
        parts.push(got.bytes);
        at = got.to;
        all = got.all;
        this.place.textContent = `${size(at)} of ${size(all)}`;
      }
      const address = URL.createObjectURL(new Blob(parts, { type: "text/plain" }));
      el("a", { href: address, download: "log.txt" }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60000);
    } catch (error) { this.place.textContent = error.message; }
  }
}
