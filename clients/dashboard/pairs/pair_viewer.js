// One pair large: side by side, in turn (flicker) or as a difference, with zoom, pan and the values under the pointer.
import { el, percentWithError } from "../page_parts.js";
import { automaticExposure, draw, drawDifference, loadPicture, uniform, valueAt } from "./linear_picture.js";
import { PictureWindow } from "./picture_window.js";

const KEPT = 8, TURN_MS = 600, MODES = { beside: "Side by side", flicker: "Flicker", difference: "Difference" };
const triple = (rgb) => rgb.map((x) => (Number.isFinite(x) ? x.toPrecision(4) : "–")).join("  ");

export class PairViewer {
  constructor(list, exposure) {
    this.list = list;
    this.exposure = exposure;
    this.i = -1; // the row that is shown
    this.turn = 0; // of flicker: which of the two
    this.pictures = this.own = this.point = null;
    this.cache = new Map(); // url -> promise of the picture
    this.stop = new AbortController();
    this.title = el("h3", { id: "pair-title" });
    this.readout = el("p", { class: "mono", id: "pair-readout" });
    this.note = el("p", { class: "hint", role: "status", id: "pair-note" });
    this.buttons = Object.entries(MODES).map(([mode, text]) => el("button", { type: "button", value: mode, onclick: () => this.show(mode) }, text));
    this.block = el("select", { id: "difference-block", "aria-label": "difference of means over", onchange: () => this.draw() },
      [1, 4, 16].map((n) => el("option", { value: n }, n === 1 ? "of each pixel" : `of means over ${n} x ${n} pixels`)));
    const source = () => document.createElement("canvas");
    this.sources = [source(), source()];
    this.window = new PictureWindow(2, (point) => { this.point = point; this.read(); });
    const button = (text, title, act) => el("button", { type: "button", title, "aria-label": title, onclick: act }, text);
    this.node = el("div", { id: "pair-viewer", class: "viewer", hidden: true, onkeydown: (event) => this.key(event) },
      el("div", { class: "head" }, this.title, el("span", { class: "space" }), button("‹", "previous pair (Page up)", () => this.step(-1)), button("›", "next pair (Page down)", () => this.step(1)), button("×", "close (Escape)", () => this.hide())),
      el("div", { class: "tools" }, this.buttons, this.block, button("+", "zoom in", () => this.window.zoomBy(1.5)), button("−", "zoom out", () => this.window.zoomBy(1 / 1.5)), button("Whole", "show the whole picture (0)", () => this.window.reset())),
      this.window.node, this.readout, this.note);
    this.redraw = () => this.draw();
    exposure.listeners.add(this.redraw);
    this.show("beside");
  }

  async picture(url, mean) {
    if (!url) return mean ? uniform(mean) : uniform([NaN, NaN, NaN]);
    const known = this.cache.get(url) ?? loadPicture(url, this.stop.signal);
    this.cache.delete(url);
    this.cache.set(url, known);
    if (this.cache.size > KEPT) this.cache.delete(this.cache.keys().next().value);
    return known.catch((error) => { this.cache.delete(url); throw error; });
  }

  async open(i) {
    const c = this.list[i];
    this.i = i;
    this.pictures = null;
    this.node.hidden = false;
    this.title.replaceChildren(el("span", { class: "mono" }, c.name), c.held ? el("span", { class: "tag" }, "held out") : "", el("span", { class: "hint" }, ` relative error ${percentWithError(c.error, c.errorSe, 1)}`));
    this.note.textContent = "Loading ...";
    this.node.scrollIntoView({ block: "nearest" });
    this.window.node.focus({ preventScroll: true });
    try {
      const pictures = await Promise.all([this.picture(c.measuredLinear, c.measured), this.picture(c.renderedLinear, c.rendered)]);
      if (this.i !== i || this.stop.signal.aborted) return;
      this.pictures = pictures;
      this.own = automaticExposure(pictures);
      this.window.reset();
      this.show(this.mode);
    } catch (error) {
      if (this.i === i) this.note.textContent = error.message;
    }
  }

  step(by) { this.open((this.i + by + this.list.length) % this.list.length); }

  hide() {
    this.node.hidden = true;
    this.i = -1;
    clearInterval(this.timer);
  }

  show(mode) {
    this.mode = mode;
    clearInterval(this.timer);
    if (mode === "flicker") this.timer = setInterval(() => { this.turn = 1 - this.turn; this.draw(); }, TURN_MS);
    for (const b of this.buttons) { b.classList.toggle("main", b.value === mode); b.setAttribute("aria-pressed", String(b.value === mode)); }
    this.block.hidden = mode !== "difference";
    this.draw();
  }

  draw() {
    if (!this.pictures || this.node.hidden) return;
    const [measured, rendered] = this.pictures, exposure = this.exposure.of(this.own), c = this.list[this.i];
    const names = [c.measuredLinear ? "measured" : "measured (mean of the row)", c.renderedLinear ? "rendered" : "rendered (mean of the row)"];
    const used = `Exposure × ${Number(exposure.toPrecision(3))}. `;
    if (this.mode === "difference") {
      const full = 0.5 / exposure;
      this.window.show([drawDifference(this.sources[0], measured, rendered, Number(this.block.value), full)], ["rendered − measured"]);
      this.note.textContent = `${used}Orange: the rendering is brighter, blue: darker, white: equal; full colour from a difference of ${full.toPrecision(2)} on (mean of the channels). The rendering has no gain of the photograph and no light of the room.`;
    } else {
      const sources = [measured, rendered].map((p, k) => draw(this.sources[k], p, exposure));
      const shown = this.mode === "flicker" ? [this.turn] : [0, 1];
      this.window.show(shown.map((k) => sources[k]), shown.map((k) => names[k]));
      this.note.textContent = `${used}Wheel zooms, drag moves; keys: + − 0 and arrows, S side by side, F flicker, D difference, Page up and Page down other pairs.`;
    }
    this.read();
  }

  // The values under the pointer, or in the middle of the window.
  read() {
    if (!this.pictures) return;
    const { x, y } = this.point ?? this.window.middle(), [a, b] = this.pictures.map((p) => valueAt(p, x, y));
    const mean = (rgb) => (rgb[0] + rgb[1] + rgb[2]) / 3, apart = mean(b.rgb) / mean(a.rgb) - 1;
    this.readout.replaceChildren(el("span", {}, `measured (${a.u}, ${a.v})  ${triple(a.rgb)}`), el("span", {}, `rendered (${b.u}, ${b.v})  ${triple(b.rgb)}`),
      el("span", {}, Number.isFinite(apart) ? `${apart >= 0 ? "+" : "−"}${Math.abs(100 * apart).toFixed(1)} %` : ""), el("span", { class: "hint" }, `red, green, blue ${this.point ? "under the pointer" : "in the middle"}; 1 is a white diffuser that faces the lamp`));
  }

  key(event) {
    if (event.target.matches("select, input") || event.ctrlKey || event.metaKey || event.altKey) return;
    const modes = { s: "beside", f: "flicker", d: "difference" };
    const act = { PageUp: () => this.step(-1), PageDown: () => this.step(1), Escape: () => this.hide() }[event.key]
      ?? (modes[event.key.toLowerCase()] ? () => this.show(modes[event.key.toLowerCase()]) : this.window.keyAction(event.key));
    if (!act) return;
    event.preventDefault();
    act();
  }

  close() {
    this.stop.abort();
    clearInterval(this.timer);
    this.exposure.listeners.delete(this.redraw);
    this.window.close();
  }
}
