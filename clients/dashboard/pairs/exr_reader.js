// Reads OpenEXR files as the daemon's results have them: scan lines, 32-bit floats, not compressed. Everything else is
// refused with an error that names it. A filtered view is taken in place of the picture where the file has one.

const MAGIC = 20000630, TILED = 0x200, PARTS = 0x1800, FLOAT = 2, MOST_PIXELS = 1 << 26;

class Cursor {
  constructor(buffer) { this.view = new DataView(buffer); this.at = 0; }
  int() { this.at += 4; return this.view.getInt32(this.at - 4, true); }
  text() {
    let s = "";
    for (let c = this.view.getUint8(this.at++); c !== 0; c = this.view.getUint8(this.at++)) s += String.fromCharCode(c);
    return s;
  }
}

// The attributes of the header: name -> the place of its bytes.
function attributes(c) {
  const found = new Map();
  for (let name = c.text(); name !== ""; name = c.text()) {
    c.text(); // its type
    const bytes = c.int();
    if (bytes < 0 || c.at + bytes > c.view.byteLength) throw new Error(`its attribute ${name} is cut off`);
    found.set(name, c.at);
    c.at += bytes;
  }
  return found;
}

function channelNames(c, at) {
  const names = [];
  c.at = at;
  for (let name = c.text(); name !== ""; name = c.text()) {
    if (c.int() !== FLOAT) throw new Error(`its channel ${name} has no 32-bit floats`);
    c.at += 4; // how its values are to be seen, and three bytes without a meaning
    if (c.int() !== 1 || c.int() !== 1) throw new Error(`its channel ${name} is sampled more coarsely than its pixels`);
    names.push(name);
  }
  return names;
}

function read(buffer) {
  const c = new Cursor(buffer);
  if (c.int() !== MAGIC) throw new Error("it is no OpenEXR file");
  if (c.int() & (TILED | PARTS)) throw new Error("it has tiles, parts or deep pixels");
  const found = attributes(c), lines = c.at;
  for (const name of ["channels", "compression", "dataWindow"]) if (!found.has(name)) throw new Error(`it has no attribute ${name}`);
  if (c.view.getUint8(found.get("compression")) !== 0) throw new Error("it is compressed");
  c.at = found.get("dataWindow");
  const [left, top, right, bottom] = [c.int(), c.int(), c.int(), c.int()], width = right - left + 1, height = bottom - top + 1;
  if (!(width > 0 && height > 0 && width * height <= MOST_PIXELS)) throw new Error(`it has ${width} x ${height} pixels`);
  const names = channelNames(c, found.get("channels")), layer = names.includes("filtered.R") ? "filtered." : "", place = ["R", "G", "B"].map((n) => names.indexOf(layer + n));
  if (place.includes(-1)) throw new Error(`it has the channels ${names.join(", ")} instead of R, G, B`);
  const rgb = new Float32Array(3 * width * height);
  for (let line = 0; line < height; line++) {
    c.at = Number(c.view.getBigUint64(lines + 8 * line, true));
    const y = c.int() - top, bytes = c.int();
    if (y < 0 || y >= height || bytes !== 4 * width * names.length) throw new Error(`its line ${line} is damaged`);
    place.forEach((channel, k) => {
      for (let x = 0, at = c.at + 4 * width * channel; x < width; x++, at += 4) rgb[3 * (y * width + x) + k] = c.view.getFloat32(at, true);
    });
  }
  return { width, height, rgb };
}

// Returns {width, height, rgb}, row after row from the top.
export function readExr(buffer) {
  try {
    return read(buffer);
  } catch (error) {
    throw error instanceof RangeError ? new Error("it is cut off") : error;
  }
}
