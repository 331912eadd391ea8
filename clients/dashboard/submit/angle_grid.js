// Angles of the photographs of a new job: a grid that is filled by keys or pasted from a spreadsheet, with a drawing of the row under the cursor.
import { el } from "../page_parts.js";
import { ANGLES, guessPattern, patternFault, stemOf } from "./name_angles.js";
import { AngleDrawing } from "./angle_drawing.js";
import { readAngles } from "./written_document.js";

const HEADS = ["Lamp from above", "Lamp around", "Camera from above", "Camera around", "Cloth turned"];
const NEEDED = ANGLES.slice(0, 4).map(([key]) => key), STEEP_DEG = 5, LOW_DEG = 50;

const isPlaced = (p) => p?.view !== undefined || NEEDED.every((key) => typeof p[key] === "number") || p?.light_position_mm !== undefined;
export const unplaced = (doc) => (doc?.photographs ?? []).filter((p) => !isPlaced(p));

// A sentence when the lamp stays straight above and the camera goes far down, as nobody builds it; null otherwise.
export function exchangeFault(photographs) {
  const rows = photographs.filter((p) => NEEDED.every((key) => typeof p[key] === "number"));
  const angles = (key) => rows.map((p) => p[key]), lamps = angles("light_theta_deg"), cameras = angles("camera_theta_deg");
  if (rows.length < 2 || Math.max(...lamps.map(Math.abs)) > STEEP_DEG || Math.max(...cameras.map(Math.abs)) < LOW_DEG || new Set(cameras).size < 2) return null;
  return `In all ${rows.length} rows the lamp stays straight above, where it would stand before the camera, and the camera goes down to ${Math.max(...cameras.map(Math.abs))}°: are lamp and camera exchanged?`;
}

export class AngleGrid {
  // changed(doc) is called with the document after angles were changed
  constructor(changed) {
    this.changed = changed;
    this.drawing = new AngleDrawing();
    this.body = el("tbody");
    this.key = null;
    this.doc = null;
    this.pattern = null;
    this.names = el("input", { type: "text", class: "mono", spellcheck: false, onchange: () => this.read() });
    this.said = el("p", { class: "hint", role: "status" });
    this.warning = el("div", { class: "note hidden" });
    const all = (_, column) => el("th", {}, el("input", { type: "text", inputMode: "decimal", placeholder: "all", "aria-label": `${HEADS[column]}, all rows`, "data-column": column, onchange: (e) => this.fillColumn(column, e.target) }));
    this.node = el("section", { id: "angles", class: "card", hidden: true }, el("h2", {}, "Where lamp and camera stood"),
      el("label", { class: "pattern" }, "Angles in the names of the files, as ", this.names), this.said, this.warning,
      el("div", { class: "angle-columns" }, el("div", { class: "scroll wide", tabIndex: 0, role: "region", "aria-label": "angles of the photographs" },
        el("table", { class: "grid" }, el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "Photograph"), HEADS.map((words) => el("th", { scope: "col" }, words, " ", el("small", {}, "°")))),
          el("tr", { class: "all" }, el("td", {}, "every row"), ANGLES.map(all))), this.body)), this.drawing.node),
      el("p", { class: "hint" }, "Arrow keys and Enter go from cell to cell; a block of cells of a spreadsheet is pasted from the cell under the cursor on. ",
        el("button", { type: "button", onclick: () => this.exchange() }, "Exchange lamp and camera")));
    this.body.addEventListener("keydown", (e) => this.move(e));
    this.body.addEventListener("paste", (e) => this.paste(e));
    this.body.addEventListener("focusin", (e) => this.point(Number(e.target.dataset.row)));
    this.body.addEventListener("input", (e) => { e.target.dataset.typed = ""; });
    this.body.addEventListener("input", (e) => this.drawing.show({ ...this.doc.photographs[Number(e.target.dataset.row)], [ANGLES[Number(e.target.dataset.column)][0]]: Number(e.target.value.replace(",", ".")) }));
    this.body.addEventListener("change", (e) => { delete e.target.dataset.typed; this.put(Number(e.target.dataset.row), Number(e.target.dataset.column), e.target.value); this.changed(this.doc); });
    this.body.addEventListener("pointerover", (e) => { const row = e.target.closest("tr")?.dataset.row; if (row !== undefined && !this.body.contains(document.activeElement)) this.point(Number(row)); });
  }

  // The usual pattern that the names of all photographs fit, unless the user has given one.
  patternOf(names) { return this.pattern ?? guessPattern(names.map(stemOf)); }

  point(row) {
    this.row = row;
    if (this.doc?.photographs?.[row]) this.drawing.show(this.doc.photographs[row]);
  }

  cell(row, column) { return this.body.querySelector(`input[data-row="${row}"][data-column="${column}"]`); }

  // Sets an angle from text; one that is no number is taken away.
  put(row, column, text) {
    const photograph = this.doc.photographs[row], key = ANGLES[column]?.[0], value = Number(text.trim().replace(",", "."));
    if (!photograph || !key) return;
    if (text.trim() === "" || !Number.isFinite(value)) delete photograph[key]; else photograph[key] = value;
    delete photograph.view;
  }

  fillColumn(column, input) {
    this.doc.photographs.forEach((_, row) => this.put(row, column, input.value));
    input.value = "";
    this.changed(this.doc);
  }

  move(e) {
    const row = Number(e.target.dataset.row), column = Number(e.target.dataset.column), { selectionStart: from, selectionEnd: to, value } = e.target;
    const atEnd = from === value.length, atStart = to === 0, whole = from === 0 && to === value.length;
    const step = { ArrowUp: [-1, 0], ArrowDown: [1, 0], Enter: [e.shiftKey ? -1 : 1, 0], ArrowLeft: whole || atStart ? [0, -1] : null, ArrowRight: whole || atEnd ? [0, 1] : null }[e.key];
    const next = step ? this.cell(row + step[0], column + step[1]) : null;
    if (!next) return;
    e.preventDefault();
    next.focus();
    next.select();
  }

  paste(e) {
    const text = e.clipboardData?.getData("text/plain") ?? "", rows = text.replace(/\r/g, "").replace(/\n+$/, "").split("\n").map((line) => line.split(/[\t;]/));
    if (rows.length === 1 && rows[0].length === 1) return;
    e.preventDefault();
    const row = Number(e.target.dataset.row), column = Number(e.target.dataset.column);
    rows.forEach((cells, i) => cells.forEach((cell, k) => this.put(row + i, column + k, cell)));
    this.changed(this.doc);
  }

  exchange() {
    for (const p of this.doc.photographs) {
      [p.light_theta_deg, p.camera_theta_deg] = [p.camera_theta_deg, p.light_theta_deg];
      [p.light_phi_deg, p.camera_phi_deg] = [p.camera_phi_deg, p.light_phi_deg];
      for (const key of NEEDED) if (p[key] === undefined) delete p[key];
    }
    this.changed(this.doc);
  }

  // By the pattern that the user has written.
  read() {
    const pattern = this.names.value.trim(), fault = pattern === "" ? null : patternFault(pattern);
    this.pattern = pattern === "" || fault ? null : pattern;
    this.fault = fault;
    this.names.setAttribute("aria-invalid", String(fault !== null));
    if (this.pattern) this.fits = readAngles(this.doc, this.pattern);
    this.changed(this.doc);
  }

  // doc: the present document. hasRig: its views are chosen elsewhere.
  show(doc, hasRig) {
    const photographs = Array.isArray(doc?.photographs) ? doc.photographs : [];
    this.doc = doc;
    this.node.hidden = photographs.length === 0 || hasRig || photographs.some((p) => typeof p !== "object" || p === null);
    if (this.node.hidden) return;
    const key = JSON.stringify(photographs.map((p) => p.file));
    if (key !== this.key) {
      this.key = key;
      this.body.replaceChildren(...photographs.map((p, row) => el("tr", { "data-row": String(row) }, el("td", { class: "mono" }, p.file ?? ""),
        ANGLES.map((_, column) => el("td", {}, el("input", { type: "text", inputMode: "decimal", autocomplete: "off", "data-row": String(row), "data-column": String(column), "aria-label": `${HEADS[column]}, ${p.file ?? `row ${row + 1}`}` }))))));
    }
    photographs.forEach((p, row) => ANGLES.forEach(([name], column) => {
      const input = this.cell(row, column), text = p[name] === undefined ? "" : String(p[name]);
      if (input && input.value !== text && input.dataset.typed === undefined) input.value = text; // what is being typed stays
      if (input && column === 4) input.placeholder = "0";
    }));
    const guessed = this.patternOf(photographs.map((p) => p.file).filter((f) => typeof f === "string")), missing = unplaced(doc).length;
    if (document.activeElement !== this.names) this.names.value = this.pattern ?? guessed ?? "";
    this.names.placeholder = "t{light_theta}_p{light_phi}";
    this.said.className = this.fault ? "note bad" : "hint";
    this.said.textContent = this.fault ?? (this.pattern ? `${this.fits} of ${photographs.length} names fit.` : guessed ? "All names fit; an angle that a name does not say is 0, straight above."
      : missing ? `The names do not tell the angles: write how they are built, such as t{light_theta}_p{light_phi}, or fill in the ${missing} rows below.` : "");
    const exchanged = exchangeFault(photographs);
    this.warning.classList.toggle("hidden", exchanged === null);
    this.warning.textContent = exchanged ?? "";
    this.point(Math.min(this.row ?? 0, photographs.length - 1));
  }
}
