// Exposure and preview of a picture, from the Exif tags of JPEG and of files that are TIFF inside (TIFF, DNG, NEF, CR2, ARW, PEF).

const HEAD_BYTES = 256 << 10, MOST_TAGS = 512;
const TAG = { compression: 0x103, strip: 0x111, stripBytes: 0x117, subDirectories: 0x14a, jpeg: 0x201, jpegBytes: 0x202, exposure: 0x829a, aperture: 0x829d,
  exif: 0x8769, iso: 0x8827 };
const BYTES_OF_TYPE = { 1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 13: 4 };

// Where the TIFF structure begins: 0, or behind the Exif mark of a JPEG; -1: there is none.
function startOf(view) {
  const first = view.byteLength > 12 ? view.getUint16(0) : 0;
  if (first === 0x4949 || first === 0x4d4d) return 0;
  if (first !== 0xffd8) return -1;
  for (let at = 2; at + 10 < view.byteLength && view.getUint8(at) === 0xff; at += 2 + view.getUint16(at + 2))
    if (view.getUint8(at + 1) === 0xe1 && view.getUint32(at + 4) === 0x45786966) return at + 10;
  return -1;
}

// The tags of a directory: Map of tag -> values; and the place of the next directory. Throws a RangeError beyond the bytes at hand.
function directory(view, start, at) {
  const little = view.getUint16(start) === 0x4949, tags = new Map(), n = view.getUint16(start + at, little);
  if (n > MOST_TAGS) throw new RangeError("no directory");
  for (let i = 0; i < n; i++) {
    const entry = start + at + 2 + 12 * i, type = view.getUint16(entry + 2, little), count = view.getUint32(entry + 4, little), bytes = BYTES_OF_TYPE[type];
    if (!bytes || count > 16) continue;
    const from = bytes * count <= 4 ? entry + 8 : start + view.getUint32(entry + 8, little);
    if (from + bytes * count > view.byteLength) continue;
    const one = (k) => (type === 5 ? view.getUint32(from + 8 * k, little) / view.getUint32(from + 8 * k + 4, little)
      : bytes === 2 ? view.getUint16(from + 2 * k, little) : bytes === 4 ? view.getUint32(from + 4 * k, little) : view.getUint8(from + k));
    tags.set(view.getUint16(entry, little), Array.from({ length: count }, (_, k) => one(k)));
  }
  return { tags, next: view.getUint32(start + at + 2 + 12 * n, little) };
}

// Returns exposure and a preview as JPEG, without members that the file does not state.
/** @returns {Promise<{exposure_s?: number, aperture?: number, iso?: number, preview?: Blob}>} */
export async function readExif(file) {
  const view = new DataView(await file.slice(0, HEAD_BYTES).arrayBuffer()), start = startOf(view);
  /** @type {{exposure_s?: number, aperture?: number, iso?: number, preview?: Blob}} */
  const found = {};
  if (start < 0) return found;
  try {
    const waiting = [view.getUint32(start + 4, view.getUint16(start) === 0x4949)], seen = new Set();
    while (waiting.length) {
      const at = waiting.shift();
      if (at === 0 || seen.has(at) || seen.size > 8 || start + at + 2 > view.byteLength) continue;
      seen.add(at);
      const { tags, next } = directory(view, start, at), first = (tag) => tags.get(tag)?.[0];
      waiting.push(...(tags.get(TAG.exif) ?? []), ...(tags.get(TAG.subDirectories) ?? []), next);
      found.exposure_s ??= first(TAG.exposure);
      found.aperture ??= first(TAG.aperture);
      found.iso ??= first(TAG.iso);
      const isJpeg = first(TAG.compression) === 6 || first(TAG.compression) === 7;
      const from = first(TAG.jpeg) ?? (isJpeg && tags.get(TAG.strip)?.length === 1 ? first(TAG.strip) : undefined), bytes = first(TAG.jpegBytes) ?? first(TAG.stripBytes);
      if (from !== undefined && bytes) found.preview ??= file.slice(start + from, start + from + bytes, "image/jpeg");
    }
  } catch (error) { if (!(error instanceof RangeError)) throw error; } // the rest lies behind the bytes that were read
  return found;
}

// "1/60 s, f/8, ISO 100"; empty when nothing is known.
/** @param {{exposure_s?: number, aperture?: number, iso?: number}} exif */
export function exposureWords({ exposure_s: time, aperture, iso }) {
  const words = [];
  if (time > 0) words.push(time < 0.5 ? `1/${Math.round(1 / time)} s` : `${Number(time.toPrecision(3))} s`);
  if (aperture > 0) words.push(`f/${Number(aperture.toPrecision(2))}`);
  if (iso > 0) words.push(`ISO ${iso}`);
  return words.join(", ");
}
