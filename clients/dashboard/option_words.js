// The words of an option, from its meaning in the table (GET /v1/options): a short phrase that stands first, and the rest as help.
import { el } from "./page_parts.js";

// Text in which words between backquotes are shown as code.
export const prose = (text) => text.split("`").map((part, i) => (i % 2 ? el("code", {}, part) : part));

export const keyOf = (row) => row.path.slice(row.path.lastIndexOf(".") + 1);

// Returns {words, rest}. The phrase is the first sentence, or its part before a colon; a meaning that begins with a value has the key as its phrase.
export function wordsOf(row) {
  const meaning = row.meaning ?? "", end = /[^.]{2}\.(?= [A-Z`])|\.$/.exec(meaning), sentence = end ? meaning.slice(0, end.index + end[0].length - 1) : meaning;
  const colon = sentence.indexOf(": "), phrase = colon > 0 ? sentence.slice(0, colon) : sentence;
  if (phrase.startsWith("`") || phrase.length < 4) return { words: keyOf(row).replace(/\[\]$/, "").replaceAll("_", " "), rest: meaning };
  return { words: phrase.replace(/ \(docs\/[^)]*\)/, ""), rest: meaning.slice(colon > 0 ? colon + 2 : sentence.length + 1).trim() };
}

// The options whose words, key or help have every word that is searched for; those with the first word in their key or phrase come first.
export function foundOptions(options, text) {
  const wanted = text.toLowerCase().split(/\s+/).filter((w) => w !== "");
  if (wanted.length === 0) return [];
  const score = (row) => (keyOf(row).replaceAll("_", " ").includes(wanted[0]) ? 0 : wordsOf(row).words.toLowerCase().includes(wanted[0]) ? 1 : 2);
  return options.filter((row) => row.path !== "" && wanted.every((w) => `${row.path.replaceAll("_", " ")} ${row.path} ${row.meaning}`.toLowerCase().includes(w)))
    .sort((a, b) => score(a) - score(b));
}
