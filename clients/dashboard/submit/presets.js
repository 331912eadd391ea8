// The three kinds of job that the page of a new job offers: what each needs, and what is there already.
import { el } from "../page_parts.js";

const hasScan = (doc) => Boolean(doc.volume?.files?.length || doc.fibers?.file || doc.geometry);
const hasWeave = (doc) => Boolean(doc.cloth?.weave || doc.cloth?.draft || doc.cloth?.draft_file || doc.cloth?.texture);
const hasPhotographs = (doc) => (doc.photographs ?? []).length > 0;
const hasTable = (doc) => Boolean(doc.measurements?.file);

export const PRESETS = [
  { id: "scan_photographs", title: "Scan and photographs", text: "A micro-CT scan and photographs under a lamp from several sides.",
    needs: [{ words: "a scan: .tif, .mhd, .nrrd, .dcm …", given: hasScan }, { words: "photographs: camera raw, .exr, .jpg …", given: hasPhotographs }] },
  { id: "table", title: "Table of reflectances", text: "A scan or a description of the weave, and measured values as a table.",
    needs: [{ words: "a scan, or the weave", given: (doc) => hasScan(doc) || hasWeave(doc) }, { words: "a table: .csv, .bsdf, .binary …", given: hasTable }] },
  { id: "no_scanner", title: "No scanner", text: "A description of the weave, and photographs or a table.",
    needs: [{ words: "the weave, or a draft: .wif", given: hasWeave }, { words: "photographs, or a table", given: (doc) => hasPhotographs(doc) || hasTable(doc) }] },
];

// The preset that the files suggest; null: they suggest none.
export function presetOf(kinds) {
  const is = (...wanted) => [...kinds.values()].some((kind) => wanted.includes(kind));
  const scan = is("scan", "slice", "fibers");
  if (is("table")) return scan || !is("draft") ? "table" : "no_scanner";
  if (scan) return "scan_photographs";
  return is("photograph", "draft") ? "no_scanner" : null;
}

// Whether the weave is asked for.
export const wantsWeave = (doc, preset) => !hasScan(doc) && !doc.cloth?.draft && !doc.cloth?.draft_file && !doc.cloth?.texture && preset !== "scan_photographs";

// The parts that a job of this preset still needs.
export const missingParts = (doc, preset) => (PRESETS.find((p) => p.id === preset)?.needs ?? []).filter((part) => !part.given(doc)).map((part) => part.words)
  .filter((_words, _i, all) => !(preset === "scan_photographs" && hasScan(doc) && all.length === 1)); // a scan alone ends with the geometry

export class PresetCards {
  constructor(chosen) {
    this.cards = PRESETS.map((preset) => {
      const input = el("input", { type: "radio", name: "preset", value: preset.id, onchange: () => chosen(preset.id) }), needs = el("ul", {});
      return { preset, input, needs, node: el("label", { class: "preset" }, input, el("b", {}, preset.title), el("span", { class: "hint" }, preset.text), needs) };
    });
    this.node = el("fieldset", { id: "presets" }, el("legend", {}, "What do you have?"), ...this.cards.map((c) => c.node));
  }

  show(doc, preset) {
    for (const { preset: one, input, needs } of this.cards) {
      input.checked = one.id === preset;
      needs.replaceChildren(...one.needs.map(({ words, given }) => el("li", { class: given(doc) ? "given" : "" }, words, given(doc) ? el("span", { class: "tag good" }, "given") : null)));
    }
  }
}
