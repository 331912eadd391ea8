// The tabs of a page. A tab stands in the address (#ROOT/NAME), so that Back, a reload, a link and a second browser tab
// work as readers expect.
import { el } from "../page_parts.js";

export class TabBar {
  // root: the address of the page without its tab; tabs: [{name, title}] in their order
  constructor(root, tabs, label) {
    this.root = root;
    this.tabs = tabs;
    this.offered = "";
    this.node = el("nav", { class: "tab-bar", "aria-label": label });
  }

  // names: of the tabs that have content; the others are not shown.
  offer(names, active) {
    const key = JSON.stringify([names, active]);
    if (key === this.offered) return;
    this.offered = key;
    const held = this.node.contains(document.activeElement) ? document.activeElement.getAttribute("data-tab") : null;
    this.node.replaceChildren(...this.tabs.filter((t) => names.includes(t.name)).map((t) => {
      const link = el("a", { href: `#${this.root}/${t.name}`, class: t.name === active ? "active" : "", "aria-current": t.name === active ? "page" : null }, t.title);
      link.dataset.tab = t.name;
      return link;
    }));
    const again = [...this.node.querySelectorAll("a")].find((link) => link.dataset.tab === held);
    if (again) again.focus({ preventScroll: true });
  }
}
