// The card with the slices of a scan: any slice across any axis, densities or directions, centers and fibers drawn over it.
import { el } from "../page_parts.js";
import { MOST_BYTES } from "../fibers/hair_file.js";
import { SliceCanvas } from "./slice_canvas.js";
import { AXIS_COLOURS, directionOf, paint, pixelTable } from "./slice_colors.js";
import { SliceFile } from "./slice_file.js";
import { FILLED_COLOUR, FOUND_COLOUR, SliceFibers } from "./slice_fibers.js";

const AXES = ["x", "y", "z"], AHEAD = 3, FIBERS_AT_ONCE_BYTES = 40e6;
const css = (rgb) => `rgb(${rgb.map((x) => Math.round(255 * x)).join(",")})`;
const swatch = (color, text) => el("span", { class: "swatch" }, el("i", { style: `background:${color}` }), text);

class SliceView {
  // urls: of the files for x, y and z; fibers: SharedFibers, or null
  constructor(urls, fibers) {
    this.urls = urls;
    this.fibers = fibers;
    this.files = []; // of the axes that were looked at
    this.index = []; // of the fibers, for each of these axes
    this.axis = 2;
    this.at = [null, null, null]; // the slice of each axis
    this.forward = 1;
    this.busy = false;
    this.crossing = 0; // number of fibers that cross the slice
    this.point = this.rows = null;
    this.tables = {};
    this.stop = new AbortController();
    this.picture = document.createElement("canvas");
    this.canvas = new SliceCanvas({ paint: (context) => this.paint(context), step: (by) => this.step(by), pointed: (place) => { this.point = place; this.read(); } });
    this.makeControls();
    this.started = new IntersectionObserver((seen) => {
      if (!seen.some((s) => s.isIntersecting)) return;
      this.started.disconnect();
      this.turn(2);
    }, { rootMargin: "300px" });
    this.started.observe(this.canvas.node);
  }

  makeControls() {
    const button = (text, title, act) => el("button", { type: "button", title, "aria-label": title, onclick: act }, text);
    const check = (id, text) => el("label", {}, el("input", { type: "checkbox", id, onchange: () => this.show() }), text);
    this.axes = AXES.map((name, a) => el("button", { type: "button", onclick: () => this.turn(a), "aria-label": `slices across ${name}` }, name));
    this.slider = el("input", { type: "range", id: "slice-at", min: 0, value: 0, "aria-label": "slice", oninput: () => this.go(Number(this.slider.value)) });
    this.words = el("output", {}, "");
    this.colours = el("select", { id: "slice-colours", onchange: () => this.show() }, el("option", { value: "density" }, "density"), el("option", { value: "direction" }, "direction"));
    this.overlays = this.fibers && this.fibers.file.size <= MOST_BYTES ? [check("slice-centers", "centers"), check("slice-fibers", "fibers")] : [];
    if (this.overlays.length && this.fibers.file.size <= FIBERS_AT_ONCE_BYTES) this.overlays[0].firstChild.checked = true;
    this.legend = el("p", { class: "hint legend" });
    this.readout = el("p", { class: "mono", id: "slice-readout" });
    this.note = el("p", { class: "hint fault", role: "status" });
    this.node = el("div", { id: "slices", class: "slice-view", onkeydown: (event) => this.key(event) },
      el("div", { class: "tools" }, el("span", {}, "Across ", this.axes), el("label", { class: "at" }, this.slider, this.words),
        el("label", {}, "Colours ", this.colours), this.overlays, el("span", {}, button("+", "zoom in", () => this.canvas.zoomBy(1.5)), button("−", "zoom out", () => this.canvas.zoomBy(1 / 1.5)), button("Whole", "show the whole slice (0)", () => this.canvas.reset()))),
      this.canvas.node, this.readout, this.legend, this.note,
      el("p", { class: "hint" }, "Wheel, Page up and Page down (with Shift ten at once), or a sideways drag: other slices. + − 0, Ctrl with the wheel or two fingers: zoom; then drag and arrows move. Keys: X Y Z axis, D density or direction, C centers, F fibers, Home and End."));
  }

  get file() { return this.files[this.axis]; }

  checked(i) { return Boolean(this.overlays[i]?.firstChild.checked); }

  fail(error) {
    if (error.name === "AbortError" || this.stop.signal.aborted) return;
    this.note.textContent = error.message;
  }

  async turn(axis) {
    this.axis = axis;
    this.rows = null;
    this.axes.forEach((b, a) => { b.classList.toggle("main", a === axis); b.setAttribute("aria-pressed", String(a === axis)); });
    try {
      const file = this.files[axis] ??= await SliceFile.open(this.urls[axis], this.stop.signal);
      if (this.axis !== axis) return;
      this.slider.max = file.n - 1;
      this.canvas.fit(file.width, file.height, file.voxel[1] / file.voxel[0]);
      this.go(this.at[axis] ?? Math.floor(file.n / 2));
    } catch (error) { this.fail(error); }
  }

  step(by) { if (this.file) this.go(this.at[this.axis] + by); }

  go(slice) {
    if (!this.file) return;
    const to = Math.min(this.file.n - 1, Math.max(0, slice));
    this.forward = to < this.at[this.axis] ? -1 : 1;
    this.at[this.axis] = to;
    this.slider.value = to;
    const um = (to + 0.5) * this.file.voxel[2], words = `${to + 1} of ${this.file.n}, ${AXES[this.axis]} = ${um.toFixed(1)} µm`;
    this.words.textContent = words;
    this.slider.setAttribute("aria-valuetext", words);
    this.canvas.node.setAttribute("aria-label", `slice ${words}`);
    this.show();
  }

  // The level whose voxels are not smaller than a pixel, and its rows of tiles that can be seen.
  wanted() {
    const { file } = this, level = Math.min(file.nLevel - 1, Math.max(0, Math.floor(-Math.log2(this.canvas.scale) + 0.3)));
    const [low, high] = this.canvas.seen().map((v) => Math.floor(v / 2 ** level / file.edge));
    return { axis: this.axis, slice: this.at[this.axis], level, from: low, to: Math.min(high, file.levels[level].rows - 1) };
  }

  // Loads and draws the last request; requests that were replaced meanwhile are left out.
  async show() {
    if (!this.file || this.at[this.axis] === null) return;
    this.canvas.draw();
    if (this.busy) return;
    this.busy = true;
    try {
      for (let done = ""; ;) {
        const w = this.wanted(), byDirection = this.colours.value === "direction", key = JSON.stringify([w, byDirection, this.checked(0), this.checked(1)]);
        if (key === done) break;
        const file = this.files[w.axis], rows = await file.rows(w.slice, w.level, w.from, w.to);
        if (this.checked(0) || this.checked(1)) await this.needFibers(w.axis);
        if (w.axis === this.axis) this.take(w, rows, byDirection);
        done = key;
        await new Promise((next) => { requestAnimationFrame(next); });
      }
      this.note.textContent = "";
      this.ahead();
    } catch (error) { this.fail(error); }
    this.busy = false;
  }

  take(w, rows, byDirection) {
    const table = this.tables[byDirection] ??= pixelTable(this.file.densitySteps, this.file.directionSteps, byDirection);
    paint(this.picture, rows, table, this.file.densitySteps);
    this.rows = { ...w, rows };
    this.canvas.draw();
    this.explain(byDirection);
  }

  // Reads the next slices before they are asked for.
  ahead() {
    const { file } = this, w = this.wanted();
    for (let i = 1; i <= AHEAD; i++) {
      const slice = w.slice + i * this.forward;
      if (slice >= 0 && slice < file.n) file.rows(slice, w.level, w.from, w.to).catch(() => {});
    }
  }

  async needFibers(axis) {
    const file = this.files[axis];
    this.index[axis] ??= new SliceFibers(await this.fibers.load(), axis, file.n, file.voxel[2] / 1000);
  }

  paint(context) {
    if (!this.rows || this.rows.axis !== this.axis) return;
    if (JSON.stringify(this.wanted()) !== JSON.stringify({ ...this.rows, rows: undefined })) this.show(); // zoomed or moved
    const { file, canvas, picture } = this, { level, rows } = this.rows, zoom = 2 ** level, low = rows[0].y * zoom, high = low + picture.height * zoom;
    const [left, top] = canvas.place(0, high), [right, bottom] = canvas.place(picture.width * zoom, low);
    context.imageSmoothingEnabled = canvas.scale * zoom < 1.5; // large voxels stay squares
    context.drawImage(picture, left, top, right - left, bottom - top);
    const index = this.index[this.axis], overlays = { centers: this.checked(0), fibers: this.checked(1) };
    if (index && (overlays.centers || overlays.fibers)) {
      const mm = file.voxel.map((um) => um / 1000);
      this.crossing = index.draw(context, this.rows.slice, (u, v) => canvas.place(u / mm[0], v / mm[1]), canvas.scale / mm[0], overlays);
    }
    canvas.node.dataset.shown = `${AXES[this.axis]} ${this.rows.slice} ${level} ${this.colours.value}`;
    this.read();
  }

  explain(byDirection) {
    const index = this.index[this.axis], over = this.checked(0) || this.checked(1);
    this.legend.replaceChildren(
      ...(byDirection ? ["Direction: ", ...["x, weft", "y, warp", "z, through the cloth"].map((name, a) => swatch(css(AXIS_COLOURS[a]), name)), "grey: no fiber"] : ["Density: black 0, white 1"]),
      ...(over && index ? [swatch(FOUND_COLOUR, index.contrast ? "traced fiber that the scan shows" : "traced fiber"), ...(index.contrast ? [swatch(FILLED_COLOUR, "filled in: the scan does not show it clearly")] : []), "circles: the fiber's radius"] : []),
      ...(this.file.factor > 1 ? [`a voxel here is ${this.file.factor} voxels of the scan wide`] : []));
  }

  // The voxel under the pointer.
  read() {
    const { file, point } = this, inside = point && file && point.u >= 0 && point.v >= 0 && point.u < file.width && point.v < file.height;
    const over = this.crossing && (this.checked(0) || this.checked(1)) ? `${this.crossing} fibers cross this slice. ` : "";
    if (!inside || !this.rows) { this.readout.textContent = over || " "; return; }
    const { level, rows, slice } = this.rows, u = Math.floor(point.u / 2 ** level), v = Math.floor(point.v / 2 ** level), row = rows.find((r) => v >= r.y && v < r.y + r.height);
    const at = [0, 0, 0];
    [at[file.axis === 0 ? 1 : 0], at[file.axis === 2 ? 1 : 2], at[file.axis]] = [Math.floor(point.u), Math.floor(point.v), slice];
    const i = row ? (v - row.y) * row.width + u : -1, squares = row ? directionOf(row.direction[i], file.directionSteps) : null;
    const angles = squares ? `, ${AXES.map((name, a) => `${Math.round(Math.acos(Math.sqrt(squares[a])) * 180 / Math.PI)}° to ${name}`).join(", ")}` : ", no fiber";
    this.readout.textContent = `${over}voxel (${at.join(", ")}): ${row ? `density ${(row.density[i] / file.densitySteps).toFixed(2)}${angles}` : ""}`;
  }

  key(event) {
    if (event.target.matches("select") || event.ctrlKey || event.metaKey || event.altKey) return;
    const ten = event.shiftKey ? 10 : 1, { canvas } = this, onSlider = event.target === this.slider;
    const flip = (i) => () => { const box = this.overlays[i]?.firstChild; if (box) { box.checked = !box.checked; this.show(); } };
    const act = { PageUp: () => this.step(ten), PageDown: () => this.step(-ten), Home: () => this.go(0), End: () => this.go(Infinity), "+": () => canvas.zoomBy(1.5), "=": () => canvas.zoomBy(1.5), "-": () => canvas.zoomBy(1 / 1.5), 0: () => canvas.reset(),
      x: () => this.turn(0), y: () => this.turn(1), z: () => this.turn(2), c: flip(0), f: flip(1), d: () => { this.colours.selectedIndex = 1 - this.colours.selectedIndex; this.show(); } }[event.key.length === 1 ? event.key.toLowerCase() : event.key]
      ?? (onSlider ? null : { ArrowLeft: () => canvas.moveBy(-1, 0), ArrowRight: () => canvas.moveBy(1, 0), ArrowUp: () => canvas.moveBy(0, 1), ArrowDown: () => canvas.moveBy(0, -1) }[event.key]);
    if (!act) return;
    event.preventDefault();
    act();
  }

  close() {
    this.stop.abort();
    this.started.disconnect();
    this.canvas.close();
  }
}

// {box, close}, or null for a job whose results have no such files.
export function sliceView(files, fibers) {
  const found = AXES.map((name) => files.find((f) => f.path === `scan/${name}.slices`));
  if (found.some((f) => !f)) return null;
  const view = new SliceView(found.map((f) => f.url), fibers);
  return { box: view.node, close: () => view.close() };
}
