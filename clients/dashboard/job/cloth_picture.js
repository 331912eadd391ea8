// The one picture at the top of a job's page: the best that there is of the cloth.
import { el } from "../page_parts.js";
import { configurations } from "../result_view.js";
import { freshPicture } from "./fresh_picture.js";

const STEEP_DEG = 50;

const brightness = (c) => (c.rendered ? c.rendered[0] + c.rendered[1] + c.rendered[2] : 0);

// A picture on a surface: a drape before others, the filtered one before the noisy one.
function onSurface(job, find) {
  const list = job.result?.pictures ?? [];
  const p = list.find(({ on }) => on === "drape") ?? list[0];
  if (!p) return null;
  const plain = p.file.replace(/\.exr$/, ".png"), file = find(plain.replace(/\.png$/, "-filtered.png")) ?? find(plain);
  return file ? { url: file.url, words: `The cloth, ${p.on}, rendered with its parameters` } : null;
}

function rendering(job, files) {
  const rows = configurations(job, new Map(files.map((f) => [f.path, f.url]))).filter((c) => c.renderedPicture);
  const facing = rows.filter((c) => c.angles.camera_theta_deg <= STEEP_DEG), [best] = (facing.length ? facing : rows).sort((a, b) => brightness(b) - brightness(a));
  return best ? { url: best.renderedPicture, words: best.sphere ? `A sphere wrapped in the cloth under the lamp of ${best.name}` : `The cloth, rendered with the lamp and camera of ${best.name}` } : null;
}

// Returns {url, at: the time of the file where it may change, words}, or null without any picture.
export function clothPicture(job, files) {
  const find = (path) => files.find((f) => f.path === path), named = (path, words) => (find(path) ? { url: find(path).url, at: find(path).modified_unix_s, words } : null);
  return named("pictures/hero.png", "The cloth, rendered with its parameters") ?? onSurface(job, find) ?? rendering(job, files)
    ?? named("pictures/top.png", "One tile of the cloth from above") ?? named("pictures/slice-z.png", "A slice of the scan")
    ?? named(files.find((f) => /^photographs\/.*\.png$/.test(f.path))?.path, "A photograph of the cloth");
}

export const pictureNode = (picture) => el("figure", { class: "cloth-picture" }, el("a", { href: picture.url, target: "_blank" }, freshPicture(picture.url, picture.words)), el("figcaption", {}, picture.words));
