// The page that asks for an access token, and who is signed in. The token itself is not kept: the server gives a cookie
// for it.
import { el } from "./page_parts.js";
import { forget, raw, sendJson } from "./server_link.js";

export function signInPage(page, done) {
  const token = el("input", { type: "password", autocomplete: "off", size: 60, name: "token", required: true, "aria-label": "Access token" });
  const fault = el("p", { class: "fault", role: "alert" });
  const form = el("form", {
    id: "sign-in",
    onsubmit: async (event) => {
      event.preventDefault();
      fault.textContent = "";
      try {
        await sendJson("POST", "/v1/session", { token: token.value.trim() });
        token.value = "";
        forget();
        done();
      } catch (error) {
        fault.textContent = error.status === 401 ? "This token is unknown or was revoked." : error.message;
      }
    },
  }, token, " ", el("button", { class: "main" }, "Sign in"));
  page.append(el("section", { class: "card" }, el("h2", {}, "Sign in"),
    el("p", { class: "hint" }, "This service needs an access token. Whoever runs it makes one: ", el("code", {}, "selvedge token make NAME --scope submit")),
    form, fault));
  token.focus();
}

// Shows the name of the token and a way out, where tokens are needed.
export async function showUser(place, out) {
  let who = null;
  try { who = await (await raw("GET", "/v1/session")).json(); } catch { /* nobody is signed in */ }
  place.replaceChildren(...(who?.token_needed ? [el("span", { title: `scope ${who.scope}` }, who.name), " ", el("button", {
    id: "sign-out",
    onclick: async () => {
      await raw("DELETE", "/v1/session");
      forget();
      out();
    },
  }, "Sign out")] : []));
}
