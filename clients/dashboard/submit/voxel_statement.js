// Whether the first file of a scan states the size of its voxels: the rules of geometry/volume/format/tiff_order.c, as far as a browser needs them to ask.
import { endingOf } from "./guessed_kinds.js";

const DESCRIPTION = 270, X_RESOLUTION = 282, UNIT = 296, MOST_PRINT_VOXEL_M = 1e-4, UNIT_M = { 2: 0.0254, 3: 0.01 };

const bytesAt = async (file, from, n) => new DataView(await file.slice(from, from + n).arrayBuffer());

async function tiffStates(file) {
  const head = await bytesAt(file, 0, 8), little = head.getUint16(0) === 0x4949;
  if (head.getUint16(2, little) !== 42) return true; // BigTIFF: the server reads it
  const directory = await bytesAt(file, head.getUint32(4, little), 2 + 12 * 128), n = Math.min(directory.getUint16(0, little), Math.floor((directory.byteLength - 2) / 12));
  const found = {};
  for (let i = 0; i < n; i++) {
    const entry = 2 + 12 * i;
    found[directory.getUint16(entry, little)] = { count: directory.getUint32(entry + 4, little), place: directory.getUint32(entry + 8, little), short: directory.getUint16(entry + 8, little) };
  }
  const text = found[DESCRIPTION] && found[DESCRIPTION].count > 4 ? await file.slice(found[DESCRIPTION].place, found[DESCRIPTION].place + Math.min(4096, found[DESCRIPTION].count)).text() : "";
  if (/^unit=|PhysicalSizeX/m.test(text)) return true;
  if (!found[X_RESOLUTION]) return false;
  const ratio = await bytesAt(file, found[X_RESOLUTION].place, 8), perUnit = ratio.getUint32(0, little) / ratio.getUint32(4, little);
  return UNIT_M[found[UNIT]?.short ?? 2] / perUnit < MOST_PRINT_VOXEL_M;
}

export async function statesVoxelSize(file) {
  const ending = endingOf(file.name);
  if (["npy", "raw", "bin"].includes(ending)) return false;
  if (!ending.startsWith("tif")) return true;
  try { return await tiffStates(file); } catch { return true; } // the server says what is wrong with the file
}
