// A drawing of lamp, camera and cloth for one photograph: x along the weft, y along the warp, z up.
import { el, svg } from "../page_parts.js";

const R = 92, WIDTH = 300, HEIGHT = 230, CENTER = [150, 150], STEPS = 48;

const rad = (deg) => (Number.isFinite(deg) ? deg : 0) * Math.PI / 180;
// Where a point of space is drawn.
const place = (p) => { const [x, y, z] = p; return [CENTER[0] + R * (x + 0.5 * y), CENTER[1] - R * (0.95 * z + 0.32 * y)]; };
const at = (theta, phi, r = 1) => [r * Math.sin(theta) * Math.cos(phi), r * Math.sin(theta) * Math.sin(phi), r * Math.cos(theta)];
const path = (points) => points.map((p, i) => `${i ? "L" : "M"}${place(p).map((v) => v.toFixed(1)).join(" ")}`).join("");
const turn = (make) => Array.from({ length: STEPS + 1 }, (_, i) => make(i / STEPS));

function where(theta, phi) {
  const t = Number(theta), p = ((Math.round(Number(phi)) % 360) + 360) % 360;
  if (theta === undefined || !Number.isFinite(t)) return "not given yet";
  if (Math.abs(t) < 0.05) return "straight above";
  const side = { 0: "on the side of +weft", 90: "on the side of +warp", 180: "on the side of −weft", 270: "on the side of −warp" }[p] ?? `towards ${p}°`;
  return `${t}° from straight above, ${side}${t > 90 ? ", below the cloth" : ""}`;
}

export function angleWords(p) {
  const turned = Number(p.cloth_rotation_deg ?? 0);
  return `Lamp ${where(p.light_theta_deg, p.light_phi_deg)}. Camera ${where(p.camera_theta_deg, p.camera_phi_deg)}. Cloth ${turned ? `turned by ${turned}°` : "not turned"}.`;
}

// An arm from the cloth to a thing, with an arc from straight above.
function arm(kind, word, theta, phi, sign) {
  const t = rad(theta), p = rad(phi), [x, y] = place(at(t, p));
  const left = kind === "camera" ? x > 60 : x > WIDTH - 50; // the lamp's name on its right, so that the names of neighbours do not meet
  const name = svg("text", { x: String(x + (left ? -12 : 12)), y: String(y - 8), "text-anchor": left ? "end" : "start" }, word);
  return svg("g", { class: kind }, svg("path", { class: "arc", d: path(turn((s) => at(s * t, p, 0.45))) }), svg("path", { class: "arm", d: path([[0, 0, 0], at(t, p)]) }),
    svg("g", { transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})` }, ...sign), name);
}

export class AngleDrawing {
  constructor() {
    this.picture = svg("svg", { class: "angles", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img" });
    this.words = el("figcaption", { class: "hint" });
    this.title = el("b", {});
    this.node = el("figure", { id: "angle-drawing" }, this.picture, el("div", {}, this.title), this.words);
  }

  // p: a photograph of the document, whose angles may be missing
  show(p) {
    const r = rad(p.cloth_rotation_deg), corner = (x, y) => [x * Math.cos(r) - y * Math.sin(r), x * Math.sin(r) + y * Math.cos(r), 0], half = 0.34;
    const square = [corner(-half, -half), corner(half, -half), corner(half, half), corner(-half, half), corner(-half, -half)];
    const threads = [-0.5, 0, 0.5].flatMap((s) => [path([corner(-half, s * half), corner(half, s * half)]), path([corner(s * half, -half), corner(s * half, half)])]).join("");
    const axis = (to, word) => { const [x, y] = place(to.map((v) => 1.2 * v)); return [svg("path", { class: "axis", d: path([[0, 0, 0], to]) }), svg("text", { x: String(x), y: String(y + 4), "text-anchor": "middle" }, word)]; };
    const words = angleWords(p);
    this.picture.setAttribute("aria-label", words);
    this.picture.replaceChildren(svg("path", { class: "ground", d: path(turn((s) => at(Math.PI / 2, 2 * Math.PI * s))) }),
      svg("path", { class: "dome", d: path(turn((s) => at(Math.PI * (s - 0.5), 0))) }), svg("path", { class: "dome", d: path(turn((s) => at(Math.PI * (s - 0.5), Math.PI / 2))) }),
      ...axis([1, 0, 0], "weft 0°"), ...axis([0, 1, 0], "warp 90°"), svg("path", { class: "cloth", d: path(square) }), svg("path", { class: "threads", d: threads }),
      arm("camera", "camera", p.camera_theta_deg, p.camera_phi_deg, [svg("rect", { x: "-9", y: "-6", width: "18", height: "12", rx: "2" }), svg("circle", { r: "3.4", class: "lens" })]),
      arm("lamp", "lamp", p.light_theta_deg, p.light_phi_deg, [svg("circle", { r: "8" })]));
    this.title.textContent = typeof p.file === "string" ? p.file : "";
    this.words.textContent = words;
  }
}
