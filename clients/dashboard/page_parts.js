// Small parts of pages: elements made without innerHTML, because names come from users, and numbers as text.

export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (key === "class") node.className = value;
    else if (key in node && key !== "list") node[key] = value;
    else node.setAttribute(key, value);
  }
  node.append(...children.flat().filter((c) => c !== null && c !== undefined));
  return node;
}

export function svg(tag, attributes = {}, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

// Replaces the children only if `key` has changed, so that polling does not disturb a selection or a scroll position.
export function refill(node, key, make) {
  const text = JSON.stringify(key);
  if (node.dataset.key === text) return;
  node.dataset.key = text;
  node.replaceChildren(...[make()].flat().filter((c) => c !== null && c !== undefined));
}

export const card = (title, ...content) => el("section", { class: "card" }, el("h2", {}, title), ...content);

export const isNumber = (x) => typeof x === "number" && Number.isFinite(x);

export function duration(s) {
  if (!isNumber(s) || s < 0) return "–";
  const t = Math.round(s);
  const two = (n) => String(n).padStart(2, "0");
  return t >= 3600 ? `${Math.floor(t / 3600)}:${two(Math.floor(t / 60) % 60)}:${two(t % 60)}` : `${Math.floor(t / 60)}:${two(t % 60)}`;
}

// Remaining time: a range where it is not known well.
export const timeLeft = (job) => (isNumber(job.eta_low_s) && isNumber(job.eta_high_s) ? `${duration(job.eta_low_s)} to ${duration(job.eta_high_s)}` : duration(job.eta_s));

export function size(n) {
  const unit = ["B", "kB", "MB", "GB", "TB"];
  let i = 0;
  while (n >= 999.5 && i < unit.length - 1) { n /= 1000; i++; }
  return `${n.toFixed(i === 0 || n >= 99.95 ? 0 : n >= 9.995 ? 1 : 2)} ${unit[i]}`;
}

// Formats a value with as many digits as its standard error justifies.
export function withError(value, se) {
  if (!isNumber(value)) return "–";
  if (!isNumber(se) || se <= 0) return Number(value.toPrecision(4)).toString();
  const digits = Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(se))));
  return `${value.toFixed(digits)} ± ${se.toFixed(digits)}`;
}

export const percent = (x, digits = 1) => (isNumber(x) ? `${(100 * x).toFixed(digits)} %` : "–");

// Rounds up to two digits: 1.0123 becomes 1.1.
function roundedUp(x) {
  const unit = 10 ** (Math.floor(Math.log10(x)) - 1);
  return Number((unit * Math.ceil(x / unit - 1e-9)).toPrecision(2));
}

// A relative error with its standard error. An error of less than two standard errors cannot be told from zero, and reads
// "below 1.1 %": the error plus two standard errors.
export function percentWithError(x, se, digits = 2) {
  if (!isNumber(x) || !isNumber(se) || se <= 0) return percent(x, digits);
  return x < 2 * se ? `below ${roundedUp(100 * (x + 2 * se))} %` : `${(100 * x).toFixed(digits)} ± ${(100 * se).toFixed(digits)} %`;
}
export const when = (unix) => (isNumber(unix) && unix > 0 ? new Date(1000 * unix).toLocaleString() : "–");
// A time in the reader's zone, with the UTC time as its title.
export function timeOf(unix) {
  if (!isNumber(unix) || unix <= 0) return el("span", {}, "–");
  const iso = new Date(1000 * unix).toISOString();
  return el("time", { dateTime: iso, title: `${iso.slice(0, 19).replace("T", " ")} UTC` }, when(unix));
}
export const stateTag = (state) => el("span", { class: `state ${state}` }, state);

// Verdicts by their code, from the best to the worst: words where the number of undetermined parameters is not known, and a
// class. "usable" is of older results.
export const VERDICTS = {
  good: ["good", "good"],
  good_but_undetermined: ["good, but some parameters are undetermined", "good"],
  pictures_only: ["usable for pictures only", "warn"],
  does_not_describe_this_cloth: ["does not describe this cloth", "bad"],
  usable: ["usable with reservations", "warn"],
};
export const verdictWords = (code) => VERDICTS[code]?.[0] ?? code;
// The verdict on a result as a coloured tag; null before there is one. The sentence is its title.
export const verdictTag = (verdict) => (verdict ? el("span", { class: `tag ${VERDICTS[verdict.code]?.[1] ?? ""}`, title: verdict.text }, verdict.words) : null);

// Converts linear radiance to an sRGB byte colour.
export function colour(rgb, exposure) {
  const byte = (x) => {
    const v = Math.min(1, Math.max(0, x * exposure));
    return Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
  };
  return `rgb(${byte(rgb[0])},${byte(rgb[1])},${byte(rgb[2])})`;
}
