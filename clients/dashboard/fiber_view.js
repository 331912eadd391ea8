// Shows the reconstructed fibers in 3D (three.js) from the job's .hair file (docs/file-formats.md), when the user asks
// for it.
import { el, size } from "./page_parts.js";
import { raw } from "./server_link.js";

const MAX_SEGMENT = 400000, MAX_BYTES = 200 << 20;

// Returns {position, n, ...}: position is a Float32Array with x, y, z of both ends of every segment in millimetres.
// Beyond MAX_SEGMENT segments some fibers are left out.
export function readHair(buffer) {
  const view = new DataView(buffer);
  const magic = String.fromCharCode(...new Uint8Array(buffer, 0, 4));
  if (buffer.byteLength < 128 || magic !== "HAIR") throw new Error("not a .hair file");
  const nStrand = view.getUint32(4, true), nPoint = view.getUint32(8, true), flags = view.getUint32(12, true), nDefault = view.getUint32(16, true);
  let at = 128;
  const segments = new Uint32Array(nStrand);
  for (let i = 0; i < nStrand; i++) segments[i] = flags & 1 ? view.getUint16(at + 2 * i, true) : nDefault;
  if (flags & 1) at += 2 * nStrand;
  if (!(flags & 2) || at + 12 * nPoint > buffer.byteLength) throw new Error("the .hair file is incomplete");
  const xyz = new Float32Array(buffer.slice(at, at + 12 * nPoint));
  const nSegment = segments.reduce((a, b) => a + b, 0);
  const keep = Math.min(1, MAX_SEGMENT / Math.max(1, nSegment));
  const position = [];
  let first = 0, due = 0;
  for (let i = 0; i < nStrand; i++) {
    due += keep;
    if (due >= 1) {
      due -= 1;
      for (let k = first; k < first + segments[i]; k++) for (let c = 0; c < 6; c++) position.push(xyz[3 * k + c]);
    }
    first += segments[i] + 1;
  }
  return { position: new Float32Array(position), n: position.length / 6, nStrand, nSegment, thinned: keep < 1 };
}

// Colours segments by direction (x warm, y cool, z green), shaded by height.
function colours(position) {
  const out = new Float32Array(position.length);
  let low = Infinity, high = -Infinity;
  for (let i = 2; i < position.length; i += 3) { low = Math.min(low, position[i]); high = Math.max(high, position[i]); }
  for (let s = 0; s < position.length; s += 6) {
    const d = [0, 1, 2].map((c) => Math.abs(position[s + 3 + c] - position[s + c]));
    const n = Math.hypot(...d) || 1;
    const [x, y, z] = d.map((v) => (v / n) ** 2);
    const base = [0.98 * x + 0.38 * y + 0.35 * z, 0.76 * x + 0.66 * y + 0.85 * z, 0.40 * x + 0.93 * y + 0.45 * z];
    for (const e of [0, 3]) {
      const shade = 0.25 + 0.75 * ((position[s + e + 2] - low) / (high - low || 1));
      for (let c = 0; c < 3; c++) out[s + e + c] = base[c] * shade;
    }
  }
  return out;
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
  geometry.setAttribute("color", new THREE.BufferAttribute(colours(hair.position), 3));
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
  return () => { observer.disconnect(); geometry.dispose(); renderer.dispose(); };
}

export function fiberView(file) {
  let close = null;
  const hint = el("div", { class: "hint" });
  const node = el("div", { class: "view3d" }, hint);
  const open = async () => {
    hint.replaceChildren("Loading ...");
    try {
      const [THREE, answer] = await Promise.all([import("/vendor/three.module.js"), raw("GET", file.url)]);
      const hair = readHair(await answer.arrayBuffer());
      close = show(THREE, node, hair);
      caption.textContent = `${hair.nStrand} fibers, ${hair.nSegment} segments${hair.thinned ? " (some of them are shown)" : ""}; drag turns, wheel zooms, shift-drag moves`;
    } catch (error) {
      hint.replaceChildren(`The 3D view is not available: ${error.message}. The slices above show the same fibers.`);
      if (!hint.isConnected) node.replaceChildren(hint);
    }
  };
  const caption = el("p", { class: "hint" });
  if (file.size > MAX_BYTES) hint.append(`The fiber file is too large for the browser (${size(file.size)}); download it instead.`);
  else hint.append(el("button", { onclick: open }, `Show the fibers in 3D (${size(file.size)})`));
  return { box: el("div", {}, node, caption), close: () => close?.() };
}
