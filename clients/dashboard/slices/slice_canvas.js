// A canvas on which a picture in voxels is zoomed and moved: by keys, drag and two fingers; the wheel and a sideways drag
// step through slices.
import { el } from "../page_parts.js";

const MOST_ZOOM = 64, WHEEL_STEP = 100, DRAG_STEP_PX = 8;
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

export class SliceCanvas {
  // paint(context) draws; step(by) goes on by slices; pointed(place) hears of {u, v} in voxels under the pointer, or null
  constructor({ paint, step, pointed }) {
    this.paint = paint;
    this.step = step;
    this.pointed = pointed;
    this.zoom = this.width = this.height = this.stretch = 1;
    this.u = this.v = 0; // the voxel in the middle
    this.asked = this.wheeled = 0;
    this.node = el("canvas", { class: "slice", tabIndex: 0, role: "img", "aria-label": "slices of the scan" });
    this.fingers = new Map();
    this.listen();
    this.resized = new ResizeObserver(() => this.draw());
    this.resized.observe(this.node);
  }

  // The size of a slice in voxels, and the height of a voxel over its width.
  fit(width, height, stretch) {
    this.width = width;
    this.height = height;
    this.stretch = stretch;
    this.reset();
  }

  reset() {
    this.zoom = 1;
    this.move(this.width / 2, this.height / 2);
  }

  // Pixels of the canvas for a voxel's width.
  get scale() { return this.zoom * Math.min(this.node.width / this.width, this.node.height / (this.height * this.stretch)); }

  // From voxels to pixels of the canvas, and from an event to voxels. Rows point upwards.
  place(u, v) { return [this.node.width / 2 + (u - this.u) * this.scale, this.node.height / 2 - (v - this.v) * this.scale * this.stretch]; }

  under(event) {
    const box = this.node.getBoundingClientRect(), dot = this.node.width / box.width;
    return { u: this.u + ((event.clientX - box.left) * dot - this.node.width / 2) / this.scale, v: this.v - ((event.clientY - box.top) * dot - this.node.height / 2) / (this.scale * this.stretch) };
  }

  // The rows of voxels that can be seen, from low to high.
  seen() {
    const half = this.node.height / 2 / (this.scale * this.stretch);
    return [clamp(Math.floor(this.v - half), 0, this.height - 1), clamp(Math.ceil(this.v + half), 1, this.height) - 1];
  }

  move(u, v) {
    const half = [this.node.width / 2 / this.scale, this.node.height / 2 / (this.scale * this.stretch)];
    const held = (x, n, h) => (2 * h >= n ? n / 2 : clamp(x, h, n - h));
    this.u = held(u, this.width, half[0]);
    this.v = held(v, this.height, half[1]);
    this.node.classList.toggle("whole", this.zoom === 1); // a finger then scrolls the page
    this.draw();
  }

  zoomBy(factor, at = { u: this.u, v: this.v }) {
    const before = this.zoom;
    this.zoom = clamp(this.zoom * factor, 1, MOST_ZOOM);
    const kept = before / this.zoom;
    this.move(at.u + (this.u - at.u) * kept, at.v + (this.v - at.v) * kept);
  }

  moveBy(right, up) { this.move(this.u + right * this.width / (8 * this.zoom), this.v + up * this.height / (8 * this.zoom)); }

  // Draws at the next frame.
  draw() {
    if (this.asked) return;
    this.asked = requestAnimationFrame(() => {
      this.asked = 0;
      const { node } = this, width = Math.max(1, Math.round(node.clientWidth * devicePixelRatio)), height = Math.max(1, Math.round(node.clientHeight * devicePixelRatio));
      if (node.width !== width || node.height !== height) {
        Object.assign(node, { width, height });
        this.move(this.u, this.v); // asks for another frame, which has nothing to do
      }
      const context = node.getContext("2d");
      context.clearRect(0, 0, width, height);
      this.paint(context);
    });
  }

  wheel(event) {
    event.preventDefault();
    const by = event.deltaY * (event.deltaMode === 1 ? 33 : 1);
    if (event.ctrlKey || event.metaKey) {
      this.zoomBy(Math.exp(-0.004 * by), this.under(event));
      return;
    }
    this.wheeled += by;
    const steps = Math.trunc(this.wheeled / WHEEL_STEP);
    this.wheeled -= steps * WHEEL_STEP;
    if (steps) this.step(steps);
  }

  // One finger or the mouse: moves the enlarged picture, or steps through slices when it is whole.
  drag(from, event) {
    if (this.zoom > 1) {
      const dot = this.node.width / this.node.clientWidth;
      this.move(this.u - (event.clientX - from.x) * dot / this.scale, this.v + (event.clientY - from.y) * dot / (this.scale * this.stretch));
      return { x: event.clientX, y: event.clientY };
    }
    const steps = Math.trunc((event.clientX - from.x) / DRAG_STEP_PX);
    if (steps) this.step(steps);
    return { x: from.x + steps * DRAG_STEP_PX, y: event.clientY };
  }

  // Two fingers: the place between them stays between them.
  pinch(event) {
    const between = () => {
      const [a, b] = [...this.fingers.values()];
      return { clientX: (a.x + b.x) / 2, clientY: (a.y + b.y) / 2, apart: Math.max(20, Math.hypot(a.x - b.x, a.y - b.y)) };
    };
    const before = between(), held = this.under(before);
    this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const after = between();
    this.zoomBy(after.apart / before.apart, held);
    const now = this.under(after);
    this.move(this.u + held.u - now.u, this.v + held.v - now.v);
  }

  listen() {
    const { node } = this;
    node.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    node.addEventListener("pointerdown", (event) => {
      node.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    node.addEventListener("pointermove", (event) => {
      const from = this.fingers.get(event.pointerId);
      if (from && this.fingers.size === 2) this.pinch(event);
      else if (from) this.fingers.set(event.pointerId, this.drag(from, event));
      this.pointed(this.under(event));
    });
    for (const end of ["pointerup", "pointercancel"]) node.addEventListener(end, (event) => this.fingers.delete(event.pointerId));
    node.addEventListener("pointerleave", () => this.pointed(null));
  }

  close() {
    this.resized.disconnect();
    cancelAnimationFrame(this.asked);
  }
}
