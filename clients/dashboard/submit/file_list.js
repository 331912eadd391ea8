// The files of a new job: a thumbnail, the use that was guessed and can be changed, size, exposure and faults of each. Many slices of a scan
// are one line.
import { el, size } from "../page_parts.js";
import { byName, KINDS } from "./guessed_kinds.js";
import { exposureWords } from "./exif_reader.js";
import { exposureOf, thumbnail } from "./thumbnails.js";

const MOST_SLICES = 6;

function kindMenu(names, kind, choose) {
  const menu = el("select", { "aria-label": names.length > 1 ? `use of ${names.length} slices` : `use of ${names[0]}`, onchange: () => choose(names, menu.value) },
    Object.entries(KINDS).filter(([id]) => id !== "slice" || kind === "slice").map(([id, words]) => el("option", { value: id, selected: id === kind }, words)));
  return menu;
}

// files: Map of name -> File. kinds: Map of name -> kind. states: of a name, the elements on its right. choose(names, kind) is called when a use
// was changed, changed() when the exposure of a file is known. Returns the lines.
export function fileLines({ files, kinds, stateOf, choose, changed }) {
  const names = [...files.keys()].sort((a, b) => Object.keys(KINDS).indexOf(kinds.get(a)) - Object.keys(KINDS).indexOf(kinds.get(b)) || byName(a, b));
  const slices = names.filter((name) => kinds.get(name) === "slice"), together = slices.length > MOST_SLICES;
  const bytes = slices.reduce((sum, name) => sum + files.get(name).size, 0);
  const line = (name) => el("li", { "data-file": name, class: kinds.get(name) === "unused" ? "unused" : null }, thumbnail(files.get(name), changed),
    el("span", { class: "name" }, el("span", { class: "mono" }, name), el("span", { class: "hint" }, [size(files.get(name).size), exposureWords(exposureOf(files.get(name)))].filter(Boolean).join(", "))),
    kindMenu([name], kinds.get(name), choose), el("span", { class: "said" }, stateOf(name)));
  const group = () => el("li", { "data-file": slices[0] }, thumbnail(files.get(slices[0]), changed),
    el("span", { class: "name" }, el("span", { class: "mono" }, `${slices[0]} … ${slices[slices.length - 1]}`), el("span", { class: "hint" }, `${slices.length} slices, ${size(bytes)}`)),
    kindMenu(slices, "slice", choose), el("span", { class: "said" }, slices.map(stateOf).find((s) => s) ?? null));
  return [...(together ? [group()] : []), ...names.filter((name) => !together || kinds.get(name) !== "slice").map(line)];
}
