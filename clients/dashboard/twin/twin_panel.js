// Twins under the mouse: a drawing of each cloth with the same camera and light, their controls, and a photograph beside them. Stands alone:
// the page that is downloaded has no other part of the dashboard.
import { direction, environmentNames } from "./twin_lights.js";
import { shapeNames } from "./twin_shapes.js";
import { turntable } from "./twin_turntable.js";
import { TwinView } from "./twin_view.js";

const START = { shape: "drape", theta: 50, phi: 250, width: 42, center: [0, 0, 0], lampTheta: 50, lampPhi: 200, lampPower: 1, environment: "studio", exposure: 1 };

function node(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else made.setAttribute(key, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

const REACH = 40; // mm, of the point that the camera looks at

const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// How far the tables of a twin can be trusted, in percent.
export function twinError({ mean_rel_rms: rms, mean_rel_noise: noise }) {
  return `${(100 * Math.sqrt(Math.max(rms ** 2 - noise ** 2, 0))).toFixed(1)} %`;
}

// Notes for the reader of the drawing: how it is moved, and how far it can be trusted.
export function twinNote(works, description, error = twinError(description)) {
  return !works ? "" : "Drag turns, shift and drag moves the lamp, the wheel zooms. " +
    `Mean radiances of the flat cloth differ from path tracing by ${error} up to 70° from its normal, and by more beyond. Shadows are those of the lamp only, and light between folds is left out.`;
}

export class TwinPanel {
  #views = [];
  #state = { ...START };
  #controls = new Map();
  #photo = node("figure", { class: "twin-photo", hidden: "" });

  // data: {cloths: [{description, buffer, name?, whole?}] (TwinView), exposure, photographs: [{name, address, theta, phi, lampTheta, lampPhi,
  // width}], pictures: [{name, address}]}; a single cloth may be in data itself.
  constructor(box, data) {
    this.#state.exposure = data.exposure ?? 1;
    const cloths = data.cloths ?? [data], side = node("div", { class: "twin-side" });
    try {
      for (const cloth of cloths) {
        const canvas = node("canvas", { class: "twin-view", width: 640, height: 640, tabindex: 0, "aria-label": `the cloth${cloth.name ? ` of ${cloth.name}` : ""}; drag turns it, shift and drag moves the lamp, the wheel zooms` });
        this.#views.push(new TwinView(canvas, cloth, this.#state));
        side.append(cloth.name ? node("figure", { class: "twin-figure" }, canvas, node("figcaption", {}, cloth.name)) : canvas);
        this.#listen(canvas);
        Object.assign(canvas, { twin: this }); // for programs that look at the page
      }
    } catch (error) {
      this.close();
      box.append(node("p", { class: "hint" }, `The cloth cannot be turned here: ${error.message}. These are pictures of it.`),
        node("div", { class: "twin-pictures" }, ...data.pictures.map((p) => node("img", { src: p.address, alt: p.name }))));
      return;
    }
    side.append(this.#photo);
    box.append(side, this.#makeControls(data));
  }

  get works() { return this.#views.length > 0; }

  // Changes a part of the state and draws.
  show(change) {
    Object.assign(this.#state, change);
    for (const [key, control] of this.#controls) control.value = String(key === "exposure" ? Math.log2(this.#state.exposure) : this.#state[key]);
    this.draw();
  }

  // Of a cloth, as TwinScene has them.
  pixels(change, edge, cloth = 0) { return this.#views[cloth].pixels({ ...this.#state, ...change }, edge); }

  draw() { for (const view of this.#views) view.draw(); }

  // Zooms towards the place of the canvas that an event of the pointer is over.
  #zoom(canvas, event, factor) {
    const s = this.#state, width = clamp(s.width * factor, 0.5, 120), box = canvas.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width - 0.5, y = (0.5 - (event.clientY - box.top) / box.height) * box.height / box.width;
    this.#move((s.width - width) * x, (s.width - width) * y);
    this.show({ width: width });
  }

  // Moves the point that the camera looks at to the right and upwards in the picture, mm.
  #move(right, up) {
    const s = this.#state, p = s.phi * Math.PI / 180, above = direction(s.theta - 90, s.phi);
    s.center = s.center.map((x, a) => clamp(x + right * [-Math.sin(p), Math.cos(p), 0][a] + up * above[a], -REACH, REACH));
  }

  #slider(key, text, low, high) {
    const input = node("input", { type: "range", min: low, max: high, step: "any", oninput: () => {
      this.#state[key] = key === "exposure" ? 2 ** Number(input.value) : Number(input.value);
      this.draw();
    } });
    this.#controls.set(key, input);
    return node("label", {}, text, input);
  }

  #choice(key, text, names) {
    const select = node("select", { onchange: () => { this.#state[key] = select.value; this.draw(); } }, ...names.map((n) => node("option", { value: n }, n)));
    this.#controls.set(key, select);
    return node("label", {}, text, select);
  }

  #makeControls(data) {
    const made = node("div", { class: "twin-controls" },
      this.#choice("shape", "Shape", shapeNames), this.#choice("environment", "Surroundings", environmentNames),
      this.#slider("lampTheta", "Lamp from the vertical", 0, 180), this.#slider("lampPhi", "Lamp around", -180, 360),
      this.#slider("lampPower", "Lamp strength", 0, 2), this.#slider("exposure", "Exposure", -4, 6),
      data.photographs.length ? this.#photographs(data.photographs) : null,
      node("button", { type: "button", onclick: () => this.show({ ...START, exposure: data.exposure ?? 1 }) }, "Start view"),
      this.#turntable());
    this.show({});
    return made;
  }

  // The button that saves the first cloth as it turns once.
  #turntable() {
    const words = "Save a turn as WebP", button = node("button", { type: "button", class: "twin-turn", onclick: async () => {
      button.disabled = true;
      try {
        const file = await turntable(this.#views[0], this.#state, (share) => { button.textContent = `Turning: ${Math.round(100 * share)} %`; });
        const link = node("a", { href: URL.createObjectURL(file), download: "turntable.webp" });
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 60000);
        button.textContent = words;
      } catch (error) {
        button.textContent = `No turn was saved: ${error.message}`;
      }
      button.disabled = false;
      this.draw();
    } }, words);
    return button;
  }

  // The file of that button, smaller and with fewer frames.
  turn(edge, frames) { return turntable(this.#views[0], this.#state, () => {}, edge, frames).finally(() => this.draw()); }

  // Choosing a photograph shows it, and the flat cloth with its lamp and camera.
  #photographs(list) {
    const select = node("select", { onchange: () => {
      const chosen = list.find((p) => p.name === select.value);
      this.#photo.hidden = !chosen;
      if (!chosen) return;
      this.#photo.replaceChildren(node("img", { src: chosen.address, alt: chosen.name }), node("figcaption", {}, `photograph ${chosen.name}; beside it the twin with the same lamp and camera`));
      const { theta, phi, lampTheta, lampPhi, width } = chosen;
      this.show({ shape: "flat", environment: "lamp only", lampPower: 1, center: [0, 0, 0], theta, phi, lampTheta, lampPhi, width, exposure: chosen.exposure });
    } }, node("option", { value: "" }, "none"), ...list.map((p) => node("option", { value: p.name }, p.name)));
    return node("label", {}, "Beside a photograph", select);
  }

  #listen(c) {
    let last = null;
    const touches = new Map();
    c.addEventListener("contextmenu", (e) => e.preventDefault());
    c.addEventListener("pointerdown", (e) => { last = [e.clientX, e.clientY]; touches.set(e.pointerId, last); c.setPointerCapture(e.pointerId); });
    for (const end of ["pointerup", "pointercancel"]) c.addEventListener(end, (e) => { touches.delete(e.pointerId); last = null; });
    c.addEventListener("pointermove", (e) => {
      const was = touches.get(e.pointerId);
      if (!was || !last) return;
      const dx = e.clientX - was[0], dy = e.clientY - was[1], s = this.#state;
      if (touches.size === 2) {
        const other = [...touches].find(([id]) => id !== e.pointerId)[1], before = Math.hypot(was[0] - other[0], was[1] - other[1]);
        this.#zoom(c, { clientX: other[0], clientY: other[1] }, before / Math.max(1, Math.hypot(e.clientX - other[0], e.clientY - other[1])));
      } else if (e.shiftKey || e.buttons & 2) {
        s.lampPhi = (s.lampPhi + 0.4 * dx + 540) % 360 - 180;
        s.lampTheta = clamp(s.lampTheta + 0.4 * dy, 0, 180);
      } else {
        s.phi = (s.phi - 0.4 * dx + 360) % 360;
        s.theta = clamp(s.theta - 0.4 * dy, 0, 89);
      }
      touches.set(e.pointerId, [e.clientX, e.clientY]);
      this.show({});
    });
    c.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.#zoom(c, e, Math.exp(0.001 * e.deltaY));
    }, { passive: false });
  }

  close() { for (const view of this.#views.splice(0)) view.close(); }
}
