// Guesses the use of dropped files, by their names and the first keys of JSON files: the rules of `selvedge init`
// (clients/cli/batch/folder_kinds.c).
import { anglesOf, guessPattern, stemOf } from "./name_angles.js";

// id -> words, in the order of the menu
export const KINDS = {
  scan: "scan", slice: "slice of a scan", data: "data of the scan", table: "table of reflectances", photograph: "photograph", dark: "dark frame",
  flat: "flat frame", white: "white card", chart: "color chart", fibers: "fibers", draft: "draft", rig: "rig", noise: "camera's noise",
  document: "job document", unused: "left out",
};

const PICTURE = new Set(["dng", "cr2", "cr3", "nef", "arw", "orf", "rw2", "raf", "pef", "jpg", "jpeg", "png", "exr", "tif", "tiff"]);
const BY_ENDING = { csv: "table", tsv: "table", binary: "table", bsdf: "table", astm: "table", hair: "fibers", wif: "draft" };
const SCAN = /\.(tiff?|mhd|mha|nrrd|nhdr|npy|nii|nii\.gz|hdr|img|h5|hdf5|hdf|nxs|dcm|dicom|ima|vol)$/;
const HEADER = /\.(mhd|nhdr|hdr)$/, DATA = /\.(raw|img|zraw|raw\.gz|bin)$/;
// Words in the names of pictures that do not show the cloth.
const BY_WORD = [["dark", "dark"], ["flat", "flat"], ["chart", "chart"], ["colorchecker", "chart"], ["white", "white"], ["grey", "white"]];

export const endingOf = (name) => /\.([^.]{1,12})$/.exec(name.toLowerCase())?.[1] ?? "";

// The order of names: numbers in them count as numbers, as in base/natural_order.c.
export function byName(a, b) {
  const parts = (text) => text.match(/\d+|\D/g) ?? [], p = parts(a), q = parts(b);
  for (let i = 0; i < Math.min(p.length, q.length); i++) {
    if (/^\d/.test(p[i]) && /^\d/.test(q[i])) {
      if (Number(p[i]) !== Number(q[i])) return Number(p[i]) - Number(q[i]);
    } else if (p[i] !== q[i]) return p[i] < q[i] ? -1 : 1;
  }
  return p.length - q.length || (a < b ? -1 : Number(a > b));
}

// The kind of a JSON file by its text.
export function kindOfJson(text) {
  let json = null;
  try { json = JSON.parse(text); } catch { return "document"; } // its fault is shown
  if (json?.selvedge_rig !== undefined) return "rig";
  if (json?.selvedge_camera_noise !== undefined) return "noise";
  return json?.sample !== undefined ? "document" : "unused";
}

function kindOf(name, views, pattern) {
  const small = name.toLowerCase(), ending = endingOf(name), stem = stemOf(name);
  if (PICTURE.has(ending)) {
    // first, because the cloth may be dark or white
    if (views[stem] !== undefined || (pattern ? anglesOf(pattern, stem) : guessPattern([stem]))) return "photograph";
    const word = BY_WORD.find(([text]) => small.includes(text));
    if (word) return word[1];
    if (!ending.startsWith("tif")) return "photograph";
  } else if (BY_ENDING[ending]) return BY_ENDING[ending];
  return SCAN.test(small) ? "scan" : "unused";
}

// names: of all files. json: Map of name -> kind of JSON files. rig: the rig among them, or null. pattern: of the names of photographs, or
// null for the usual ones. chosen: Map of name -> kind that the user has set. Returns a Map of name -> kind.
export function guessedKinds(names, json, rig, pattern, chosen) {
  const kinds = new Map(names.map((name) => [name, json.get(name) ?? kindOf(name, rig?.views ?? {}, pattern)]));
  const scans = () => names.filter((name) => (chosen.get(name) ?? kinds.get(name)) === "scan");
  // samples beside a header are not a scan of their own
  if (scans().some((name) => HEADER.test(name.toLowerCase()))) for (const name of names) if (DATA.test(name.toLowerCase())) kinds.set(name, "data");
  for (const [name, kind] of chosen) if (kinds.has(name)) kinds.set(name, kind);
  const list = names.filter((name) => kinds.get(name) === "scan" || kinds.get(name) === "slice");
  for (const name of list) kinds.set(name, list.length > 1 ? "slice" : "scan");
  return kinds;
}
