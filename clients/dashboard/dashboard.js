// Entry point of the dashboard: "#" shows the list of jobs, "#?state=failed" a part of it, "#ID" one job, "#new" the
// form for a new job ("#new?copy=ID" filled with the document of another), "#compare/ID,ID" several jobs side by side,
// "#batches" the batches, "#batch/ID" one of them, "#glossary" the words that the pages use. The pages of a job and of a
// comparison have tabs: "#ID/pictures". "#share/SECRET" shows one job to someone without an account.
import { sharedPage } from "./actions/shared_page.js";
import { batchPage } from "./batch/batch_page.js";
import { batchesPage } from "./batch/batches_page.js";
import { comparePage } from "./compare/compare_page.js";
import { el } from "./page_parts.js";
import { droppedFiles } from "./dropped_files.js";
import { glossaryPage } from "./glossary_page.js";
import { listPage } from "./list/list_page.js";
import { jobPage } from "./job/job_page.js";
import { restoreScroll } from "./scroll_memory.js";
import { showUser, signInPage } from "./sign_in.js";
import { submitPanel } from "./submit_panel.js";

const page = document.getElementById("page");
const crumb = document.getElementById("crumb");
const user = document.getElementById("user");
const ABOVE_PANEL = 110; // header and tabs
let leave = null, signingIn = false;
let handed = null; // files that were dropped on another page
let paged = { root: null, turn: null }; // the page that is shown, if it has tabs: its address without the tab

// A tab of the page that is shown already; the page stays, and the tabs come into view if they were above.
function turnTab(root, tab) {
  if (paged.root !== root) return false;
  paged.turn(tab);
  const panel = page.querySelector(".tab-panel"), top = panel ? window.scrollY + panel.getBoundingClientRect().top - ABOVE_PANEL : 0;
  if (!restoreScroll() && window.scrollY > top) window.scrollTo(0, top);
  return true;
}

function route() {
  const [id, query] = location.hash.slice(1).split("?"), [, root, tab] = /^((?:compare\/)?[^/]*)(?:\/([a-z]+))?$/.exec(id) ?? [null, id];
  if (!signingIn && turnTab(root, tab)) return;
  if (leave) leave();
  paged = { root: null, turn: null };
  signingIn = false;
  page.replaceChildren();
  crumb.replaceChildren();
  if (!restoreScroll()) window.scrollTo(0, 0);
  if (id === "new") {
    document.title = "New job – Selvedge";
    crumb.append(el("a", { href: "#" }, "Jobs"), " › New job");
    page.append(submitPanel(handed, new URLSearchParams(query ?? "").get("copy")));
    handed = null;
    leave = null;
  } else if (id.startsWith("compare/")) {
    crumb.append(el("a", { href: "#" }, "Jobs"), " › Comparison");
    const shown = comparePage(page, root.slice("compare/".length), tab);
    leave = () => shown.leave();
    paged = { root, turn: (name) => shown.turn(name) };
  } else if (/^share\/[\w-]{1,80}$/.test(id)) {
    crumb.append("A job that was shared with you");
    leave = sharedPage(page, id.slice("share/".length));
  } else if (id === "glossary") {
    crumb.append(el("a", { href: "#" }, "Jobs"), " › Glossary");
    leave = glossaryPage(page);
  } else if (id === "batches") {
    crumb.append(el("a", { href: "#" }, "Jobs"), " › Batches");
    leave = batchesPage(page);
  } else if (/^batch\/[0-9a-f-]{1,40}$/.test(id)) {
    crumb.append(el("a", { href: "#" }, "Jobs"), " › ", el("a", { href: "#batches" }, "Batches"), " › Batch");
    leave = batchPage(page, id.slice("batch/".length));
  } else if (/^[A-Za-z0-9_-]{1,80}$/.test(root)) {
    crumb.append(el("a", { href: "#" }, "Jobs"), " › ", el("span", { class: "mono" }, root));
    const shown = jobPage(page, root, tab);
    leave = () => shown.leave();
    paged = { root, turn: (name) => shown.turn(name) };
  } else {
    document.title = "Selvedge";
    leave = listPage(page, new URLSearchParams(query ?? ""));
  }
}

function askForToken() {
  if (signingIn) return;
  if (leave) leave();
  leave = null;
  paged = { root: null, turn: null };
  signingIn = true;
  page.replaceChildren();
  crumb.replaceChildren();
  user.replaceChildren();
  signInPage(page, () => { showUser(user, askForToken); route(); });
}

// Files may be dropped anywhere: they open the form for a new job.
window.addEventListener("dragover", (event) => event.preventDefault());
window.addEventListener("drop", async (event) => {
  event.preventDefault();
  if (signingIn || location.hash.startsWith("#new")) return;
  handed = await droppedFiles(event.dataTransfer);
  if (handed.files.length) location.hash = "new";
});
window.addEventListener("hashchange", route);
window.addEventListener("sign-in", askForToken);
if (!location.hash.startsWith("#share/")) showUser(user, askForToken);
route();
