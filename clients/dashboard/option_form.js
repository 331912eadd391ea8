// A form for a job document, built from the table of options (GET /v1/options). It has a search, nested sections, lists of
// sections, and one row for each option: its words first, its key small. It edits the given document and calls `changed` after every change. The rows of
// a section are built when the section is opened.
import { foundOptions, keyOf, prose, wordsOf } from "./option_words.js";
import { el } from "./page_parts.js";

const isObject = (x) => typeof x === "object" && x !== null && !Array.isArray(x);
const MOST_FOUND = 10;
const LISTS = new Set(["numbers", "integers", "number_or_numbers", "file_names"]);

// The rows directly under a path: "volume" is a section, "photographs[]" an element of a list.
function membersOf(options, path) {
  const start = path ? `${path}.` : "";
  return options.filter((row) => row.path.startsWith(start) && row.path.length > start.length && !/[.[]/.test(row.path.slice(start.length)));
}

// ---- places ----
// A place is an object of the document that may not exist yet. It has a path, get() (the object or undefined), make()
// (creates it when needed) and prune() (removes it when it is empty).

function memberPlace(parent, key) {
  const place = {
    path: parent.path ? `${parent.path}.${key}` : key,
    get: () => { const value = parent.get()?.[key]; return isObject(value) ? value : undefined; },
    make: () => { const owner = parent.make(); if (!isObject(owner[key])) owner[key] = {}; return owner[key]; },
    prune: () => {
      const value = place.get();
      if (value && Object.keys(value).length === 0) { delete parent.get()[key]; parent.prune(); }
    },
  };
  return place;
}

const elementPlace = (list, path, i) => ({ path: `${path}[${i}]`, get: () => list[i], make: () => list[i], prune: () => {} });

// ---- one value: between the text of an input and JSON ----

function textOf(row, value) {
  if (value === undefined) return "";
  if (row.kind === "other") return JSON.stringify(value);
  return Array.isArray(value) ? value.join(", ") : String(value);
}

// Throws when the text is no value of the row's kind. The server checks ranges.
function valueOf(row, text) {
  if (text.trim() === "") throw new Error("Give a value.");
  if (row.kind === "other") return JSON.parse(text);
  if (row.kind === "boolean") return text === "true";
  const number = (word) => { if (word === "" || !Number.isFinite(Number(word))) throw new Error(`'${word}' is not a number.`); return Number(word); };
  if (row.kind === "number" || row.kind === "integer") return number(text.trim());
  if (!LISTS.has(row.kind)) return text;
  const words = text.split(/[\s,]+/).filter((word) => word !== "");
  if (row.kind === "file_names") return words;
  return row.kind === "number_or_numbers" && words.length === 1 ? number(words[0]) : words.map(number);
}

function inputOf(row) {
  const choices = row.kind === "boolean" ? ["true", "false"] : row.choices;
  const name = { "aria-label": row.path };
  if (choices) return el("select", name, ...(row.required ? ["", ...choices] : choices).map((word) => el("option", { value: word }, word)));
  const placeholder = "default" in row ? textOf(row, row.default) : (row.left_out ?? "").replaceAll("`", "");
  if (row.kind === "other") return el("textarea", { ...name, rows: 2, placeholder });
  const whole = row.kind === "integer";
  if (whole || row.kind === "number") return el("input", { ...name, type: "number", step: whole ? 1 : "any", min: row.lower, max: row.upper, placeholder });
  return el("input", { ...name, type: "text", placeholder });
}

const rangeOf = (row) => row.allowed ?? ("upper" in row && row.kind !== "other" ? `${row.lower} to ${row.upper}` : "");

function help(row) {
  const range = rangeOf(row), without = "default" in row ? `Without it: ${textOf(row, row.default)}.` : row.left_out ? `Without it: ${row.left_out}.` : "";
  return el("span", { class: "hint" }, ...prose([wordsOf(row).rest, without, range ? `Allowed: ${range}.` : ""].filter(Boolean).join(" ")));
}

// ---- rows and sections ----

export function optionForm(options, document, changed) {
  const sections = new Map(); // path in the document -> function that opens the section and builds its rows
  const root = { path: "", get: () => document, make: () => document, prune: () => {} };

  function leaf(row, place) {
    const key = keyOf(row), path = place.path ? `${place.path}.${key}` : key;
    const input = inputOf(row), problem = el("span", { class: "problem" });
    const given = place.get()?.[key];
    const present = given !== undefined && !isObject(given) || row.kind === "other" && given !== undefined;
    const box = row.required ? null : el("input", { type: "checkbox", checked: present, title: "Set this option", "aria-label": `set ${row.path}` });
    const line = el("div", { class: "option", "data-path": path }, el("label", {}, box, el("b", {}, ...prose(wordsOf(row).words)), el("small", {}, key)),
      el("span", { class: "value" }, input, row.unit ? el("span", { class: "unit" }, row.unit) : null), help(row), problem);
    const remove = () => { if (place.get()) { delete place.get()[key]; place.prune(); } };
    const take = () => {
      line.classList.remove("bad");
      problem.textContent = "";
      if (box !== null && !box.checked || row.required && input.value.trim() === "") remove();
      else {
        try { place.make()[key] = valueOf(row, input.value); } catch (error) { remove(); line.classList.add("bad"); problem.textContent = error.message; }
      }
      changed();
    };
    const standard = "default" in row ? textOf(row, row.default) : "";
    const showUnset = () => { input.value = input.tagName === "SELECT" && standard !== "" ? standard : ""; };
    if (present) input.value = textOf(row, given);
    else if (standard !== "" || row.required) showUnset();
    if (box !== null) {
      input.disabled = !present;
      box.addEventListener("change", () => {
        input.disabled = !box.checked;
        if (!box.checked) showUnset();
        else if (input.value === "") input.value = input.tagName === "SELECT" ? input.options[0].value : standard;
        take();
        if (box.checked) input.focus();
      });
    }
    input.addEventListener("change", take);
    return line;
  }

  // A section that builds its rows when it is opened. With `open` it is opened at once.
  function folded(path, head, open, build) {
    const body = el("div", { class: "members" }), node = el("details", { "data-path": path }, el("summary", {}, ...head), body);
    let built = false;
    const show = () => {
      if (!built) { built = true; body.append(...build()); }
      node.open = true;
    };
    node.addEventListener("toggle", () => { if (node.open) show(); });
    sections.set(path, show);
    if (open) show();
    return node;
  }

  const heading = (row) => [el("b", {}, ...prose(wordsOf(row).words)), " ", el("small", {}, keyOf(row))];
  const more = (row) => { const { rest } = wordsOf(row); return rest ? [el("p", { class: "hint" }, ...prose(rest))] : []; };

  function section(row, parent) {
    const place = memberPlace(parent, keyOf(row));
    return folded(place.path, heading(row), place.get() !== undefined, () => [...more(row), ...membersOf(options, row.path).map((member) => part(member, place))]);
  }

  function list(row, parent) {
    const key = keyOf(row), path = parent.path ? `${parent.path}.${key}` : key, items = el("div");
    const listed = () => { const value = parent.get()?.[key]; return Array.isArray(value) ? value : []; };
    const element = (i) => {
      const place = elementPlace(listed(), path, i);
      const remove = el("button", { type: "button", "aria-label": `Remove ${key}[${i}]`, onclick: () => drop(i) }, "Remove");
      const members = folded(place.path, [el("b", {}, place.get().file ?? `${key}[${i}]`), " ", el("small", {}, `${key}[${i}]`)],
        Object.keys(place.get()).length === 0, () => membersOf(options, `${row.path}[]`).map((member) => part(member, place)));
      return el("div", { class: "element" }, members, remove);
    };
    const fill = () => items.replaceChildren(...listed().map((_, i) => element(i)));
    const drop = (i) => {
      listed().splice(i, 1);
      if (listed().length === 0) { delete parent.get()[key]; parent.prune(); }
      fill();
      changed();
    };
    const add = () => {
      if (listed().length === 0) parent.make()[key] = [];
      parent.make()[key].push({});
      fill();
      changed();
    };
    return folded(path, heading(row), listed().length > 0, () => {
      fill();
      return [items, el("button", { type: "button", class: "add", onclick: add }, `Add to ${key}`), ...inner(row, parent)];
    });
  }

  // Rows of the object that is allowed instead of the value or the list.
  function inner(row, parent) {
    if (!row.or_section) return [];
    const place = memberPlace(parent, keyOf(row));
    return membersOf(options, row.path).map((member) => part(member, place));
  }

  function part(row, place) {
    if (row.kind === "section") return section(row, place);
    if (row.kind === "list") return list(row, place);
    const line = leaf(row, place), more = inner(row, place);
    return more.length ? el("div", {}, line, el("div", { class: "members" }, ...more)) : line;
  }

  const results = el("ul", { class: "found" }), search = el("input", { type: "search", placeholder: "search, such as twist, seed or picture", "aria-label": "search the options", oninput: () => find(search.value) });
  const node = el("div", { class: "options" }, el("div", { class: "search" }, search, results), ...membersOf(options, "").map((row) => part(row, root)));

  function find(text) {
    const found = foundOptions(options, text), line = (row) => el("li", {}, el("button", { type: "button", onclick: () => { results.replaceChildren(); reveal(row.path); } },
      el("b", {}, ...prose(wordsOf(row).words)), " ", el("small", {}, row.path)));
    results.replaceChildren(...found.slice(0, MOST_FOUND).map(line), ...(found.length > MOST_FOUND ? [el("li", { class: "hint" }, `and ${found.length - MOST_FOUND} more`)] : []),
      ...(text.trim() && found.length === 0 ? [el("li", { class: "hint" }, "No option has these words.")] : []));
  }

  // The row of a path, or of the section around it. quiet: does not open the sections on the way
  function rowOf(path, quiet) {
    const ends = [...path.matchAll(/[.[]/g)].map((m) => m.index).concat(path.length);
    let row = null;
    for (const end of ends) {
      const prefix = path.slice(0, end);
      if (!quiet) sections.get(prefix)?.();
      row = [...node.querySelectorAll("[data-path]")].find((one) => one.dataset.path === prefix) ?? row;
    }
    return row;
  }

  // Opens the way to an option and puts the cursor on it; of an option of a list, to the list or its first entry.
  function reveal(path) {
    const row = rowOf(path.replaceAll("[]", "[0]"), false) ?? rowOf(path.replace(/\[\].*/, ""), false);
    row?.scrollIntoView({ block: "center" });
    for (const one of node.querySelectorAll(".shown")) one.classList.remove("shown");
    row?.classList.add("shown");
    const target = row?.querySelector("input, select, textarea, summary");
    if (target instanceof HTMLElement) target.focus({ preventScroll: true });
  }

  // Shows the row of a key that the server refused, and opens the sections that contain it.
  // quiet: neither opens sections nor scrolls
  function mark(path, message, quiet = false) {
    const row = rowOf(path, quiet);
    row?.classList.add("bad");
    const problem = row?.querySelector(":scope > .problem");
    if (problem) problem.textContent = message;
    if (!quiet) row?.scrollIntoView({ block: "center" });
    return row;
  }
  return { node, mark };
}
