// Shows a long list a page at a time.
import { el } from "./page_parts.js";

export class PagedList {
  // parent: the element that gets the items of a page; items: elements
  constructor(parent, items, size, label) {
    this.parent = parent;
    this.items = items;
    this.size = size;
    this.from = 0;
    this.place = el("span", { class: "hint", role: "status" });
    this.back = el("button", { type: "button", "aria-label": `previous ${label}`, onclick: () => this.show(this.from - this.size) }, "Previous");
    this.forth = el("button", { type: "button", "aria-label": `next ${label}`, onclick: () => this.show(this.from + this.size) }, "Next");
    this.pages = el("div", { class: "pages" }, this.back, this.forth, this.place);
    this.show(0);
  }

  // Shows the page that contains item `i`.
  show(i) {
    const n = this.items.length;
    this.from = Math.max(0, Math.floor(Math.min(i, n - 1) / this.size) * this.size);
    const to = Math.min(n, this.from + this.size);
    this.parent.replaceChildren(...this.items.slice(this.from, to));
    this.pages.hidden = n <= this.size;
    this.back.disabled = this.from === 0;
    this.forth.disabled = to >= n;
    this.place.textContent = `${this.from + 1} to ${to} of ${n}`;
  }

  // The same items in another order.
  reorder(items) {
    this.items = items;
    this.show(0);
  }
}
