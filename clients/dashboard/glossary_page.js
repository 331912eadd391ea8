// The glossary, made from docs/glossary.md, and the parameters of the models with their meanings.
import { card, el } from "./page_parts.js";
import { getJson, raw } from "./server_link.js";

// Returns [[word, meaning]] of the table of docs/glossary.md, without marks for bold letters and code.
export function wordsOf(markdown) {
  const plain = (text) => text.trim().replace(/\[([^\]]*)\]\([^)]*\)/g, "$1").replace(/\*\*|`/g, "");
  return markdown.split("\n").filter((line) => /^\| \*\*/.test(line)).map((line) => line.split("|").slice(1, 3).map(plain));
}

const table = (id, rows) => el("table", { class: "record", id }, el("tbody", {}, rows.map(([word, ...meaning]) => el("tr", {}, el("th", { scope: "row" }, word), el("td", {}, ...meaning)))));

// One line for the three channels of a colour.
function parametersOf(model) {
  const first = model.parameters.filter((p) => p.channel === null || p.channel === 0);
  return first.map((p) => [el("span", { class: "mono" }, p.channel === 0 ? `${p.symbol} r, g, b` : p.name), p.meaning, p.unit ? el("span", { class: "hint" }, ` (${p.unit === "deg" ? "degrees" : p.unit})`) : ""]);
}

export function glossaryPage(page) {
  let left = false;
  document.title = "Glossary – Selvedge";
  const show = async () => {
    const [text, { models }] = await Promise.all([raw("GET", "/glossary.md").then((answer) => answer.text()), getJson("/v1/options")]);
    if (left) return;
    page.append(el("section", { class: "card" }, el("h1", {}, "Glossary"), table("words", wordsOf(text))),
      ...models.map((m) => card(m.title, el("p", { class: "hint mono" }, m.id), table(null, parametersOf(m)))));
  };
  show().catch((error) => { if (!left) page.append(el("p", { class: "note bad" }, error.message)); });
  return () => { left = true; };
}
