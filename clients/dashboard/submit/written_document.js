// Keeps a job document in step with the files that were dropped: the document stays as it is but for the names of these files.
import { ANGLES, anglesOf, stemOf } from "./name_angles.js";
import { byName } from "./guessed_kinds.js";

// The document's key of each kind that is one file.
const PLACES = { table: ["measurements", "file"], fibers: ["fibers", "file"], draft: ["cloth", "draft_file"], rig: ["rig", "file"], noise: ["camera", "noise_file"],
  chart: ["color", "chart", "file"], white: ["color", "white", "file"] };
const FOR_PHOTOGRAPHS = new Set(["rig", "noise", "chart", "white", "dark"]);

export function valueAt(doc, keys) { return keys.reduce((value, key) => value?.[key], doc); }

// Sets a value; undefined removes it, and sections that are empty then.
export function setAt(doc, keys, value) {
  const [key, ...more] = keys;
  if (more.length === 0) { if (value === undefined) delete doc[key]; else doc[key] = value; return; }
  if (typeof doc[key] !== "object" || doc[key] === null) { if (value === undefined) return; doc[key] = {}; }
  setAt(doc[key], more, value);
  if (Object.keys(doc[key]).length === 0) delete doc[key];
}

// Sets the angles of a photograph: those that its name does not say are 0, straight above.
function setAngles(photograph, angles) {
  for (const [key] of ANGLES) if (key in angles || key !== "cloth_rotation_deg") photograph[key] = angles[key] ?? 0;
}

const sameView = (a, b) => a && b && ANGLES.every(([key]) => a[key] === b[key]);

function addPhotographs(doc, names, pattern, rig) {
  const list = doc.photographs ??= [], known = new Set(list.flatMap((p) => [p.file, ...(p.more_exposures ?? []).map((q) => q.file)]));
  for (const name of names.filter((n) => !known.has(n))) {
    const stem = stemOf(name), angles = pattern ? anglesOf(pattern, stem) : null, before = list[list.length - 1];
    const isView = rig?.views?.[stem] !== undefined;
    if (!isView && angles && before?.file && sameView(angles, anglesOf(pattern, stemOf(before.file)))) (before.more_exposures ??= []).push({ file: name });
    else {
      const photograph = { file: name };
      if (isView) photograph.view = stem;
      else if (angles) setAngles(photograph, angles);
      list.push(photograph);
    }
  }
  for (const p of list) if (rig?.views?.[stemOf(p.file ?? "")] !== undefined && p.view === undefined && p.light_theta_deg === undefined) p.view = stemOf(p.file);
  if (list.length === 0) delete doc.photographs;
}

// Angles by another pattern, of all photographs without a view of the rig whose names fit. Returns how many do.
export function readAngles(doc, pattern) {
  let n = 0;
  for (const p of doc.photographs ?? []) {
    const angles = p.view === undefined && typeof p.file === "string" ? anglesOf(pattern, stemOf(p.file)) : null;
    if (angles) { setAngles(p, angles); n++; }
  }
  return n;
}

// kinds: Map of name -> kind of every dropped file. Returns sentences on files that a job cannot use besides the others.
export function writeFiles(doc, kinds, pattern, rig) {
  const of = (...wanted) => [...kinds].filter(([, kind]) => wanted.includes(kind)).map(([name]) => name).sort(byName);
  const stays = (name, ...wanted) => !kinds.has(name) || wanted.includes(kinds.get(name));
  const notes = [];
  // names of files that have another use now
  doc.photographs = (doc.photographs ?? []).filter((p) => stays(p.file, "photograph"));
  for (const p of doc.photographs) if (p.more_exposures) setAt(p, ["more_exposures"], p.more_exposures.filter((q) => stays(q.file, "photograph")));
  for (const p of doc.photographs) if (p.more_exposures?.length === 0) delete p.more_exposures;
  for (const [kind, keys] of Object.entries(PLACES)) if (typeof valueAt(doc, keys) === "string" && !stays(valueAt(doc, keys), kind)) setAt(doc, keys, undefined);
  const scan = [...(doc.volume?.files ?? []).filter((name) => !kinds.has(name)), ...of("scan", "slice"), ...of("data")];
  if (scan.length) setAt(doc, ["volume", "files"], scan); else delete doc.volume;
  addPhotographs(doc, of("photograph"), pattern, rig);
  const photographed = (doc.photographs ?? []).length > 0;
  for (const [kind, keys] of Object.entries(PLACES)) {
    const [first, ...others] = of(kind), given = valueAt(doc, keys);
    const useless = FOR_PHOTOGRAPHS.has(kind) && !photographed ? "there are no photographs" : kind === "white" && of("chart").length ? "the color chart gives the scale" : null;
    if (useless && first) { notes.push(`'${first}' is not used, because ${useless}.`); setAt(doc, keys, undefined); continue; }
    if (first && given === undefined) setAt(doc, keys, first);
    if (others.length) notes.push(`A job takes one file of the kind “${keys[0]}”: ${valueAt(doc, keys)} is used, ${others.filter((n) => n !== valueAt(doc, keys)).join(", ")} is not.`);
  }
  const dark = [...(doc.camera?.dark_frames ?? []).filter((name) => !kinds.has(name)), ...of("dark")];
  setAt(doc, ["camera", "dark_frames"], dark.length && photographed ? dark : undefined);
  if (photographed && doc.measurements?.file) notes.push("A job takes photographs or a table, not both: leave one of them out.");
  if (of("flat").length) notes.push("Flat frames are used by `selvedge calibrate-camera`, not by a job.");
  return notes;
}
