// One cloth on a canvas, drawn when its state has changed: coarsely while it moves where the graphics card is slow, and sharply when it rests.
import { TwinScene } from "./twin_scene.js";

const SHARES = [1, 0.7, 0.5, 0.35, 0.25], FRAME_MS = 60, REST_MS = 160, MOST_MS = 1500;

export class TwinView {
  #canvas;
  #scene;
  #state;
  #waiting = 0;
  #resting = 0;
  #share = SHARES.length - 1; // of the pixels along an edge, while it moves; the first picture is to come soon
  #observer;
  #shown = null;

  // cloth: {description, buffer, whole?}; whole: a promise while only the first textures are in the buffer. Throws as TwinScene does.
  constructor(canvas, cloth, state) {
    this.#canvas = canvas;
    this.#state = state;
    this.#scene = new TwinScene(canvas, cloth.description, cloth.buffer, cloth.whole ? 1 : undefined);
    // not before the draft is on the screen
    Promise.all([cloth.whole, new Promise((done) => { this.#shown = done; })]).then(() => {
      if (!cloth.whole) return;
      this.#scene?.finish();
      this.draw();
    }).catch(() => {});
    this.#observer = new ResizeObserver(() => this.draw());
    this.#observer.observe(canvas);
  }

  pixels(state, edge) { return this.#scene.pixels(state, edge); }

  // A drawing of edge x edge as a file; the canvas is drawn as before afterwards.
  photograph(state, edge, type, quality) {
    this.#canvas.width = this.#canvas.height = edge;
    this.#scene.draw(state);
    return new Promise((done) => { this.#canvas.toBlob(done, type, quality); });
  }

  draw() {
    if (this.#waiting || !this.#scene) return;
    clearTimeout(this.#resting);
    this.#waiting = requestAnimationFrame(() => {
      this.#waiting = 0;
      const from = performance.now();
      this.#drawAt(SHARES[this.#share]);
      this.#scene.settle();
      const took = performance.now() - from;
      if (took > FRAME_MS) this.#share = Math.min(this.#share + 1, SHARES.length - 1);
      else if (took < FRAME_MS / 3) this.#share = Math.max(this.#share - 1, 0);
      this.#canvas.dataset.drawn = "draft";
      setTimeout(this.#shown);
      this.#resting = setTimeout(() => this.#rest(), REST_MS);
    });
  }

  #rest() {
    const from = performance.now();
    this.#drawAt(1);
    this.#scene?.settle();
    if (performance.now() - from > MOST_MS) this.#scene?.takeFewerFibers();
    this.#canvas.dataset.drawn = "whole";
  }

  #drawAt(share) {
    const c = this.#canvas, ratio = share * Math.min(2, devicePixelRatio), width = Math.round(ratio * c.clientWidth), height = Math.round(ratio * c.clientHeight);
    if (!this.#scene) return;
    if (width > 0 && (c.width !== width || c.height !== height)) { c.width = width; c.height = height; }
    this.#scene.draw(this.#state);
  }

  close() {
    this.#observer.disconnect();
    cancelAnimationFrame(this.#waiting);
    clearTimeout(this.#resting);
    this.#scene?.close();
    this.#scene = null;
  }
}
