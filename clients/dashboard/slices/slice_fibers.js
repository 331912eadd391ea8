// Which pieces of fibers lie at a slice: an index over slices, and the drawing of centers and fibers.
import { FOUND_FROM } from "../fibers/hair_file.js";

export const FOUND_COLOUR = "#ff5b4d", FILLED_COLOUR = "#4dd2ff";
const BUCKET = 4; // slices

export class SliceFibers {
  // fibers: as SharedFibers.load returns them; axis: across which the slices lie; n of them, thick_mm apart
  constructor({ parsed, contrast }, axis, n, thickMm) {
    this.parsed = parsed;
    this.contrast = contrast;
    this.axis = axis;
    this.thick = thickMm;
    this.u = axis === 0 ? 1 : 0;
    this.v = axis === 2 ? 1 : 2;
    const nBucket = Math.ceil(n / BUCKET), size = BUCKET * thickMm, first = new Uint32Array(nBucket + 2);
    const at = (mm) => Math.min(nBucket - 1, Math.max(0, Math.floor(mm / size)));
    for (let pass = 0; pass < 2; pass++) {
      if (pass) {
        for (let b = 0; b < nBucket; b++) first[b + 2] += first[b + 1];
        this.point = new Uint32Array(first[nBucket + 1]);
      }
      this.eachSegment((k) => {
        const a = parsed.xyz[3 * k + axis], b = parsed.xyz[3 * k + 3 + axis], r = this.radius(k);
        for (let i = at(Math.min(a, b) - r), last = at(Math.max(a, b) + r); i <= last; i++) {
          if (pass) this.point[first[i + 1]++] = k;
          else first[i + 2]++;
        }
      });
    }
    this.first = first;
  }

  eachSegment(visit) {
    let k = 0;
    for (const n of this.parsed.segments) {
      for (let i = 0; i < n; i++) visit(k + i);
      k += n + 1;
    }
  }

  radius(k) { return (this.parsed.thickness ? this.parsed.thickness[k] : this.parsed.thick) / 2; }

  isFound(k) { return !this.contrast || this.contrast[k] + this.contrast[k + 1] >= 2 * FOUND_FROM; }

  // Draws the fibers at a slice. place(u, v) gives the pixel of a place in mm, scale the pixels of a millimetre.
  draw(context, slice, place, scale, { centers, fibers }) {
    const plane = (slice + 0.5) * this.thick, b = Math.floor(slice / BUCKET), { xyz } = this.parsed, { axis, u, v } = this;
    const paths = [FOUND_COLOUR, FILLED_COLOUR].map((colour) => ({ colour, line: new Path2D(), disc: new Path2D() }));
    let n = 0;
    for (let i = this.first[b]; i < this.first[b + 1]; i++) {
      const k = this.point[i], p = 3 * k, q = p + 3, da = xyz[p + axis] - plane, db = xyz[q + axis] - plane, r = this.radius(k);
      const path = paths[this.isFound(k) ? 0 : 1];
      if (fibers && (Math.min(Math.abs(da), Math.abs(db)) <= r || (da < 0) !== (db < 0))) {
        const [x0, y0] = place(xyz[p + u], xyz[p + v]), [x1, y1] = place(xyz[q + u], xyz[q + v]);
        path.line.moveTo(x0, y0);
        path.line.lineTo(x1, y1);
      }
      if ((da < 0) === (db < 0)) continue;
      n++;
      if (!centers) continue;
      const t = da / (da - db), [x, y] = place(xyz[p + u] + t * (xyz[q + u] - xyz[p + u]), xyz[p + v] + t * (xyz[q + v] - xyz[p + v])), edge = Math.max(2, r * scale);
      path.disc.moveTo(x + edge, y);
      path.disc.arc(x, y, edge, 0, 2 * Math.PI);
      path.disc.rect(x - 0.75, y - 0.75, 1.5, 1.5);
    }
    context.lineWidth = Math.max(1, devicePixelRatio);
    for (const { colour, line, disc } of paths) {
      context.strokeStyle = colour;
      context.stroke(disc);
      context.globalAlpha = 0.75;
      context.stroke(line);
      context.globalAlpha = 1;
    }
    return n;
  }
}
