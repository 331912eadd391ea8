// Shows the end of a job's log: starts 64 KiB before its end, keeps at most MAX_LINE lines, and follows it while the
// reader is at the bottom.
import { raw } from "./server_link.js";

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
