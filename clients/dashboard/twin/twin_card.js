// The twin on the page of a job: loads its tables at once where they are small and the page is wide, else when the user
// asks for it, and offers the page to download.
import { el, size } from "../page_parts.js";
import { getJson, raw } from "../server_link.js";
import { twinPage } from "./twin_download.js";
import { TwinPanel, twinNote } from "./twin_panel.js";

const MOST_PHOTOGRAPHS = 12, AT_ONCE_BYTES = 8e6, WIDE = "(min-width: 900px)";

// Rows with a photograph; theirs are the angles in the frame of the cloth, which the twin does not turn.
function photographsOf(compared, cropMm, exposure) {
  return compared.filter((c) => c.measuredPicture && !c.angles.all_rotations).slice(0, MOST_PHOTOGRAPHS).map((c) => {
    const turn = c.angles.cloth_rotation_deg ?? 0;
    return { name: c.name, address: c.measuredPicture, width: cropMm, exposure, theta: c.angles.camera_theta_deg, phi: c.angles.camera_phi_deg - turn,
      lampTheta: c.angles.light_theta_deg, lampPhi: c.angles.light_phi_deg - turn };
  });
}

async function load(job, files, compared) {
  const url = (path) => files.find((f) => f.path === path)?.url;
  const description = await getJson(url("twin/twin.json"));
  if (description.format !== "selvedge-twin.v1") throw new Error(`its tables have the format ${description.format}`);
  const buffer = await (await raw("GET", url("twin/twin.bin"))).arrayBuffer(), result = job.result ?? {};
  if (buffer.byteLength !== description.bytes) throw new Error("its tables are incomplete");
  const pictures = (result.pictures ?? []).map((p) => ({ name: `the cloth, ${p.on}`, address: url(p.file.replace(".exr", ".png")) })).filter((p) => p.address);
  const exposure = result.png_exposure ?? result.pictures?.[0]?.png_exposure ?? 1;
  return { description, buffer, exposure, pictures, photographs: photographsOf(compared, 10 * (job.document?.camera?.crop_cm ?? 1), exposure) };
}

// null when the job has no twin. {box, close}
export function twinCard(job, files, compared) {
  const tables = files.find((f) => f.path === "twin/twin.bin");
  if (!tables || !files.some((f) => f.path === "twin/twin.json")) return null;
  const box = el("div", { class: "twin" }), note = el("p", { class: "hint" });
  let panel = null, data = null;
  const save = async () => {
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
