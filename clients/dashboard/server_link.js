// Communication with the daemon: JSON with ETags, problem documents as errors, and polling that slows down on hidden
// pages.

export class Problem extends Error {
  constructor(status, body) {
    const field = body?.field ? `${body.field}: ` : "";
    const detail = body?.detail ?? body?.title ?? `the server answered with status ${status}`;
    super(body?.field && detail.includes(body.field) ? detail : field + detail);
    this.status = status;
    this.body = body;
  }
}

const cached = new Map(); // url -> {etag, value}; a page requests only a few addresses
const KEEP = 40;

// A 401 shows the page that asks for a token; the cookie that it gets is sent by the browser, and no script can read it.
export async function raw(method, url, { body = null, header = {}, signal = null } = {}) {
  const answer = await fetch(url, { method, body, headers: header, signal, cache: "no-store", credentials: "same-origin" });
  if (answer.status === 401 && url !== "/v1/session") window.dispatchEvent(new Event("sign-in"));
  if (!answer.ok && answer.status !== 304) {
    let problem = null;
    try { problem = await answer.json(); } catch { /* not a problem document */ }
    throw new Problem(answer.status, problem);
  }
  return answer;
}

// Forgets all answers, because another user may see others.
export const forget = () => cached.clear();

export async function getJson(url) {
  const known = cached.get(url);
  const answer = await raw("GET", url, { header: known ? { "If-None-Match": known.etag } : {} });
  if (answer.status === 304) return known.value;
  const value = await answer.json();
  const etag = answer.headers.get("ETag");
  cached.delete(url);
  if (etag) cached.set(url, { etag, value });
  if (cached.size > KEEP) cached.delete(cached.keys().next().value);
  return value;
}

export async function sendJson(method, url, value, header = {}) {
  const answer = await raw(method, url, {
    body: value === undefined ? null : JSON.stringify(value),
    header: value === undefined ? header : { "Content-Type": "application/json", ...header },
  });
  return answer.status === 204 ? null : answer.json();
}

const connection = document.getElementById("connection");
function showConnection(error) {
  connection.textContent = error ? error : "";
  connection.classList.toggle("lost", Boolean(error));
}

// Calls `work` repeatedly until stop() is called. `work` returns the seconds to wait, or throws an AbortError to begin
// anew at once. A hidden page waits ten times as
// long, and polls at once when it is shown again. After errors the wait grows.
export function poll(work) {
  let stopped = false, timer = null, failures = 0, busy = false;
  const round = async () => {
    if (stopped || busy) return;
    busy = true;
    let wait = 5;
    try {
      wait = await work();
      failures = 0;
      showConnection(null);
    } catch (error) {
      const begun = error.name === "AbortError";
      if (!begun) failures++;
      wait = begun ? 0 : Math.min(30, 2 ** failures);
      if (!stopped && !begun) showConnection(error instanceof Problem ? error.message : "The server does not reply; trying again.");
      if (!begun && !(error instanceof Problem) && !(error instanceof TypeError)) console.error(error);
    }
    busy = false;
    if (!stopped) timer = setTimeout(round, 1000 * wait * (document.hidden ? 10 : 1));
  };
  const wake = () => {
    if (document.hidden || stopped) return;
    clearTimeout(timer);
    round();
  };
  document.addEventListener("visibilitychange", wake);
  round();
  return {
    wake,
    stop() {
      stopped = true;
      clearTimeout(timer);
      document.removeEventListener("visibilitychange", wake);
    },
  };
}
