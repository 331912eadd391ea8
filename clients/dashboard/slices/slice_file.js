// Reads slices from a file of results/scan (docs/file-formats.md, SELVSLIC): one range of bytes for each slice, unpacked by
// the browser.
import { raw } from "../server_link.js";

const HEAD = 64, KEPT_BYTES = 96 << 20;

async function range(url, from, n, signal) {
  const answer = await raw("GET", url, { header: { Range: `bytes=${from}-${from + n - 1}` }, signal });
  const bytes = new Uint8Array(await answer.arrayBuffer());
  if (bytes.length !== n) throw new Error("the file of slices is incomplete");
  return bytes;
}

async function unpack(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new window["DecompressionStream"]("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

export class SliceFile {
  static async open(url, signal) {
    const file = new SliceFile(url, signal, await range(url, 0, HEAD, signal));
    await file.readIndex();
    return file;
  }

  constructor(url, signal, head) {
    const view = new DataView(head.buffer), number = (i) => view.getUint32(8 + 4 * i, true);
    if (String.fromCharCode(...head.subarray(0, 8)) !== "SELVSLIC" || number(0) !== 1) throw new Error("the file of slices has an unknown format");
    this.url = url;
    this.signal = signal;
    this.axis = number(1);
    this.width = number(2);
    this.height = number(3);
    this.n = number(4);
    this.edge = number(5); // of a tile
    this.nLevel = number(6);
    this.factor = number(7);
    this.voxel = [0, 1, 2].map((i) => view.getFloat32(40 + 4 * i, true)); // micrometres: along columns, rows, slices
    this.densitySteps = number(11);
    this.directionSteps = number(12);
    this.kept = new Map(); // "slice level row" -> promise of a row of tiles
    this.levels = []; // {width, height, columns, rows: of tiles, first: its first tile of a slice}
    this.nTile = 0; // of a slice
    this.offset = new Float64Array(0); // of every tile
  }

  async readIndex() {
    const along = (n) => Math.ceil(n / this.edge);
    for (let l = 0, w = this.width, h = this.height; l < this.nLevel; l++, w = Math.ceil(w / 2), h = Math.ceil(h / 2)) {
      this.levels.push({ width: w, height: h, columns: along(w), rows: along(h), first: this.nTile });
      this.nTile += along(w) * along(h);
    }
    const n = this.n * this.nTile, lengths = new DataView((await range(this.url, HEAD, 4 * n, this.signal)).buffer);
    this.offset = new Float64Array(n + 1);
    this.offset[0] = HEAD + 4 * n;
    for (let i = 0; i < n; i++) this.offset[i + 1] = this.offset[i] + lengths.getUint32(4 * i, true);
  }

  // The rows of tiles from..to of a slice: [{y, height, width, density, direction}], from low to high.
  async rows(slice, level, from, to) {
    const key = (r) => `${slice} ${level} ${r}`, wanted = [];
    for (let r = from; r <= to; r++) if (!this.kept.has(key(r))) wanted.push(r);
    if (wanted.length) {
      const first = wanted[0], last = wanted[wanted.length - 1], bytes = this.fetch(slice, level, first, last);
      for (const r of wanted) {
        const row = bytes.then((parts) => this.assemble(level, r, parts[r - first]));
        row.catch(() => this.kept.delete(key(r)));
        this.kept.set(key(r), row);
      }
    }
    const found = await Promise.all(Array.from({ length: to - from + 1 }, (_, i) => {
      const known = this.kept.get(key(from + i));
      this.kept.delete(key(from + i)); // the last used are the last in the map
      this.kept.set(key(from + i), known);
      return known;
    }));
    this.forget(2 * this.width * this.height);
    return found;
  }

  forget(sliceBytes) {
    const most = Math.max(24, Math.floor(KEPT_BYTES / sliceBytes) * this.levels[0].rows);
    while (this.kept.size > most) this.kept.delete(this.kept.keys().next().value);
  }

  async fetch(slice, level, from, to) {
    const l = this.levels[level], first = slice * this.nTile + l.first + from * l.columns, end = first + (to - from + 1) * l.columns;
    const start = this.offset[first], bytes = await range(this.url, start, this.offset[end] - start, this.signal);
    const tiles = await Promise.all(Array.from({ length: end - first }, (_, t) => unpack(bytes.subarray(this.offset[first + t] - start, this.offset[first + t + 1] - start))));
    return Array.from({ length: to - from + 1 }, (_, r) => tiles.slice(r * l.columns, (r + 1) * l.columns));
  }

  assemble(level, row, tiles) {
    const l = this.levels[level], y = row * this.edge, height = Math.min(this.edge, l.height - y), area = l.width * height;
    if (tiles.length === 1) return { y, height, width: l.width, density: tiles[0].subarray(0, area), direction: tiles[0].subarray(area) };
    const density = new Uint8Array(area), direction = new Uint8Array(area);
    tiles.forEach((tile, c) => {
      const x = c * this.edge, w = Math.min(this.edge, l.width - x);
      for (let v = 0; v < height; v++) {
        density.set(tile.subarray(v * w, (v + 1) * w), v * l.width + x);
        direction.set(tile.subarray((height + v) * w, (height + v + 1) * w), v * l.width + x);
      }
    });
    return { y, height, width: l.width, density, direction };
  }
}
