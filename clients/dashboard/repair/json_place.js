// Finds a value in the text of a JSON document by its path, such as photographs[3].file, so that it can be replaced and
// everything else stays as it was written: JSON.parse would round whole numbers above 2^53.

const skip = (text, i) => { while (/[\s,:]/.test(text[i] ?? "")) i++; return i; };

// The end of the value that begins at i.
function endOf(text, i) {
  let depth = 0;
  for (; i < text.length; i++) {
    const c = text[i];
    if (c === '"') for (i++; text[i] !== '"'; i++) if (text[i] === "\\") i++;
    if (c === "{" || c === "[") depth++;
    if (c === "}" || c === "]") depth--;
    if (depth === 0 && (/["}\]]/.test(c) || /[\s,}\]]/.test(text[i + 1] ?? ","))) return i + 1;
  }
  return text.length;
}

// The place of a member or element of the value that begins at i; null without it.
function partOf(text, i, step) {
  const list = typeof step === "number";
  if (text[i] !== (list ? "[" : "{")) return null;
  for (let at = skip(text, i + 1), n = 0; at < text.length && !/[}\]]/.test(text[at]); n++) {
    let name = n;
    if (!list) {
      const end = endOf(text, at);
      name = JSON.parse(text.slice(at, end));
      at = skip(text, end);
    }
    const end = endOf(text, at);
    if (name === step) return { from: at, to: end };
    at = skip(text, end);
  }
  return null;
}

const stepsOf = (path) => [...(path ?? "").matchAll(/([^.[\]]+)|\[(\d+)\]/g)].map((m) => ({ name: m[1] ?? Number(m[2]), end: m.index + m[0].length }));

// Returns {path, from, to} of the value at the path, or of the innermost value around it that the document has; text
// must be valid JSON.
export function placeOf(text, path) {
  const start = skip(text, 0);
  let place = { path: "", from: start, to: endOf(text, start) };
  for (const { name, end } of stepsOf(path)) {
    const part = partOf(text, place.from, name);
    if (!part) break;
    place = { path: path.slice(0, end), ...part };
  }
  return place;
}

// The text with another value there, which must be JSON; the rest is untouched.
export const replaced = (text, place, value) => text.slice(0, place.from) + value + text.slice(place.to);
