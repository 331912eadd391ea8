// Pictures of the cloth on surfaces, each as far as it is rendered: while the job runs they grow, and their noise falls.
import { el, isNumber, percent } from "../page_parts.js";
import { getJson, raw } from "../server_link.js";

const degrees = (x) => `${Number((x ?? 0).toFixed(1))}°`;

function captionOf(wanted, entry, asRendered) {
  const samples = wanted.samples ?? 16, whole = entry.samples >= samples;
  return [
    el("div", { class: "row" }, el("b", {}, entry.on), whole ? null : el("span", { class: "tag" }, `${entry.samples} of ${samples} samples`)),
    !entry.filtered ? null : el("div", { class: "row filtered", title: "a joint filter has smoothed this preview; the numbers are those of the picture as it was rendered" },
      el("span", {}, "filtered preview"), el("a", { href: asRendered, target: "_blank" }, "as rendered")),
    el("div", { class: "row" }, el("span", {}, "light"), el("span", {}, `θ ${degrees(wanted.light_theta_deg)}  φ ${degrees(wanted.light_phi_deg)}`)),
    el("div", { class: "row" }, el("span", {}, "camera"), el("span", {}, `θ ${degrees(wanted.camera_theta_deg)}  φ ${degrees(wanted.camera_phi_deg)}`)),
    el("div", { class: "row", title: "root mean square of the pixels' standard errors over the mean brightness" },
      el("span", {}, whole ? "noise" : "noise so far"), el("span", {}, isNumber(entry.noise) ? percent(entry.noise) : "–")),
    !whole || !entry.reference ? null : el("div", { class: "row reference", title: "root mean square difference of fields of 4 x 4 pixels, with the noise of both pictures taken off" },
      el("span", {}, "from path tracing"), el("span", {}, isNumber(entry.reference.field_difference_rms) ? `${percent(entry.reference.field_difference_rms)} beyond noise of ${percent(entry.reference.field_noise)}` : "–")),
  ];
}

const soFar = (entry) => `${entry.samples} ${Boolean(entry.reference)} ${Boolean(entry.filtered)}`;

export class SurfacePictures {
  #job;
  #node;
  #shown = []; // of each picture: {soFar, figure, address}

  constructor(node, id) {
    this.#node = node;
    this.#job = `/v1/jobs/${id}`;
  }

  reset() {
    for (const picture of this.#shown) if (picture) URL.revokeObjectURL(picture.address);
    this.#shown = [];
    this.#node.replaceChildren();
  }

  async update(job) {
    const wanted = job.document?.pictures ?? [];
    if (!wanted.length || (job.state !== "succeeded" && job.stage !== "report")) return;
    const files = new Set((await getJson(`${this.#job}/results`)).files.map((f) => f.path));
    for (let i = 0; i < wanted.length; i++)
      if (files.has(`pictures/on-${i + 1}.json`)) await this.#show(i, wanted[i]);
  }

  async #show(i, wanted) {
    const url = `${this.#job}/results/pictures/on-${i + 1}`, entry = await getJson(`${url}.json`), before = this.#shown[i];
    if (before?.soFar === soFar(entry)) return;
    const shown = entry.filtered ? `${url}-filtered.png` : `${url}.png`, alt = `the cloth, ${entry.on}${entry.filtered ? ", filtered" : ""}`;
    const address = URL.createObjectURL(await (await raw("GET", shown)).blob());
    const figure = el("figure", {}, el("a", { href: shown, target: "_blank" }, el("img", { src: address, alt })), el("figcaption", {}, captionOf(wanted, entry, `${url}.png`)));
    this.#shown[i] = { soFar: soFar(entry), figure, address };
    if (before) URL.revokeObjectURL(before.address);
    this.#node.replaceChildren(el("section", { class: "card", id: "surfaces" }, el("h2", {}, "The cloth on surfaces"),
      el("div", { class: "surfaces" }, this.#shown.filter(Boolean).map((picture) => picture.figure))));
  }
}
