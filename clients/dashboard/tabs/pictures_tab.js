// The tab "Pictures": the cloth on surfaces, and measured beside rendered pictures. Before the job has ended: the
// photographs, and the renderings that are there so far.
import { card, el } from "../page_parts.js";
import { pairsCard } from "../pairs/pairs_card.js";
import { picturesSoFar } from "../result_view.js";
import { SurfacePictures } from "../job/surface_card.js";

const MOST = 60; // pairs so far

function soFar(pairs) {
  const one = (url, what) => (url ? el("img", { src: url, alt: what, title: what, loading: "lazy" }) : el("div", { class: "none" }, "not rendered yet"));
  return el("div", { class: "gallery", id: "so-far" }, pairs.slice(0, MOST).map((p) => el("div", { class: "pair" },
    el("div", { class: "pictures" }, one(p.photograph, `${p.name}, photograph`), one(p.rendering, `${p.name}, rendered`)), el("div", { class: "label" }, el("b", {}, p.name)))));
}

export const picturesTab = {
  name: "pictures",
  title: "Pictures",
  has: ({ job, list, compared }) => compared.length > 0 || picturesSoFar(list.files).length > 0 || (job.document?.pictures?.length > 0 && list.files.some((f) => /^pictures\/on-\d+\.json$/.test(f.path))),
  key: ({ job, list, compared }) => [job.generation, job.state, compared.length, compared.length ? 0 : picturesSoFar(list.files)],
  make({ id, job, list, compared, pair }) {
    const surfaces = el("div"), pictures = new SurfacePictures(surfaces, id), early = compared.length ? [] : picturesSoFar(list.files);
    const pairs = compared.length ? pairsCard(compared, job.result?.png_exposure) : null;
    return {
      node: el("div", {}, surfaces, pairs ? card("Measured and rendered pictures", pairs.box) : "",
        early.length ? card("Photographs, and renderings so far", soFar(early)) : ""),
      shown: () => { if (pairs && pair.wanted !== null) { pairs.open(pair.wanted); pair.wanted = null; } },
      update: ({ job: now }) => pictures.update(now),
      close: () => { pairs?.close(); pictures.reset(); },
    };
  },
};
