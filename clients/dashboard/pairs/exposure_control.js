// One exposure for all pairs, or an automatic one for each, and a slider that brightens or darkens either.
import { el } from "../page_parts.js";

const STOPS = 6;

export class ExposureControl {
  // shared: the exposure that all pairs have without the automatic one
  constructor(shared) {
    this.shared = shared;
    this.automatic = true;
    this.stops = 0;
    this.listeners = new Set();
    this.slider = el("input", { type: "range", id: "exposure-stops", min: -STOPS, max: STOPS, step: 0.1, value: 0, oninput: () => { this.stops = Number(this.slider.value); this.changed(); } });
    this.words = el("output", { id: "exposure-words" });
    const box = el("input", { type: "checkbox", id: "exposure-automatic", checked: true, onchange: () => { this.automatic = box.checked; this.changed(); } });
    const reset = el("button", { type: "button", onclick: () => { this.slider.value = "0"; this.stops = 0; this.changed(); } }, "Reset");
    this.node = el("div", { class: "exposure" }, el("label", {}, box, " Automatic exposure for each pair"), el("label", {}, "Exposure ", this.slider), this.words, reset);
    this.say();
  }

  // own: the automatic exposure of the pair
  of(own) { return (this.automatic && own ? own : this.shared) * 2 ** this.stops; }

  say() {
    const stops = `${this.stops > 0 ? "+" : this.stops < 0 ? "−" : ""}${Math.abs(this.stops).toFixed(1)} stops`;
    this.words.textContent = this.automatic ? stops : `${stops}, × ${Number(this.of(null).toPrecision(3))} for all pairs`;
  }

  changed() {
    this.say();
    for (const tell of this.listeners) tell();
  }
}
