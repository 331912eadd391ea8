// Canvases that show the same part of several pictures: zoom and pan by wheel, drag and keys.
import { el } from "../page_parts.js";

const MOST = 64, SHIFT = 0.1;
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

export class PictureWindow {
  // pointed(point) hears where the pointer is in the picture, {x, y} of 0..1 each, or null
  constructor(n, pointed) {
    this.zoom = 1;
    this.x = this.y = 0.5; // the place in the middle
    this.sources = [];
    this.pointed = pointed;
    this.panes = Array.from({ length: n }, () => {
      const canvas = el("canvas", { role: "img" }), caption = el("figcaption");
      this.listen(canvas);
      return { canvas, caption, node: el("figure", {}, canvas, caption) };
    });
    this.node = el("div", { class: "window", tabIndex: 0, role: "group", "aria-label": "the pair of pictures" }, this.panes.map((p) => p.node));
    this.resized = new ResizeObserver(() => this.draw());
    this.resized.observe(this.node);
  }

  listen(canvas) {
    let from = null;
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomBy(1.2 ** (event.deltaY < 0 ? 1 : -1), this.place(canvas, event));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      from = { left: event.clientX, top: event.clientY, x: this.x, y: this.y };
    });
    canvas.addEventListener("pointermove", (event) => {
      if (from) this.move(from.x - (event.clientX - from.left) / canvas.clientWidth / this.zoom, from.y - (event.clientY - from.top) / canvas.clientHeight / this.zoom);
      this.pointed(this.place(canvas, event));
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { from = null; });
    canvas.addEventListener("pointerleave", () => this.pointed(null));
  }

  middle() { return { x: this.x, y: this.y }; }

  place(canvas, event) {
    const box = canvas.getBoundingClientRect(), at = (share, middle) => clamp(middle + (share - 0.5) / this.zoom, 0, 1);
    return { x: at((event.clientX - box.left) / box.width, this.x), y: at((event.clientY - box.top) / box.height, this.y) };
  }

  move(x, y) {
    const half = 0.5 / this.zoom;
    this.x = clamp(x, half, 1 - half);
    this.y = clamp(y, half, 1 - half);
    this.draw();
  }

  // Keeps the place under the pointer where it is.
  zoomBy(factor, place = this.middle()) {
    const before = this.zoom;
    this.zoom = clamp(this.zoom * factor, 1, MOST);
    const kept = before / this.zoom;
    this.move(place.x + (this.x - place.x) * kept, place.y + (this.y - place.y) * kept);
  }

  reset() {
    this.zoom = 1;
    this.move(0.5, 0.5);
  }

  keyAction(key) {
    const by = SHIFT / this.zoom, moves = { ArrowLeft: [-by, 0], ArrowRight: [by, 0], ArrowUp: [0, -by], ArrowDown: [0, by] };
    if (moves[key]) return () => { this.move(this.x + moves[key][0], this.y + moves[key][1]); this.pointed(null); };
    return { "+": () => this.zoomBy(1.5), "=": () => this.zoomBy(1.5), "-": () => this.zoomBy(1 / 1.5), 0: () => this.reset() }[key] ?? null;
  }

  show(sources, names) {
    this.sources = sources;
    this.panes.forEach((p, k) => {
      p.node.hidden = k >= sources.length;
      if (p.node.hidden) return;
      p.caption.textContent = names[k];
      p.canvas.setAttribute("aria-label", names[k]);
    });
    this.draw();
  }

  draw() {
    this.sources.forEach((source, k) => {
      const { canvas } = this.panes[k], largest = this.sources.reduce((a, b) => (b.width > a.width ? b : a));
      const width = Math.max(1, Math.round(canvas.clientWidth * devicePixelRatio)), height = Math.max(1, Math.round(width * largest.height / largest.width));
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      canvas.classList.toggle("whole", this.zoom === 1); // a finger then scrolls the page
      const context = canvas.getContext("2d"), w = source.width / this.zoom, h = source.height / this.zoom;
      context.imageSmoothingEnabled = w > width; // pixels stay squares when they are larger than the screen's
      context.drawImage(source, this.x * source.width - w / 2, this.y * source.height - h / 2, w, h, 0, 0, width, height);
    });
  }

  close() { this.resized.disconnect(); }
}
