// Small pictures of dropped files: of PNG, JPEG and raw files with a preview by the browser; of others a sign with their ending.
import { el } from "../page_parts.js";
import { endingOf } from "./guessed_kinds.js";
import { readExif } from "./exif_reader.js";

const WIDTH = 56, HEIGHT = 42, SHOWN = new Set(["png", "jpg", "jpeg"]), WITH_TAGS = new Set(["jpg", "jpeg", "tif", "tiff", "dng", "nef", "cr2", "arw", "pef"]);
const made = new WeakMap(), exposures = new WeakMap();
let last = Promise.resolve();

// Exif of a file: no member while it is not known.
/** @returns {{exposure_s?: number, aperture?: number, iso?: number, preview?: Blob}} */
export const exposureOf = (file) => exposures.get(file) ?? {};

// Whether the tags of a file were read, which may be none; false for formats that a browser cannot judge.
export const hasReadTags = (file) => WITH_TAGS.has(endingOf(file.name)) && exposures.has(file);

async function fill(file, canvas, sign, changed) {
  const ending = endingOf(file.name), exif = WITH_TAGS.has(ending) ? await readExif(file) : {};
  exposures.set(file, exif);
  if (WITH_TAGS.has(ending)) changed();
  const source = SHOWN.has(ending) ? file : exif.preview;
  if (!source) return;
  const picture = await createImageBitmap(source, { resizeHeight: 2 * HEIGHT, resizeQuality: "medium" });
  const scale = Math.max(canvas.width / picture.width, canvas.height / picture.height), w = picture.width * scale, h = picture.height * scale;
  canvas.getContext("2d").drawImage(picture, (canvas.width - w) / 2, (canvas.height - h) / 2, w, h);
  picture.close();
  sign.replaceWith(canvas);
}

// One element for each file, made once. changed() is called when the exposure of the file is known.
export function thumbnail(file, changed) {
  if (made.has(file)) return made.get(file);
  const sign = el("span", { class: "sign" }, endingOf(file.name).slice(0, 5) || "file");
  const canvas = el("canvas", { width: 2 * WIDTH, height: 2 * HEIGHT });
  const node = el("span", { class: "thumbnail", "aria-hidden": "true" }, sign);
  made.set(file, node);
  last = last.then(() => fill(file, canvas, sign, changed)).catch(() => {}); // a file that the browser cannot show keeps its sign
  return node;
}
