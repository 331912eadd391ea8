/* A page that shows exported glTF files by three.js, the viewer of most web pages. gltf_viewer.py serves it and calls the two functions that it
 * sets: window.renderRows(url, rows, px) and window.renderPicture(url, view, px). Numbers are linear radiances, without tone mapping. */
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const renderer = new THREE.WebGLRenderer({ antialias: false });
renderer.toneMapping = THREE.NoToneMapping;

function pixelsOf(scene, camera, width, height) {
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  renderer.setClearColor(0x000000, 0);
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  renderer.setRenderTarget(null);
  target.dispose();
  return pixels;
}

/* The file's own z is y of the cloth, turned: glTF has y up. */
const turned = ([x, y, z]) => new THREE.Vector3(x, z, -y);

function cameraOf(direction, up, halfWidth, halfHeight, distance) {
  const camera = new THREE.OrthographicCamera(-halfWidth, halfWidth, halfHeight, -halfHeight, 0.01 * distance, 10 * distance);
  camera.position.copy(direction.clone().normalize().multiplyScalar(distance));
  camera.up.copy(up);
  camera.lookAt(0, 0, 0);
  return camera;
}

/* A lamp that lights a white diffuser which faces it with radiance 1. */
function lampOf(direction) {
  const lamp = new THREE.DirectionalLight(0xffffff, Math.PI);
  lamp.position.copy(direction);
  return lamp;
}

/* One tile of the cloth as a square of edge 1, its upper side towards +y. */
function tileOf(material) {
  const geometry = new THREE.PlaneGeometry(1, 1).rotateX(-Math.PI / 2);
  geometry.setAttribute("tangent", new THREE.Float32BufferAttribute(Array(4).fill([1, 0, 0, 1]).flat(), 4));
  const uv = geometry.getAttribute("uv");
  for (let i = 0; i < uv.count; i++) uv.setY(i, 1 - uv.getY(i));
  return new THREE.Mesh(geometry, material);
}

async function load(url) {
  const gltf = await new GLTFLoader().loadAsync(url);
  let material = null;
  gltf.scene.traverse((thing) => { material = material ?? thing.material; });
  return { gltf, material };
}

/* What the second material lets through, as a Lambert surface: three.js does not know KHR_materials_diffuse_transmission. */
async function backOf(gltf) {
  const extension = gltf.parser.json.materials[1].extensions.KHR_materials_diffuse_transmission;
  const map = await gltf.parser.getDependency("texture", extension.diffuseTransmissionColorTexture.index);
  map.colorSpace = THREE.SRGBColorSpace;
  const material = new THREE.MeshLambertMaterial({ map });
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace("#include <map_fragment>",
      "#include <map_fragment>\ndiffuseColor.rgb *= sampledDiffuseColor.a; diffuseColor.a = 1.0;");
  };
  return material;
}

/* Mean over one tile, which the camera sees whole. */
function meanOf(material, lamp, direction, up, px) {
  const scene = new THREE.Scene();
  scene.add(tileOf(material), lampOf(lamp));
  const pixels = pixelsOf(scene, cameraOf(direction, up, 0.75, 0.75, 4), px, px), sum = [0, 0, 0, 0];
  for (let i = 0; i < pixels.length; i++) sum[i % 4] += pixels[i];
  return sum.slice(0, 3).map((x) => x / sum[3]);
}

window.renderRows = async (url, rows, px) => {
  const { gltf, material } = await load(url), back = await backOf(gltf), means = [];
  for (const row of rows) {
    const mean = [0, 0, 0], n = Math.min(row.rotations, 16);
    for (let k = 0; k < n; k++) {
      const axis = new THREE.Vector3(0, 1, 0), angle = (-2 * Math.PI * k) / n;
      const [lamp, camera, up] = [row.lamp, row.camera, row.up].map((v) => turned(v).applyAxisAngle(axis, angle));
      const behind = lamp.y < 0;
      if (behind) lamp.y = -lamp.y;
      meanOf(behind ? back : material, lamp, camera, up, px).forEach((x, c) => { mean[c] += x / n; });
    }
    means.push(mean);
  }
  return means;
};

/* view: lamp and camera as directions, and the width that is seen in millimetres. The file as it is, with the shadows of a lamp without size. */
window.renderPicture = async (url, view, px) => {
  const { gltf } = await load(url), scene = new THREE.Scene(), lamp = lampOf(turned(view.lamp).normalize()), reach = 0.05;
  renderer.shadowMap.enabled = true;
  lamp.castShadow = true;
  lamp.shadow.mapSize.set(2048, 2048);
  Object.assign(lamp.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.01, far: 2 });
  lamp.shadow.normalBias = 2e-4;
  lamp.position.multiplyScalar(0.5);
  gltf.scene.traverse((thing) => { thing.castShadow = thing.receiveShadow = Boolean(thing.isMesh); });
  for (const texture of gltf.parser.associations.keys()) if (texture.isTexture) texture.anisotropy = renderer.capabilities.getMaxAnisotropy();
  scene.add(gltf.scene, lamp);
  const half = (0.5 * view.width_mm) / 1000, camera = cameraOf(turned(view.camera), turned(view.up), half, half, 0.5);
  const pixels = pixelsOf(scene, camera, px, px), bytes = new Uint8Array(pixels.buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  return btoa(text);
};
window.isReady = true;
