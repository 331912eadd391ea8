// Shows the reconstructed fibers in 3D (three.js) from the job's .hair file (docs/file-formats.md), when the user asks
// for it.
import { TRACED, coloursOf, waysToColour } from "./fibers/fiber_colors.js";
import { MOST_BYTES, parseHair } from "./fibers/hair_file.js";
import { el, size } from "./page_parts.js";

const MAX_SEGMENT = 400000;

// The group of a fiber is its colour, a corner of the cube: 7 - r - 2 g - 4 b.
const groupOf = (rgb, i) => 7 - Math.round(rgb[3 * i]) - 2 * Math.round(rgb[3 * i + 1]) - 4 * Math.round(rgb[3 * i + 2]);

// The axis along which a strand runs from its first to its last point: 0, 1, 2.
function axisOf(xyz, first, last) {
  const d = [0, 1, 2].map((c) => Math.abs(xyz[3 * last + c] - xyz[3 * first + c]));
  return d.indexOf(Math.max(...d));
}

// Returns, for each of the n segments that are shown: position, a Float32Array with x, y, z of both ends in millimetres,
// radius in millimetres, kind (the axis along which its fiber runs), group, or null in a file without groups, and contrast
// (100: as a scan shows a fiber), or null without a scan; also nStrand and nSegment of the file. contrast: of each point.
// Beyond MAX_SEGMENT segments some fibers are left out.
export function readHair(buffer, contrast = null) {
  const { nStrand, segments, xyz, thickness, thick, rgb } = parseHair(buffer);
  const nSegment = segments.reduce((a, b) => a + b, 0);
  const keep = Math.min(1, MAX_SEGMENT / Math.max(1, nSegment));
  const position = [], radius = [], kind = [], group = [], shown = [];
  let first = 0, due = 0;
  for (let i = 0; i < nStrand; i++) {
    due += keep;
    if (due >= 1) {
      due -= 1;
      const axis = axisOf(xyz, first, first + segments[i]);
      for (let k = first; k < first + segments[i]; k++) {
        for (let c = 0; c < 6; c++) position.push(xyz[3 * k + c]);
        radius.push(thickness ? (thickness[k] + thickness[k + 1]) / 4 : thick / 2);
        kind.push(axis);
        if (rgb) group.push(groupOf(rgb, k));
        if (contrast) shown.push((contrast[k] + contrast[k + 1]) / 2);
      }
    }
    first += segments[i] + 1;
  }
  return {
    position: new Float32Array(position), radius: new Float32Array(radius), kind: new Uint8Array(kind), group: rgb ? new Uint8Array(group) : null, contrast: contrast ? new Float32Array(shown) : null,
    n: radius.length, nStrand, nSegment, thinned: keep < 1,
  };
}

// Handles the mouse and touch: drag turns, wheel or pinch zooms, shift-drag moves.
function orbit(node, state, draw) {
  let last = null;
  node.addEventListener("pointerdown", (e) => { last = [e.clientX, e.clientY]; node.setPointerCapture(e.pointerId); });
  node.addEventListener("pointerup", () => { last = null; });
  node.addEventListener("pointermove", (e) => {
    if (!last) return;
    const dx = e.clientX - last[0], dy = e.clientY - last[1];
    last = [e.clientX, e.clientY];
    if (e.shiftKey) { state.panX -= dx * state.distance * 0.0015; state.panY += dy * state.distance * 0.0015; } else {
      state.phi -= 0.008 * dx;
      state.theta = Math.min(1.55, Math.max(0.02, state.theta - 0.008 * dy));
    }
    draw();
  });
  node.addEventListener("wheel", (e) => {
    e.preventDefault();
    state.distance *= Math.exp(0.001 * e.deltaY);
    draw();
  }, { passive: false });
}

function show(THREE, node, hair) {
  const renderer = new THREE.WebGLRenderer({ antialias: true });
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(35, 1, 0.001, 1000);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(hair.position, 3));
  geometry.computeBoundingSphere();
  const { center, radius } = geometry.boundingSphere;
  scene.add(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: THREE.VertexColors ?? true })));
  renderer.setClearColor(0x0d1116);
  node.replaceChildren(renderer.domElement);
  const state = { theta: 0.75, phi: -0.9, distance: 3.2 * radius, panX: 0, panY: 0 };
  const draw = () => {
    const w = node.clientWidth, h = node.clientHeight;
    renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    renderer.setSize(w, h, false);
    camera.aspect = w / h;
    camera.near = state.distance * 0.01;
    camera.far = state.distance + 4 * radius;
    camera.up.set(0, 0, 1);
    const s = Math.sin(state.theta), target = new THREE.Vector3(center.x + state.panX, center.y + state.panY, center.z);
    camera.position.set(target.x + state.distance * s * Math.cos(state.phi), target.y + state.distance * s * Math.sin(state.phi), target.z + state.distance * Math.cos(state.theta));
    camera.lookAt(target);
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
  };
  orbit(renderer.domElement, state, draw);
  const observer = new ResizeObserver(draw);
  observer.observe(node);
  return {
    close: () => { observer.disconnect(); geometry.dispose(); renderer.dispose(); },
    // colours and position: three numbers for each end of each segment
    paint: (colours, position) => {
      if (geometry.getAttribute("position").array !== position) geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
      geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
      draw();
    },
  };
}

// fibers: SharedFibers; traced: those that were traced in the scan, with its contrast, or null without a scan
export function fiberView(fibers, traced) {
  const { file } = fibers;
  let shown = null;
  const hint = el("div", { class: "hint" });
  const node = el("div", { class: "view3d" }, hint);
  const open = async () => {
    hint.replaceChildren("Loading ...");
    try {
      const [THREE, loaded] = await Promise.all([import("/vendor/three.module.js"), fibers.load()]);
      const hair = readHair(loaded.buffer, loaded.contrast);
      shown = show(THREE, node, hair);
      offerColours(hair);
      caption.textContent = `${hair.nStrand} fibers, ${hair.nSegment} segments${hair.thinned ? " (some of them are shown)" : ""}; drag turns, wheel zooms, shift-drag moves`;
    } catch (error) {
      hint.replaceChildren(`The 3D view is not available: ${error.message}. The slices above show the same fibers.`);
      if (!hint.isConnected) node.replaceChildren(hint);
    }
  };
  const caption = el("p", { class: "hint" }), colours = el("div", { class: "fiber-colours" });
  let seen = null; // the traced fibers
  const tracedHair = async () => {
    const { buffer, contrast } = await traced.load();
    if (!contrast) throw new Error("The contrast of the traced fibers is missing.");
    seen ??= readHair(buffer, contrast);
    return seen;
  };
  const offerColours = (hair) => {
    const ways = [...waysToColour(hair), ...(traced ? [TRACED] : [])], legend = el("span", { class: "legend" });
    const choose = el("select", { onchange: () => paint() }, ways.map(([name]) => el("option", {}, name)));
    const paint = async () => {
      const way = ways[choose.selectedIndex];
      try {
        const one = way === TRACED ? await tracedHair() : hair, made = coloursOf(one, way[1]);
        if (ways[choose.selectedIndex] !== way) return;
        shown.paint(made.colours, one.position);
        legend.replaceChildren(...made.legend.filter((part) => part !== null));
      } catch (error) { legend.replaceChildren(error.message); }
    };
    colours.replaceChildren(el("label", {}, "Colour by ", choose), legend);
    paint();
  };
  if (file.size > MOST_BYTES) hint.append(`The fiber file is too large for the browser (${size(file.size)}); download it instead.`);
  else hint.append(el("button", { onclick: open }, `Show the fibers in 3D (${size(file.size)})`));
  return { box: el("div", {}, node, colours, caption), close: () => shown?.close() };
}
