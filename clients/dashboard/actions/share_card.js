// Links that show one job to someone without an account: made, listed and revoked.
import { el, refill, when } from "../page_parts.js";
import { getJson, sendJson } from "../server_link.js";

const DAYS = [[7, "a week"], [30, "30 days"], [90, "90 days"], [365, "a year"]];

export const shareAddress = (secret) => `${location.origin}${location.pathname}#share/${secret}`;

export class ShareCard {
  constructor(id) {
    this.id = id;
    this.days = el("select", { id: "share-days", "aria-label": "how long the link is valid" }, DAYS.map(([days, words]) => el("option", { value: String(days), selected: days === 30 }, words)));
    this.made = el("div", { class: "share-made", role: "status" });
    this.list = el("div");
    this.node = el("section", { class: "card", id: "share" }, el("h2", {}, "A link for someone without an account"),
      el("p", { class: "hint" }, "It shows this job and its results, and nothing else. Nothing can be changed with it. You can revoke it."),
      el("p", { class: "share-row" }, el("label", {}, "valid for ", this.days), el("button", { id: "make-share", class: "main", onclick: () => this.run(() => this.make()) }, "Make a link")),
      this.made, this.list);
    this.run(() => this.update());
  }

  async run(work) {
    try { await work(); } catch (error) { this.made.replaceChildren(el("p", { class: "note bad" }, error.message)); }
  }

  async make() {
    const share = await sendJson("POST", `/v1/jobs/${this.id}/shares`, { days: Number(this.days.value) });
    const address = el("input", { readOnly: true, value: shareAddress(share.secret), "aria-label": "address of the link", onfocus: (event) => event.target.select() });
    const copy = el("button", { onclick: async () => {
      address.select();
      await navigator.clipboard?.writeText(address.value);
      copy.textContent = "Copied";
    } }, "Copy");
    this.made.replaceChildren(el("p", { class: "share-row" }, address, copy), el("p", { class: "hint" }, "Copy it now: it is not shown again."),
      share.protected ? "" : el("p", { class: "note" }, "No access tokens are in use here, so whoever reaches this server sees every job, with or without a link."));
    await this.update();
  }

  async update() {
    const { shares } = await getJson(`/v1/jobs/${this.id}/shares`), open = shares.filter((s) => s.open);
    refill(this.list, open.map((s) => s.id), () => (open.length === 0 ? [] : [el("h3", {}, "Links that are valid"), el("ul", { class: "shares" }, open.map((s) => el("li", {},
      el("span", {}, `until ${when(s.expires_unix_s)}${s.made_by ? `, made by ${s.made_by}` : ""}`), el("button", { class: "revoke", onclick: () => this.run(async () => {
        await sendJson("DELETE", `/v1/jobs/${this.id}/shares/${s.id}`);
        this.made.replaceChildren();
        await this.update();
      }) }, "Revoke"))))]));
  }
}
