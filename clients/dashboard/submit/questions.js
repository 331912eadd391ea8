// The questions that the files of a new job leave open, each with an example. All else has defaults and stays folded.
import { el } from "../page_parts.js";
import { endingOf } from "./guessed_kinds.js";
import { wantsWeave } from "./presets.js";
import { setAt, valueAt } from "./written_document.js";

const WEAVES = { plain: "plain", twill: "twill 2/2", twill31: "twill 3/1", satin: "satin", basket: "basket", rib: "rib", jersey: "jersey (knit)", velvet: "velvet", felt: "felt" };
const CURVE = new Set(["jpg", "jpeg", "png", "tif", "tiff"]);

const numberOf = (text) => {
  const words = text.trim().split(/[\s;x×]+|,\s+/).map((w) => w.replace(",", ".")).filter((w) => w !== ""), values = words.map(Number);
  if (values.length === 0) return undefined;
  return values.length === 1 ? values[0] : values;
};
const bent = (doc) => (doc.photographs ?? []).filter((p) => CURVE.has(endingOf(p.file ?? "")));

const QUESTIONS = [
  { id: "sample", label: "Name of the sample", example: "blue twill, batch 7", asked: () => true, needed: () => true, keys: ["sample"], read: (text) => text.trim() || undefined },
  { id: "voxel", label: "Edge of a voxel", unit: "µm", example: "2.5", keys: ["volume", "voxel_size_um"], read: numberOf,
    hint: "Leave it empty if the scan states it; three numbers if voxels are no cubes, such as 2 2 2.5.",
    asked: (doc) => (doc.volume?.files ?? []).length > 0, needed: (_, { statesVoxel }) => !statesVoxel },
  { id: "weave", label: "Weave", choices: { "": "choose …", ...WEAVES }, keys: ["cloth", "weave"], read: (text) => text || undefined, asked: (doc, { preset }) => wantsWeave(doc, preset), needed: () => true,
    hint: "Pictures of each are in docs/described-cloth.md; any other weave is a draft (.wif)." },
  { id: "warp", label: "Warp threads", unit: "per cm", example: "24", keys: ["cloth", "warp_per_cm"], read: numberOf, asked: (doc) => Boolean(doc.cloth?.weave) && !["jersey", "felt"].includes(doc.cloth.weave), needed: () => false,
    hint: "Count them under a magnifier. Empty: from the width of the yarns." },
  { id: "weft", label: "Weft threads", unit: "per cm", example: "22", keys: ["cloth", "weft_per_cm"], read: numberOf, asked: (doc) => Boolean(doc.cloth?.weave) && !["jersey", "felt"].includes(doc.cloth.weave), needed: () => false },
  { id: "transfer", label: "JPEG, PNG and TIFF pictures are", choices: { "": "as each file declares", srgb: "as a camera or phone saves them (sRGB)", linear: "developed without tone curve (linear)" },
    asked: (doc) => bent(doc).length > 0, needed: () => false, get: (doc) => bent(doc)[0]?.transfer ?? "",
    set: (doc, text) => { for (const p of bent(doc)) if (text) p.transfer = text; else delete p.transfer; },
    hint: "A picture that does not declare its curve is refused without this." },
  { id: "edition", label: "The color chart was made", choices: { "": "before November 2014", from_2014: "in November 2014 or later" }, keys: ["color", "chart", "edition"], read: (text) => text || undefined,
    asked: (doc) => Boolean(doc.color?.chart?.file), needed: () => false, hint: "The year is on its back; the white patches differ by 4 %." },
  { id: "reflectance", label: "Reflectance of the white card", example: "0.99", keys: ["color", "white", "reflectance"], read: numberOf, asked: (doc) => Boolean(doc.color?.white?.file), needed: () => false,
    hint: "Empty: 0.99, as of sintered PTFE." },
  { id: "scale", label: "Radiance of a pixel value of 1", example: "0.92", asked: (doc) => (doc.photographs ?? []).length > 0 && !doc.color, needed: () => false, get: (doc) => doc.photographs[0]?.scale,
    set: (doc, text) => { const scale = numberOf(text); for (const p of doc.photographs) if (typeof scale === "number") p.scale = scale; else delete p.scale; },
    hint: "A white diffuser that faces the lamp has 1. A photograph of a color chart or a white card, dropped here, says it better." },
];

export class Questions {
  // changed(doc) is called with the document after an answer
  constructor(changed) {
    this.node = el("div", { id: "questions" });
    this.lines = new Map();
    for (const q of QUESTIONS) {
      const input = q.choices ? el("select", { id: `ask-${q.id}` }, Object.entries(q.choices).map(([value, words]) => el("option", { value }, words)))
        : el("input", { id: `ask-${q.id}`, type: "text", autocomplete: "off", inputMode: q.unit ? "decimal" : "text", placeholder: `such as ${q.example}` });
      input.addEventListener("change", () => {
        const value = q.read?.(input.value);
        if (q.set) q.set(this.doc, input.value); else setAt(this.doc, q.keys, value);
        changed(this.doc);
      });
      const line = el("div", { class: "question" }, el("label", { htmlFor: `ask-${q.id}` }, q.label, q.unit ? el("small", {}, ` ${q.unit}`) : null), input, q.hint ? el("span", { class: "hint" }, q.hint) : null);
      this.lines.set(q, { input, line });
      this.node.append(line);
    }
  }

  // about: {preset, statesVoxel}. Returns the names of what must be known and is not.
  show(doc, about) {
    const missing = [];
    this.doc = doc;
    for (const [q, { input, line }] of this.lines) {
      const asked = q.asked(doc, about);
      line.classList.toggle("hidden", !asked);
      if (!asked) continue;
      const value = q.get ? q.get(doc) : valueAt(doc, q.keys);
      const text = value === undefined || typeof value === "object" && !Array.isArray(value) ? "" : Array.isArray(value) ? value.join(" ") : String(value);
      if (document.activeElement !== input || input.tagName === "SELECT") input.value = text;
      const isMissing = value === undefined && q.needed(doc, about);
      line.classList.toggle("missing", isMissing);
      if (isMissing) missing.push(q.label.toLowerCase());
    }
    return missing;
  }
}
