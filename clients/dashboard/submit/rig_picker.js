// Views of a rig in the form for a new job: which view each photograph shows, chosen from the views of the rig file
// (docs/photographs.md).
import { el } from "../page_parts.js";

// Places that a view states, so that a photograph with a view must not.
const STATED = ["light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "light_position_mm", "camera_position_mm"];

// The rig that a text describes; null when it is none.
export function rigOf(text) {
  try {
    const rig = JSON.parse(text);
    return rig?.selvedge_rig !== undefined ? rig : null;
  } catch { return null; }
}

const whereOf = (view) => [view?.lamp ? `lamp ${view.lamp}` : null, view?.camera ? `camera ${view.camera}` : "camera by markers",
  typeof view?.cloth_rotation_deg === "number" ? `cloth turned ${view.cloth_rotation_deg}°` : null].filter(Boolean).join(", ");

// changed(doc) is called with the document after a view was chosen.
export class RigPicker {
  constructor(changed) {
    this.node = el("div", { id: "rig-picker", hidden: true });
    this.changed = changed;
    this.name = null;
    this.rig = null;
    this.key = null;
  }

  // The file of the rig, by its name in the document.
  use(name, rig) { this.name = name; this.rig = rig; }

  choose(doc, i, view) {
    const photograph = doc.photographs[i];
    if (view === "") delete photograph.view;
    else {
      photograph.view = view;
      for (const key of STATED) delete photograph[key];
      if (typeof this.rig.views[view]?.cloth_rotation_deg === "number") delete photograph.cloth_rotation_deg;
      doc.rig = { ...doc.rig, file: this.name };
    }
    this.changed(doc);
  }

  // doc: the present document, or null. locked: a sentence why it cannot be changed here, or null.
  show(doc, locked) {
    const views = Object.entries(this.rig?.views ?? {}), photographs = Array.isArray(doc?.photographs) ? doc.photographs : [];
    const key = JSON.stringify([this.name, this.rig, photographs, doc?.rig, locked]);
    if (key === this.key) return;
    this.key = key;
    this.node.hidden = this.rig === null;
    if (this.rig === null) return;
    const focused = this.node.contains(document.activeElement) ? document.activeElement?.getAttribute("data-photograph") : null;
    const row = (p, i) => {
      const known = views.some(([name]) => name === p?.view);
      const select = el("select", { "data-photograph": String(i), disabled: locked !== null, "aria-label": `view of ${p?.file ?? `photograph ${i}`}`, onchange: () => this.choose(doc, i, select.value) },
        el("option", { value: "" }, "no view: places in the document"),
        p?.view && !known ? el("option", { value: p.view, selected: true }, `${p.view} (not in this rig)`) : null,
        views.map(([name, view]) => el("option", { value: name, selected: name === p?.view }, `${name}: ${whereOf(view)}`)));
      return el("tr", {}, el("td", { class: "mono" }, p?.file ?? ""), el("td", {}, select, p?.view && !known ? el("span", { class: "tag bad" }, "no such view") : null));
    };
    const words = locked ?? (views.length === 0 ? "This rig describes no views." : photographs.length === 0 ? "Its views can be chosen here when the document has photographs."
      : doc.rig?.file && doc.rig.file !== this.name ? `The document names another rig, '${doc.rig.file}'; choosing a view puts this one in its place.` : "A view replaces the angles and positions of its photograph.");
    this.node.replaceChildren(el("h3", {}, "Rig ", el("span", { class: "mono" }, this.name), ` with ${views.length} views`), el("p", { class: "hint" }, words),
      ...(photographs.length && views.length ? [el("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": "views of the rig" }, el("table", {}, el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "Photograph"), el("th", { scope: "col" }, "View"))), el("tbody", {}, photographs.map(row))))] : []));
    const again = this.node.querySelector(`[data-photograph="${focused}"]`);
    if (again instanceof HTMLElement) again.focus();
  }
}
