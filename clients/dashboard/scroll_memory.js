// Scroll positions of the history: Back and Forward return to the place where a page was left. The browser forgets it,
// because a page has its height only when its answers have arrived.
const KEY = "selvedge-scroll-", PATIENCE_MS = 4000;
let timer = null, restoring = null;

const entry = () => {
  if (!history.state?.entry) history.replaceState({ ...history.state, entry: `${Date.now().toString(36)}${Math.random().toString(36).slice(2, 8)}` }, "");
  return history.state.entry;
};

const keep = () => { if (!restoring) sessionStorage.setItem(KEY + entry(), String(Math.round(window.scrollY))); };

function stop() {
  clearInterval(restoring);
  restoring = null;
}

// Scrolls to the place at which this entry of the history was left, as soon as the page is tall enough. Returns false
// for a new entry.
export function restoreScroll() {
  stop();
  clearTimeout(timer);
  const wanted = history.state?.entry ? Number(sessionStorage.getItem(KEY + history.state.entry) ?? NaN) : NaN;
  entry();
  if (!Number.isFinite(wanted)) return false;
  const end = performance.now() + PATIENCE_MS;
  const step = () => {
    const most = document.documentElement.scrollHeight - window.innerHeight;
    window.scrollTo(0, Math.min(wanted, most));
    if (most >= wanted || performance.now() > end) stop();
  };
  restoring = setInterval(step, 50);
  step();
  return true;
}

history.scrollRestoration = "manual";
window.addEventListener("click", keep, { capture: true }); // a link leaves this entry
window.addEventListener("scroll", () => { clearTimeout(timer); timer = setTimeout(keep, 100); }, { passive: true });
for (const event of ["wheel", "touchstart", "keydown", "pointerdown"]) window.addEventListener(event, stop, { passive: true });
