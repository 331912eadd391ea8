// A cloth that turns once under its light, as an animated WebP file that loops. Frames come from the canvas as WebP files of one picture; here
// they become chunks of one file (developers.google.com/speed/webp/docs/riff_container).

const FRAMES = 72, TURN_MS = 6000, TURN_EDGE = 480, QUALITY = 0.85;

const number24 = (x) => [x & 255, x >> 8 & 255, x >> 16 & 255];
const codeOf = (text) => [...text].map((c) => c.charCodeAt(0));

// A chunk with its head: four letters, the number of bytes, and a zero where that is odd.
function riffChunk(name, content) {
  const made = new Uint8Array(8 + content.length + content.length % 2);
  made.set(codeOf(name));
  new DataView(made.buffer).setUint32(4, content.length, true);
  made.set(content, 8);
  return made;
}

function joined(lists) {
  const made = new Uint8Array(lists.reduce((n, list) => n + list.length, 0));
  let at = 0;
  for (const list of lists) { made.set(list, at); at += list.length; }
  return made;
}

// The chunks of the picture in a WebP file, without the head that a file with extensions has.
function pictureChunks(file) {
  const view = new DataView(file.buffer, file.byteOffset), found = [];
  for (let at = 12; at + 8 <= file.length;) {
    const name = String.fromCharCode(...file.subarray(at, at + 4)), length = view.getUint32(at + 4, true);
    if (["VP8 ", "VP8L", "ALPH"].includes(name)) found.push(riffChunk(name, file.subarray(at + 8, at + 8 + length)));
    at += 8 + length + length % 2;
  }
  return joined(found);
}

// files: WebP files of one picture of edge x edge each, shown for `ms` each, for ever.
export function animatedWebp(files, edge, ms) {
  const size = [...number24(edge - 1), ...number24(edge - 1)];
  const frames = files.map((file) => riffChunk("ANMF", joined([[0, 0, 0, 0, 0, 0], size, number24(ms), [2], pictureChunks(file)])));
  return riffChunk("RIFF", joined([codeOf("WEBP"), riffChunk("VP8X", [2, 0, 0, 0, ...size]), riffChunk("ANIM", [0, 0, 0, 255, 0, 0]), ...frames]));
}

// view: a TwinView; told(share) as frames are done. Throws where the browser cannot write WebP.
export async function turntable(view, state, told, edge = TURN_EDGE, n = FRAMES) {
  const files = [];
  for (let i = 0; i < n; i++) {
    const blob = await view.photograph({ ...state, turn: 360 * i / n }, edge, "image/webp", QUALITY);
    if (blob?.type !== "image/webp") throw new Error("this browser cannot write WebP files");
    files.push(new Uint8Array(await blob.arrayBuffer()));
    told((i + 1) / n);
  }
  return new Blob([animatedWebp(files, edge, Math.round(TURN_MS / n))], { type: "image/webp" });
}
