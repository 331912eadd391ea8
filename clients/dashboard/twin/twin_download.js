// One HTML file that shows the twin without the service and without a network: the modules of this folder, the tables and
// the pictures are inside.

const MODULES = ["twin_program.js", "twin_near_shaders.js", "twin_shaders.js", "twin_shapes.js", "twin_lights.js", "twin_near.js", "twin_scene.js", "twin_view.js", "twin_turntable.js", "twin_panel.js"];

async function base64(blob) {
  const reader = new FileReader();
  await new Promise((done, failed) => { reader.onload = done; reader.onerror = failed; reader.readAsDataURL(blob); });
  return String(reader.result);
}

// Modules become one script: each name is defined in one of them only.
const asScript = (text) => text.replace(/^import .*$/gm, "").replace(/^export /gm, "");
const asJson = (value) => JSON.stringify(value).replaceAll("<", "\\u003c");
const escaped = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);

async function embedded(list, get) {
  return Promise.all(list.map(async (p) => ({ ...p, address: await base64(await (await get(p.address)).blob()) })));
}

// data as for TwinPanel; get(url) answers with a Response.
export async function twinPage(data, get) {
  const file = async (name) => (await get(new URL(name, import.meta.url).href)).text();
  const scripts = await Promise.all(MODULES.map(file)), style = await file("twin.css");
  const tables = await base64(new Blob([data.buffer]));
  const inside = { description: data.description, exposure: data.exposure, photographs: await embedded(data.photographs, get), pictures: await embedded(data.pictures, get) };
  const title = escaped(`${data.description.sample} – Selvedge`);
  return new Blob([`<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:">
<title>${title}</title><style>body { font: 15px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 1200px; padding: 0 1rem; }
${style}</style></head>
<body><h1>${title}</h1><div id="twin" class="twin"></div><p id="note"></p>
<script>
"use strict";
${scripts.map(asScript).join("\n")}
const tables = Uint8Array.from(atob("${tables.slice(tables.indexOf(",") + 1)}"), (c) => c.charCodeAt(0)).buffer;
const inside = ${asJson(inside)};
const panel = new TwinPanel(document.getElementById("twin"), { ...inside, buffer: tables });
document.getElementById("note").textContent = twinNote(panel.works, inside.description);
</script></body></html>
`], { type: "text/html" });
}
