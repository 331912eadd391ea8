// The twin on the page of a job: loads its tables at once where they are small and the page is wide, else when the user
// asks for it, and offers the page to download.
import { el, size } from "../page_parts.js";
import { getJson, raw } from "../server_link.js";
import { twinPage } from "./twin_download.js";
import { TwinPanel, twinNote } from "./twin_panel.js";

const MOST_PHOTOGRAPHS = 12, AT_ONCE_BYTES = 8e6;
export const WIDE = "(min-width: 900px)";

// Rows with a photograph; theirs are the angles in the frame of the cloth, which the twin does not turn.
export function photographsOf(compared, cropMm, exposure) {
  return compared.filter((c) => c.measuredPicture && !c.angles.all_rotations).slice(0, MOST_PHOTOGRAPHS).map((c) => {
    const turn = c.angles.cloth_rotation_deg ?? 0;
    return { name: c.name, address: c.measuredPicture, width: cropMm, exposure, theta: c.angles.camera_theta_deg, phi: c.angles.camera_phi_deg - turn,
      lampTheta: c.angles.light_theta_deg, lampPhi: c.angles.light_phi_deg - turn };
  });
}

// The tables of a twin as TwinView takes them, as soon as enough is there for a draft. url(path): address of a file of its results.
export async function loadCloth(url) {
  const description = await getJson(url("twin/twin.json"));
  if (!/^selvedge-twin\.v[12]$/.test(description.format)) throw new Error(`its tables have the format ${description.format}`);
  const { view_edge: view, light_edge: light, sides, offset } = description.parts.table;
  const head = description.format === "selvedge-twin.v1" ? description.bytes : offset + 24 * (sides * view * light) ** 2;
  const bytes = new Uint8Array(description.bytes), reader = (await raw("GET", url("twin/twin.bin"))).body.getReader();
  let filled = 0;
  const fill = async (until) => {
    while (filled < until) {
      const { done, value } = await reader.read();
      if (done || filled + value.length > bytes.length) throw new Error("its tables are incomplete");
      bytes.set(value, filled);
      filled += value.length;
    }
  };
  await fill(head);
  return { description, buffer: bytes.buffer, whole: filled < bytes.length ? fill(bytes.length) : undefined };
}

async function load(job, files, compared) {
  const url = (path) => files.find((f) => f.path === path)?.url;
  const cloth = await loadCloth(url), result = job.result ?? {};
  const pictures = (result.pictures ?? []).map((p) => ({ name: `the cloth, ${p.on}`, address: url(p.file.replace(".exr", ".png")) })).filter((p) => p.address);
  const exposure = result.png_exposure ?? result.pictures?.[0]?.png_exposure ?? 1;
  return { ...cloth, exposure, pictures, photographs: photographsOf(compared, 10 * (job.document?.camera?.crop_cm ?? 1), exposure) };
}

// null when the job has no twin. {box, close}
export function twinCard(job, files, compared) {
  const tables = files.find((f) => f.path === "twin/twin.bin");
  if (!tables || !files.some((f) => f.path === "twin/twin.json")) return null;
  const box = el("div", { class: "twin" }), note = el("p", { class: "hint" });
  let panel = null, data = null;
  const save = async () => {
    await data.whole;
    const link = el("a", { href: URL.createObjectURL(await twinPage(data, (address) => raw("GET", address))), download: `twin-${job.id}.html` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };
  let left = false;
  const open = async () => {
    start.disabled = true;
    try {
      data = await load(job, files, compared);
      if (left) return;
      data.whole?.catch((error) => note.append(` It stays a draft: ${error.message}.`));
      panel = new TwinPanel(box, data);
      note.replaceChildren(`${twinNote(panel.works, data.description)} `, el("button", { id: "twin-save", onclick: save }, "Save as one HTML file"));
    } catch (error) {
      note.replaceChildren(`The twin cannot be shown: ${error.message}.`);
    }
  };
  const start = el("button", { id: "twin-open", onclick: open }, `Turn, bend and light the cloth (${size(tables.size)})`);
  note.append(start);
  if (tables.size <= AT_ONCE_BYTES && matchMedia(WIDE).matches) open();
  return { box: el("div", { id: "twin" }, box, note), close: () => { left = true; panel?.close(); } };
}
