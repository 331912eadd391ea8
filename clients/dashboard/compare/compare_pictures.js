// The photographs of all jobs, each once, with the rendering of every job beside it at one exposure.
import { commonExposure, picture } from "../comparison.js";
import { PagedList } from "../paged_list.js";
import { el, isNumber, percentWithError, svg } from "../page_parts.js";

const SHOWN = 8; // photographs of a page
const round = (x) => (isNumber(x) ? String(Number(x.toFixed(1))) : "–");

const whereOf = (a) => `light ${round(a.light_theta_deg)}°, ${round(a.light_phi_deg)}°; camera ${round(a.camera_theta_deg)}°, ${round(a.camera_phi_deg)}°; ${a.all_rotations ? "all rotations" : `turned ${round(a.cloth_rotation_deg)}°`}`;

// Rows of all jobs by name and angles, in the order of the first job that has them: [{name, where, cells}], where
// cells[column.place] is the job's configuration or undefined. Gives the columns their places.
export function pictureRows(columns) {
  const rows = new Map();
  columns.forEach((c, place) => {
    c.place = place;
    for (const one of c.list) {
      const where = whereOf(one.angles), key = `${one.name}\n${where}`;
      if (!rows.has(key)) rows.set(key, { name: one.name, where, cells: [] });
      rows.get(key).cells[place] = one;
    }
  });
  return [...rows.values()];
}

// A filter that multiplies linear light, so that pictures of different exposures can be compared: feComponentTransfer
// works in linear RGB unless told otherwise.
function dimmer(id, slope) {
  const part = (channel) => svg(`feFunc${channel}`, { type: "linear", slope });
  return svg("filter", { id, x: 0, y: 0, width: 1, height: 1, "color-interpolation-filters": "linearRGB" }, svg("feComponentTransfer", {}, part("R"), part("G"), part("B")));
}

const sameLight = (a, b) => a?.measured && b?.measured && a.measured.every((v, i) => Math.abs(v - b.measured[i]) <= 1e-6 * Math.max(Math.abs(v), 1e-6));

export function comparedPictures(columns, rows) {
  const given = columns.map((c) => c.job.result.png_exposure).filter((x) => isNumber(x) && x > 0), least = given.length ? Math.min(...given) : null;
  const exposure = least ?? commonExposure(columns.flatMap((c) => c.list));
  const filters = svg("svg", { width: 0, height: 0, "aria-hidden": "true", class: "filters-only" });
  columns.forEach((c) => { if (c.job.result.png_exposure > exposure) filters.append(dimmer(`dim-${c.letter}`, exposure / c.job.result.png_exposure)); });
  const shown = (url, rgb, c, what) => {
    const node = picture(url, rgb, exposure, what);
    if (url && c.job.result.png_exposure > exposure) node.style.filter = `url(#dim-${c.letter})`;
    return node;
  };
  const figure = (node, ...words) => el("figure", {}, node, el("figcaption", {}, ...words));
  const line = (row) => {
    const from = columns.find((c) => row.cells[c.place]?.measuredPicture) ?? columns.find((c) => row.cells[c.place]), first = row.cells[from.place];
    return el("div", { class: "strip" }, el("h3", {}, el("span", { class: "mono" }, row.name), el("span", { class: "hint" }, ` ${row.where}`)),
      el("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": `pictures of ${row.name}` }, el("div", { class: "row-of-pictures" },
        figure(shown(first.measuredPicture, first.measured, from, `${row.name} measured`), "measured"),
        columns.map((c) => {
          const one = row.cells[c.place];
          if (!one) return figure(el("div", { class: "none" }, "not in this job"), el("b", {}, c.letter));
          return figure(shown(one.renderedPicture, one.rendered, c, `${row.name} rendered by ${c.letter}`), el("b", {}, c.letter), ` ${percentWithError(one.error, one.errorSe, 1)} `, one.held ? el("span", { class: "tag" }, "held out") : null,
            sameLight(one, first) ? null : el("span", { class: "tag warn", title: "This job has other measured values for this row than the picture at the left." }, "measured otherwise"));
        }))));
  };
  const box = el("div"), { pages } = new PagedList(box, rows.map(line), SHOWN, "photographs");
  const dimmed = filters.childElementCount > 0 ? " Pictures that were written brighter are dimmed to it, so that what was white in them is grey." : "";
  return [el("p", { class: "hint" }, `All pictures have the same exposure, the least of these jobs.${dimmed} Plain squares show mean colours.`), filters, box, pages];
}
