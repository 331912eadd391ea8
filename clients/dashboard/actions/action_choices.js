// What can be made of a finished job, as pictures to choose from: shapes, lights and sizes; and the formats in words.
import { svg } from "../page_parts.js";

const WIDTH = 96, HEIGHT = 72;

// A drawing; alone it has no name, because the words beside it say the same.
function drawing(...shapes) {
  return svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "choice-drawing", "aria-hidden": "true" }, ...shapes);
}

const line = (d, kind = "edge") => svg("path", { d, class: kind });

// The cloth without its light. `more`: further keys of the picture (docs/options.md).
export const SHAPES = [
  { id: "drape", words: "Draped over a ball", more: { on: "drape", radius_mm: 12, size_mm: 40, width_mm: 44 }, ground: true,
    draw: () => drawing(line("M10 60 Q18 58 24 40 Q32 14 48 14 Q64 14 72 40 Q78 58 86 60 Q76 66 68 60 Q60 68 50 61 Q40 68 30 61 Q20 66 10 60 Z", "cloth"),
      line("M34 60 Q36 40 42 24"), line("M52 61 Q54 40 51 20"), line("M68 60 Q66 42 58 25")) },
  { id: "flat", words: "Flat swatch", more: { on: "flat", size_mm: 40, width_mm: 30 }, ground: false,
    draw: () => drawing(line("M26 14 L84 14 L70 58 L12 58 Z", "cloth"), line("M40 14 L26 58"), line("M55 14 L41 58"), line("M70 14 L56 58"), line("M21 29 L79 29"), line("M17 43 L75 43")) },
  { id: "cylinder", words: "Around a cylinder", more: { on: "cylinder", radius_mm: 15, size_mm: 40, width_mm: 36 }, ground: false,
    draw: () => drawing(line("M16 54 Q16 16 48 16 Q80 16 80 54 Q80 60 48 60 Q16 60 16 54 Z", "cloth"), line("M30 57 Q30 30 40 17"), line("M48 60 L48 16"), line("M66 57 Q66 30 56 17")) },
];

// Views of the studio (pictures[].kind), which need no lamp.
export const VIEWS = [
  { id: "drape", words: "Draped", draw: SHAPES[0].draw },
  { id: "roll", words: "A roll", draw: () => drawing(line("M24 50 Q14 50 14 38 Q14 26 24 26 L66 14 Q76 14 76 26 Q76 38 66 38 Z", "cloth"), svg("circle", { cx: "24", cy: "38", r: "12", class: "edge" }), svg("circle", { cx: "24", cy: "38", r: "7", class: "edge" }), line("M24 50 L50 62 L90 46 L66 38")) },
  { id: "fold", words: "Hung in folds", draw: () => drawing(line("M14 10 L82 10 L82 60 Q74 66 66 60 Q58 54 48 60 Q38 66 30 60 Q22 54 14 60 Z", "cloth"), line("M30 10 L30 60"), line("M48 10 L48 60"), line("M66 10 L66 60")) },
  { id: "swatch", words: "Flat, with a scale", draw: SHAPES[1].draw },
  { id: "close_up", words: "Close up: fibers", draw: () => drawing(line("M10 20 Q48 2 86 20 L86 34 Q48 16 10 34 Z", "cloth"), line("M10 25 Q48 7 86 25"), line("M10 30 Q48 12 86 30"), line("M10 50 Q48 34 86 50 L86 64 Q48 48 10 64 Z", "cloth"), line("M10 55 Q48 39 86 55"), line("M10 60 Q48 44 86 60")) },
  { id: "far", words: "From far", draw: () => drawing(line("M34 50 Q38 48 40 40 Q43 28 48 28 Q53 28 56 40 Q58 48 62 50 Q56 54 52 50 Q48 54 44 50 Q39 54 34 50 Z", "cloth")) },
  { id: "lit_through", words: "Lit through", draw: () => drawing(line("M26 14 L84 14 L70 44 L12 44 Z", "cloth"), line("M30 64 L38 50"), line("M44 66 L46 50"), line("M58 64 L54 50")) },
];

export const STUDIO_SIZES = [
  { id: "look", words: "a quick look (384 pixels)", more: { px: 384, samples: 8 } },
  { id: "slide", words: "for a slide (1024 pixels)", more: { px: 1024, samples: 16 } },
  { id: "print", words: "for print (2048 pixels)", more: { px: 2048, samples: 32 } },
];

export const studioRequest = (view, size) => ({ pictures: [{ kind: view.id, ...size.more }] });

let nGradient = 0;

// A ball in the light: `x`, `y` the place of its bright spot, `soft` how far the light reaches around it.
function ball(x, y, soft, dark) {
  const id = `choice-light-${++nGradient}`, stop = (offset, shade) => svg("stop", { offset, class: shade });
  return drawing(svg("defs", {}, svg("radialGradient", { id, gradientUnits: "userSpaceOnUse", cx: x, cy: y, r: soft }, stop("0", "lit"), stop("1", dark))),
    svg("circle", { cx: "48", cy: "38", r: "28", fill: `url(#${id})` }), svg("circle", { cx: x, cy: y, r: "3", class: "lamp" }));
}

// Lamps and surroundings. `picture`: keys of the picture; `job`: sections of the job in place of those of the finished one.
export const LIGHTS = [
  { id: "side", words: "Lamp from the side", ground: true, draw: () => ball("30", "22", "44", "unlit"), picture: { light_theta_deg: 45, light_phi_deg: 190 } },
  { id: "low", words: "Low lamp, long shadows", ground: true, draw: () => ball("14", "34", "40", "unlit"), picture: { light_theta_deg: 72, light_phi_deg: 185 } },
  { id: "camera", words: "Lamp beside the camera", ground: true, draw: () => ball("44", "34", "44", "unlit"), picture: { light_theta_deg: 35, light_phi_deg: 235 } },
  { id: "window", words: "Large window, soft", ground: true, draw: () => ball("26", "26", "70", "dim"), picture: { light_theta_deg: 50, light_phi_deg: 195, lamp_sharpness: 10 } },
  { id: "sky", words: "Bright surroundings", ground: false, draw: () => ball("40", "14", "90", "dim"), picture: { light_theta_deg: 40, light_phi_deg: 190, lamp_sharpness: 4 },
    job: { environment: { radiance: [0.5, 0.55, 0.65] } } },
  { id: "behind", words: "Lamp behind the cloth", ground: false, draw: () => ball("72", "60", "30", "unlit"), picture: { light_theta_deg: 130, light_phi_deg: 60, black_sheet: false } },
];

export const SIZES = [
  { id: "look", words: "a quick look (256 pixels)", more: { px: 256, samples: 8, filter: true } },
  { id: "slide", words: "for a slide (800 pixels)", more: { px: 800, samples: 32, filter: true } },
  { id: "print", words: "for print (1600 pixels)", more: { px: 1600, samples: 128, filter: true } },
];

const CAMERA = { camera_theta_deg: 40, camera_phi_deg: 250, cloth_rotation_deg: 20 };

// The request for a picture (POST /v1/jobs/{id}/derive).
export function pictureRequest(shape, light, size) {
  const ground = shape.ground && light.ground ? { ground_gap_mm: 0.5, ground_albedo: 0.25 } : {};
  // without surroundings of its own a picture has none: those of the photographs would change the light that was chosen
  return { environment: { radiance: [0, 0, 0] }, ...light.job, pictures: [{ ...shape.more, ...CAMERA, ...light.picture, ...size.more, ...ground }] };
}

// The formats of exports, from the options of a job: the first sentence of their meaning in words.
export const formatsOf = (options) => options.filter((o) => o.kind === "boolean" && o.path.startsWith("export.")).map((o) => ({ id: o.path.split(".")[1], words: o.meaning.replaceAll("`", "") }));
