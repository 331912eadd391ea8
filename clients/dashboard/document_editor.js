// The job document in the submit panel: a form made from the server's table of options, and beside it the document as
// text.
import { optionForm } from "./option_form.js";
import { el } from "./page_parts.js";
import { getJson } from "./server_link.js";

// True when the document has a whole number above 2^53, as a seed may be. Writing it again would round it.
export function holdsLargeNumber(value) {
  if (typeof value === "number") return Number.isInteger(value) && !Number.isSafeInteger(value);
  return typeof value === "object" && value !== null && Object.values(value).some(holdsLargeNumber);
}

// changed(text) is called when the form has changed the document.
export function documentEditor(changed) {
  const text = el("pre", { class: "log", id: "document", tabIndex: 0, role: "region", "aria-label": "the job document" }), body = el("div"), note = el("p", { class: "hint" });
  const save = el("p", {}, el("a", { class: "button", href: "#", download: "job.json", onclick: (e) => { e.currentTarget.href = URL.createObjectURL(new Blob([source], { type: "application/json" })); } }, "Download job.json"));
  let source = "", options = null, form = null, wrong = [];
  const marked = new Map(); // row -> the server's fault
  const markFaults = () => {
    for (const [row, text] of marked) { // except the form's own fault for a value that it cannot read
      const problem = row.querySelector(":scope > .problem");
      if (problem?.textContent !== text) continue;
      row.classList.remove("bad");
      problem.textContent = "";
    }
    marked.clear();
    for (const { field, detail } of wrong) {
      const row = field && !body.querySelector(`.option.bad[data-path="${CSS.escape(field)}"]`) ? form?.mark(field, detail, true) : null;
      if (row) marked.set(row, detail);
    }
  };
  const build = (doc) => {
    const write = () => {
      source = JSON.stringify(doc, null, 2);
      text.textContent = source;
      changed(source);
    };
    form = optionForm(options, doc, write);
    body.replaceChildren(form.node);
    markFaults();
  };
  const render = () => {
    text.textContent = source;
    if (options === null) return;
    let doc = {};
    try { if (source !== "") doc = JSON.parse(source); } catch { doc = null; } // the submit panel reports the error
    const editable = doc !== null && !holdsLargeNumber(doc);
    note.textContent = editable ? "An option is in the document when its box is ticked."
      : "The form cannot edit this document: it is not valid JSON, or holds a whole number above 2^53. Edit the file and drop it again.";
    form = null;
    body.replaceChildren();
    if (editable) build(doc);
  };
  const open = async () => {
    if (options === null) {
      try { options = (await getJson("/v1/options")).options; } catch (error) { note.textContent = error.message; return; }
    }
    if (form === null) render();
  };
  const node = el("details", { id: "editor", ontoggle: () => { if (node.open) open(); } },
    el("summary", {}, "The job document and all options"), note, save, el("div", { class: "columns editor" }, body, text));
  return {
    node,
    // Opens the form with a document that another job has, and returns its text: indented, if no number is rounded by that.
    load(now) {
      const doc = JSON.parse(now);
      source = holdsLargeNumber(doc) ? now : JSON.stringify(doc, null, 2);
      render();
      node.open = true;
      return source;
    },
    show(now) { source = now; render(); }, // a document from a file
    // Faults of the document: the rows of these fields are marked, and no others.
    faults(list) { wrong = list; markFaults(); },
    async mark(field, message) {
      node.open = true;
      await open();
      form?.mark(field, message);
    },
  };
}
