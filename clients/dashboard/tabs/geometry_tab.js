// The tab "Geometry": kinds of fibers and the quality of the geometry, slices of the scan, fibers in 3D. While the job
// runs, the slices and fibers that there are so far.
import { card, el } from "../page_parts.js";
import { fiberView } from "../fiber_view.js";
import { SharedFibers } from "../fibers/hair_file.js";
import { contrastFile, fiberFile, sliceFiles, tracedFile } from "../result_view.js";
import { sliceView } from "../slices/slice_view.js";
import { freshPicture } from "../job/fresh_picture.js";
import { kindsTable, qualityCard } from "../job/quality_card.js";

const isGeometry = (f) => /^(fibers\.hair|scan\/.*|pictures\/slice-[xyz]\.png)$/.test(f.path);

function slicePictures(files) {
  return el("div", { class: "slices" }, files.map((f) => el("figure", {}, freshPicture(f.url, `slice across ${f.path.at(-5)}`), el("figcaption", {}, `across ${f.path.at(-5)}`))));
}

export const geometryTab = {
  name: "geometry",
  title: "Geometry",
  has: ({ job, list }) => Boolean(job.result?.geometry) || list.files.some(isGeometry),
  key: ({ job, list }) => [job.generation, job.state === "succeeded", list.files.filter(isGeometry).map((f) => [f.path, f.size, f.modified_unix_s])],
  make({ job, list: { files } }) {
    const traced = tracedFile(files), seen = traced ? new SharedFibers(traced, contrastFile(files)) : null, hair = fiberFile(files), slices = sliceFiles(files);
    const fibers = hair ? fiberView(new SharedFibers(hair, null), seen) : null, scan = sliceView(files, seen);
    const quality = qualityCard(job, files), kinds = kindsTable(job);
    return {
      node: el("div", {}, kinds ? card("Kinds of fibers", ...kinds) : "",
        scan ? card("Slices of the scan", scan.box) : slices.length ? card(traced || job.state === "succeeded" ? "Slices of the scan, detected fibers in red" : "Slices of the scan", slicePictures(slices)) : "",
        fibers ? card("Fibers", fibers.box) : "",
        quality ? card("Quality of the geometry", quality) : ""),
      close: () => { fibers?.close(); scan?.close(); },
    };
  },
};
