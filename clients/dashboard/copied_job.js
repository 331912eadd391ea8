// The document of an existing job, as the beginning of a new one.
import { Problem, raw } from "./server_link.js";

// The text of a member of the outermost object of valid JSON, as it is written there; null without it. JSON.parse would
// round whole numbers above 2^53.
export function memberText(text, name) {
  let depth = 0, key = null, start = -1, last = "";
  for (let i = 0; i < text.length; i++) {
    const c = text[i];
    if (c === '"') {
      const from = i;
      for (i++; text[i] !== '"'; i++) if (text[i] === "\\") i++;
      last = text.slice(from, i + 1);
    } else if (c === "{" || c === "[") depth++;
    else if (depth === 1 && c === ":" && start < 0) {
      key = JSON.parse(last);
      if (key === name) start = i + 1;
    } else if (depth === 1 && start >= 0 && (c === "," || c === "}")) return text.slice(start, i).trim();
    else if (c === "}" || c === "]") depth--;
  }
  return null;
}

// Returns {id, sample, state, source, files}: source, the document as text; files, a Map of name -> {size, sha256, offset} of the inputs; sha256 is
// null if the bytes have not arrived, of which there are `offset`.
export async function copiedJob(id) {
  if (!/^[A-Za-z0-9_-]{1,80}$/.test(id)) throw new Problem(404, { detail: "The address names no job to copy." });
  const text = await (await raw("GET", `/v1/jobs/${id}`)).text(), job = JSON.parse(text);
  return { id, sample: job.sample, state: job.state, source: memberText(text, "document"), files: new Map((job.files ?? []).map((f) => [f.name, { size: f.size, sha256: f.state === "complete" ? f.sha256 : null, offset: f.offset }])) };
}
