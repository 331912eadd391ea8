// Entry point of the dashboard: "#" shows the list of jobs, "#ID" shows one job.
import { el } from "./page_parts.js";
import { listPage } from "./list_page.js";
import { jobPage } from "./job_page.js";

const page = document.getElementById("page");
const crumb = document.getElementById("crumb");
let leave = null;

function route() {
  if (leave) leave();
  const id = decodeURIComponent(location.hash.slice(1));
  page.replaceChildren();
  crumb.replaceChildren();
  window.scrollTo(0, 0);
  if (/^[A-Za-z0-9_-]{1,80}$/.test(id)) {
    crumb.append(el("a", { href: "#" }, "Jobs"), " › ", el("span", { class: "mono" }, id));
    leave = jobPage(page, id);
  } else {
    document.title = "Selvedge";
    leave = listPage(page);
  }
}

window.addEventListener("hashchange", route);
route();
