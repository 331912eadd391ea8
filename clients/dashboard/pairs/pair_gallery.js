// All pairs of a job as small pictures. They are loaded when they come into view and kept small, so that a change of the exposure draws
// them at once.
import { el, percentWithError } from "../page_parts.js";
import { PagedList } from "../paged_list.js";
import { automaticExposure, draw, loadPicture, thumbnail, uniform } from "./linear_picture.js";

const EDGE = 160, AT_ONCE = 3, SHOWN = window.innerWidth < 700 ? 6 : 18; // a phone has one column
const degrees = (x) => (typeof x === "number" ? `${Number(x.toFixed(1))}°` : "–");
const row = (name, value, title = "") => el("div", { class: "row", title }, el("span", {}, name), el("span", {}, value));

export class PairGallery {
  constructor(list, exposure, open) {
    this.exposure = exposure;
    this.waiting = [];
    this.busy = 0;
    this.stop = new AbortController();
    this.pairs = list.map((c, i) => this.card(c, i, open));
    this.node = el("div", { class: "gallery" });
    this.pages = new PagedList(this.node, this.pairs.map((p) => p.node), SHOWN, "pairs").pages;
    this.seen = new IntersectionObserver((entries) => {
      for (const e of entries.filter((x) => x.isIntersecting)) {
        this.seen.unobserve(e.target);
        this.waiting.push(this.pairs.find((p) => p.node === e.target));
      }
      this.work();
    }, { rootMargin: "200px" });
    for (const p of this.pairs) this.seen.observe(p.node);
    this.redraw = () => { for (const p of this.pairs) this.drawPair(p); };
    exposure.listeners.add(this.redraw);
  }

  card(c, i, open) {
    const canvases = ["measured", "rendered"].map((what) => el("canvas", { width: 1, height: 1, role: "img", "aria-label": `${c.name} ${what}` }));
    const used = el("span", {}, "–");
    const node = el("div", { class: c.held ? "pair held" : "pair" },
      el("button", { type: "button", class: "pictures", title: `Look closer at ${c.name}`, onclick: () => open(i) }, canvases),
      el("div", { class: "label" },
        el("div", { class: "row" }, el("b", {}, c.name), c.held ? el("span", { class: "tag" }, "held out") : null),
        row("light", `θ ${degrees(c.angles.light_theta_deg)}  φ ${degrees(c.angles.light_phi_deg)}`),
        row("camera", `θ ${degrees(c.angles.camera_theta_deg)}  φ ${degrees(c.angles.camera_phi_deg)}`),
        row("cloth turned", c.angles.all_rotations ? "mean over all" : degrees(c.angles.cloth_rotation_deg)),
        el("div", { class: "row" }, el("span", {}, "relative error"), el("span", { class: c.error > 0.15 ? "tag warn" : "" }, percentWithError(c.error, c.errorSe, 1))),
        el("div", { class: "row" }, el("span", {}, "exposure"), used)));
    return { c, node, canvases, used, pictures: null, own: null };
  }

  async work() {
    while (this.busy < AT_ONCE && this.waiting.length && !this.stop.signal.aborted) {
      const pair = this.waiting.shift();
      this.busy++;
      this.load(pair).finally(() => { this.busy--; this.work(); });
    }
  }

  // A picture without linear values is replaced by the mean of its row.
  async load(pair) {
    const { c } = pair;
    const one = async (url, mean) => {
      if (!url) return mean ? uniform(mean) : null;
      try { return thumbnail(await loadPicture(url, this.stop.signal), EDGE); } catch (error) {
        if (!this.stop.signal.aborted) pair.node.append(el("p", { class: "fault" }, error.message));
        return null;
      }
    };
    pair.pictures = [await one(c.measuredLinear, c.measured), await one(c.renderedLinear, c.rendered)];
    pair.own = automaticExposure(pair.pictures.filter(Boolean));
    if (!this.stop.signal.aborted) this.drawPair(pair);
  }

  drawPair(pair) {
    if (!pair.pictures) return;
    const exposure = this.exposure.of(pair.own);
    pair.pictures.forEach((picture, k) => { if (picture) draw(pair.canvases[k], picture, exposure); });
    pair.used.textContent = `× ${Number(exposure.toPrecision(3))}`;
  }

  close() {
    this.stop.abort();
    this.seen.disconnect();
    this.exposure.listeners.delete(this.redraw);
  }
}
