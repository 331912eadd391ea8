// The twins of the compared jobs side by side, with the same camera and light, and a photograph of the reference beside them.
import { el } from "../page_parts.js";
import { WIDE, loadCloth, photographsOf } from "../twin/twin_card.js";
import { TwinPanel, twinError, twinNote } from "../twin/twin_panel.js";

const MOST_TWINS = 4;

export const withTwin = (columns) => columns.filter((c) => c.urls.has("twin/twin.bin") && c.urls.has("twin/twin.json")).slice(0, MOST_TWINS);

// columns: of withTwin, as those of the comparison; base: the reference. leave() of the node frees the drawings.
export function comparedTwins(columns, base) {
  const box = el("div", { class: "twin" }), note = el("p", { class: "hint" });
  let panel = null, left = false;
  const open = async () => {
    start.disabled = true;
    try {
      const cloths = await Promise.all(columns.map(async (c) => ({ ...await loadCloth((path) => c.urls.get(path)), name: `${c.letter}, ${c.job.sample}` })));
      if (left) return;
      const exposure = base.job.result.png_exposure ?? 1;
      panel = new TwinPanel(box, { cloths, exposure, photographs: photographsOf(base.list, 10 * (base.job.document?.camera?.crop_cm ?? 1), exposure), pictures: [] });
      note.replaceChildren(twinNote(panel.works, null, columns.map((c, i) => `${twinError(cloths[i].description)} (${c.letter})`).join(", ")));
    } catch (error) {
      note.replaceChildren(`The twins cannot be shown: ${error.message}.`);
    }
  };
  const start = el("button", { id: "twins-open", onclick: open }, "Turn and light the cloths together");
  note.append(start);
  if (matchMedia(WIDE).matches) open();
  return Object.assign(el("section", { class: "card", id: "compare-twins" }, el("h2", {}, "Twins under one lamp"), box, note), { leave: () => { left = true; panel?.close(); } });
}
