// The tab "Rows": measured against rendered means, the error of each row, and what rows tell besides.
import { card, el } from "../page_parts.js";
import { scatterPlot } from "../comparison.js";
import { goniometer } from "../pairs/goniometer.js";
import { residualBars } from "../pairs/residual_bars.js";
import { lobesOf } from "../result_view.js";
import { fitOfRows } from "../job/fit_details.js";

export const rowsTab = {
  name: "rows",
  title: "Rows",
  has: ({ compared }) => compared.length > 0,
  key: ({ job }) => [job.generation, job.state],
  make({ id, job, compared, pair }) {
    const more = fitOfRows(job), lobes = goniometer(compared, lobesOf(job));
    const open = (i) => { pair.wanted = i; location.hash = `${id}/pictures`; };
    return { node: el("div", {}, el("div", { class: "columns" }, card(`Relative error of each of ${compared.length} rows`, ...residualBars(compared, open)),
      card("Measured and rendered means", ...[scatterPlot(compared)].flat())), lobes ? card("Lobes", lobes) : "", more ? card("More about the rows", more) : "") };
  },
};
