// Entry point of the dashboard: "#" shows the list of jobs, "#ID" shows one job.
import { el } from "./page_parts.js";
import { listPage } from "./list_page.js";
import { jobPage } from "./job_page.js";
import { showUser, signInPage } from "./sign_in.js";

const page = document.getElementById("page");
const crumb = document.getElementById("crumb");
const user = document.getElementById("user");
let leave = null, signingIn = false;

function route() {
  if (leave) leave();
  signingIn = false;
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

function askForToken() {
  if (signingIn) return;
  if (leave) leave();
  leave = null;
  signingIn = true;
  page.replaceChildren();
  crumb.replaceChildren();
  user.replaceChildren();
  signInPage(page, () => { showUser(user, askForToken); route(); });
}

window.addEventListener("hashchange", route);
window.addEventListener("sign-in", askForToken);
showUser(user, askForToken);
route();
