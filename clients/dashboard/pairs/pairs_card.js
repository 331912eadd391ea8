// The card with all measured and rendered pictures of a job: exposure, one pair large, all small.
import { commonExposure } from "../comparison.js";
import { el } from "../page_parts.js";
import { ExposureControl } from "./exposure_control.js";
import { PairGallery } from "./pair_gallery.js";
import { PairViewer } from "./pair_viewer.js";

// {box, open, close}; open(i) shows the pair of row i; shared: the exposure of the job's PNG files, if it has one
export function pairsCard(list, shared) {
  const exposure = new ExposureControl(shared ?? commonExposure(list)), viewer = new PairViewer(list, exposure);
  const gallery = new PairGallery(list, exposure, (i) => viewer.open(i));
  const box = el("div", { id: "pairs" },
    el("p", { class: "hint" }, list.some((c) => c.sphere) ? "Left: the measured mean colour of each row; right: a sphere wrapped in the fitted cloth under the row's lamp, which stands on the left. Rows in dashed frames were held out of the fit." : "Left: measured; right: rendered with the fitted parameters, both from linear values. Photographs in dashed frames were held out of the fit. Plain squares show mean colours." + (list.some((c) => c.filter) ? ` Noise of the renderings is filtered (${list[0].filter}); numbers are of unfiltered paths.` : "") + " A click on a pair shows it large."),
    exposure.node, viewer.node, gallery.node, gallery.pages);
  return { box, open: (i) => viewer.open(i), close: () => { gallery.close(); viewer.close(); } };
}
