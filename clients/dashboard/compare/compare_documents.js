// Differences between the job documents of several jobs, between the bytes of their inputs, and between programs.
import { el } from "../page_parts.js";
import { sideBySide } from "./compare_tables.js";

const SHOWN = 40, LONG = 120;
const isObject = (x) => typeof x === "object" && x !== null && !Array.isArray(x);

// The name of a list's element: its file where each has one of its own, so that a photograph more or less does not
// shift the others; otherwise its place.
function elementNames(list) {
  const files = list.map((x) => (isObject(x) && typeof x.file === "string" ? x.file : null));
  return files.every((f) => f !== null) && new Set(files).size === files.length ? files : list.map((_, i) => String(i));
}

// A whole number above 2^53, which reading has rounded.
const isRounded = (x) => Number.isInteger(x) && !Number.isSafeInteger(x);

// Fills `out` with path -> value as JSON, for every value of the document; a list of plain values is one value.
export function flatten(value, path = "", out = new Map()) {
  if (isObject(value) && Object.keys(value).length) for (const [key, inner] of Object.entries(value)) flatten(inner, path ? `${path}.${key}` : key, out);
  else if (Array.isArray(value) && value.some(isObject)) {
    const names = elementNames(value);
    value.forEach((inner, i) => flatten(inner, `${path}[${names[i]}]`, out));
  } else out.set(path, isRounded(value) ? `about ${value}` : JSON.stringify(value));
  return out;
}

function settingsOf({ job }, withInputs) {
  const all = flatten(job.document ?? {});
  for (const f of (withInputs && job.files) || []) if (f.sha256) all.set(`SHA-256 of ${f.name}`, f.sha256);
  if (job.result?.program) all.set("program", job.result.program);
  return all;
}

// Returns [[path, [text or undefined of each document]]] of the values that are not the same everywhere.
export function differences(maps) {
  const paths = [...new Set(maps.flatMap((m) => [...m.keys()]))];
  return paths.map((path) => [path, maps.map((m) => m.get(path))]).filter(([, values]) => values.some((v) => v !== values[0]));
}

function valueCell(text) {
  if (text === undefined) return el("span", { class: "hint" }, "not set");
  const short = /^[0-9a-f]{64}$/.test(text) ? `${text.slice(0, 12)}…` : text.length > LONG ? `${text.slice(0, LONG)}…` : text;
  return el("span", { class: "mono value", title: short === text ? "" : text }, short);
}

export function documentTable(columns) {
  const rows = differences(columns.map((c) => settingsOf(c, columns.every(({ job }) => job.files)))).map(([path, values]) => [el("span", { class: "mono value" }, path), values.map(valueCell)]);
  if (rows.length === 0) return [el("p", { class: "hint" }, "Nothing: the documents, the bytes of the inputs and the programs are the same.")];
  const parts = [el("p", { class: "hint" }, "From the job documents; “not set” means that the default holds. Photographs are compared by their files."), sideBySide("settings that differ", columns, rows.slice(0, SHOWN))];
  if (rows.length > SHOWN) parts.push(el("details", {}, el("summary", {}, `${rows.length - SHOWN} more`), sideBySide("more settings that differ", columns, rows.slice(SHOWN))));
  return parts;
}
