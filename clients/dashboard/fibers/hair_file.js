// Reads .hair files (docs/file-formats.md), and the file that says how clearly the scan shows each of their points.
import { raw } from "../server_link.js";

export const MOST_BYTES = 200 << 20; // larger files are not read into a page

// Below this contrast the scan does not show the fiber: the line was carried on through a gap (GRADE_SAFE_CONTRAST).
export const FOUND_FROM = 50;

// {nStrand, nPoint, segments: of each strand, xyz: mm, thickness: mm of each point or null, thick: mm of all without it,
// rgb: of each point if colours state groups, else null}
export function parseHair(buffer) {
  const view = new DataView(buffer);
  const magic = String.fromCharCode(...new Uint8Array(buffer, 0, Math.min(4, buffer.byteLength)));
  if (buffer.byteLength < 128 || magic !== "HAIR") throw new Error("not a .hair file");
  const nStrand = view.getUint32(4, true), nPoint = view.getUint32(8, true), flags = view.getUint32(12, true), nDefault = view.getUint32(16, true);
  const words = String.fromCharCode(...new Uint8Array(buffer, 40, 88));
  let at = 128;
  const segments = new Uint32Array(nStrand);
  for (let i = 0; i < nStrand; i++) segments[i] = flags & 1 ? view.getUint16(at + 2 * i, true) : nDefault;
  if (flags & 1) at += 2 * nStrand;
  const array = (has, width) => {
    if (!has) return null;
    if (at + 4 * width * nPoint > buffer.byteLength) throw new Error("the .hair file is incomplete");
    at += 4 * width * nPoint;
    return new Float32Array(buffer.slice(at - 4 * width * nPoint, at));
  };
  const xyz = array(flags & 2, 3), thickness = array(flags & 4, 1);
  array(flags & 8, 1);
  const rgb = array(flags & 16 && words.includes("groups=rgb"), 3);
  if (!xyz) throw new Error("the .hair file is incomplete");
  return { nStrand, nPoint, segments, xyz, thickness, thick: view.getFloat32(20, true), rgb };
}

// The fibers of a job, loaded once for all views of a page when the first asks for them: load() returns {buffer, parsed,
// contrast: a byte for each point, 100 for a contrast of 1, or null without a scan}.
export class SharedFibers {
  constructor(hair, contrast) {
    this.file = hair;
    this.contrast = contrast;
    this.loaded = null;
  }

  load() {
    this.loaded ??= this.read().catch((error) => { this.loaded = null; throw error; });
    return this.loaded;
  }

  async read() {
    const bytes = async (file) => (file ? (await raw("GET", file.url)).arrayBuffer() : null);
    const [buffer, graded] = await Promise.all([bytes(this.file), bytes(this.contrast)]);
    const parsed = parseHair(buffer), contrast = graded && graded.byteLength === parsed.nPoint ? new Uint8Array(graded) : null;
    return { buffer, parsed, contrast };
  }
}
