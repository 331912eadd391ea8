// The page of one job: name, state and actions; the result first, then tabs. A tab is made when it is looked at, and made
// anew when its content is another.
import { el, percent, refill, stateTag } from "../page_parts.js";
import { RepairPanel, failedByInput } from "../repair/repair_panel.js";
import { configurations, parameterMeanings } from "../result_view.js";
import { getJson, poll, sendJson } from "../server_link.js";
import { JobCharts } from "./job_charts.js";
import { frontKey, jobFront } from "./job_front.js";
import { LIVE, MAKING, factsOf, laterOf, notesOf, stagesOf } from "./job_progress.js";
import { actionsTab } from "../actions/actions_tab.js";
import { TabBar } from "../tabs/tab_bar.js";
import { filesTab } from "../tabs/files_tab.js";
import { geometryTab } from "../tabs/geometry_tab.js";
import { logTab } from "../tabs/log_tab.js";
import { parametersTab } from "../tabs/parameters_tab.js";
import { picturesTab } from "../tabs/pictures_tab.js";
import { rowsTab } from "../tabs/rows_tab.js";
import { settingsTab } from "../tabs/settings_tab.js";

/** @type {any[]} */
const TABS = [parametersTab, picturesTab, geometryTab, rowsTab, actionsTab, filesTab, settingsTab, logTab];
const LIST_EVERY = 4; // polls of a running job from one list of its files to the next
// The tab that opens without one in the address: of a job that runs, the first of these with content.
const FIRST_OF_LIVE = ["pictures", "geometry", "parameters", "log"];
const NO_FILES = { files: [], archive: null };

class JobPage {
  constructor(page, id, tab) {
    this.page = page;
    this.id = id;
    this.wanted = tab; // the tab of the address
    this.active = null; // the tab that is shown
    this.gone = false;
    this.generation = this.about = this.meanings = this.view = null;
    this.list = NO_FILES;
    this.listKey = "";
    this.nPoll = 0;
    this.head = el("div", { class: "head" });
    this.stages = el("div", { class: "stages" });
    this.facts = el("div", { class: "facts" });
    this.notes = el("div");
    this.later = el("div"); // what is made after the result
    this.front = { node: null, close: () => {} };
    this.frontPlace = el("div");
    this.bar = new TabBar(id, TABS, "parts of this job");
    this.panel = el("div", { class: "tab-panel", id: "tab" });
    this.made = new Map(); // name -> {key, part}
    this.charts = new JobCharts();
    this.repair = new RepairPanel(id, () => this.poller.wake());
    this.pair = { wanted: null }; // the row whose pictures the tab "Pictures" is to open
    page.append(el("section", { class: "card", id: "state" }, this.head, this.stages, this.facts, this.later, this.notes), this.repair.node, this.frontPlace, this.bar.node, this.panel);
    this.poller = poll(() => this.round());
  }

  act(verb) {
    return async (event) => {
      event.target.disabled = true;
      try {
        if (verb === "delete") {
          if (!confirm("Delete this job with its inputs and results?")) { event.target.disabled = false; return; }
          await sendJson("DELETE", `/v1/jobs/${this.id}`);
          location.hash = "";
        } else await sendJson("POST", `/v1/jobs/${this.id}/${verb}`);
        this.poller.wake();
      } catch (error) { this.notes.replaceChildren(el("p", { class: "note bad" }, error.message)); event.target.disabled = false; }
    };
  }

  buttons(job) {
    return [
      job.state === "draft" && !job.missing_files.length ? el("button", { class: "main", onclick: this.act("start") }, "Start") : null,
      LIVE.has(job.state) ? el("button", { onclick: this.act("cancel"), disabled: job.cancel_requested }, job.cancel_requested ? "Stopping ..." : "Cancel") : null,
      job.state === "failed" || job.state === "cancelled" ? el("button", { class: failedByInput(job) ? "" : "main", onclick: this.act("retry") }, "Retry from checkpoint") : null,
      el("a", { class: "button", href: `#new?copy=${this.id}` }, "Copy with changes"),
      LIVE.has(job.state) ? null : el("button", { onclick: this.act("delete") }, "Delete"),
    ];
  }

  // A job that does not exist, or no longer: the page says so instead of staying empty.
  missing(error) {
    this.gone = true;
    this.poller.stop();
    document.title = "No such job – Selvedge";
    this.page.replaceChildren(el("section", { class: "card", id: "no-job" }, el("h1", {}, "There is no such job"), el("p", {}, error.message),
      el("p", {}, "It was deleted, belongs to somebody else, or the address is mistyped. ", el("a", { href: "#" }, "All jobs"))));
  }

  async fetchJob() {
    try {
      const job = { ...await getJson(`/v1/jobs/${this.id}`) };
      job.result = job.result_url ? await getJson(job.result_url) : null; // answered with 304 while it is the same
      job.parameters = job.result?.parameters ?? null;
      return job;
    } catch (error) {
      if (error.status === 404) this.missing(error);
      throw error;
    }
  }

  async fetchList(job) {
    const later = job.state === "succeeded" ? await getJson(`/v1/jobs/${this.id}/pictures`).catch(() => null) : null;
    this.pictures = later;
    const key = JSON.stringify([job.state, job.generation, job.attempt, job.stage, job.finished_unix_s, later?.state, later?.fraction]);
    if (job.state === "draft" || (key === this.listKey && (!LIVE.has(job.state) || this.nPoll % LIST_EVERY !== 0))) return;
    this.list = await getJson(`/v1/jobs/${this.id}/results`).catch((error) => { if (error.status === 404) return NO_FILES; throw error; });
    this.listKey = key;
  }

  closeAll() {
    for (const { part } of this.made.values()) part.close?.();
    this.made.clear();
    this.front.close();
  }

  showHead(job) {
    document.title = `${job.state === "running" ? `${Math.round(100 * job.fraction)} % ` : ""}${job.sample} – Selvedge`;
    refill(this.head, [job.sample, job.state, job.error?.code, job.cancel_requested, job.missing_files], () => [el("h1", {}, job.sample), stateTag(job.state), el("span", { class: "space" }), ...this.buttons(job)]);
    refill(this.stages, [job.state, job.i_stage, job.stage_fraction], () => stagesOf(job, this.about.stages));
    refill(this.facts, [job.state, job.message, job.fraction, job.eta_s, job.step, job.attempt, job.finished_unix_s], () => factsOf(job));
    refill(this.later, [job.state, this.pictures?.state, percent(this.pictures?.fraction ?? 0, 0)], () => laterOf(job.state === "succeeded" ? this.pictures : null, (verb) => this.act(`pictures/${verb}`)));
    refill(this.notes, [job.warnings, job.error, job.state, job.missing_files], () => notesOf(job));
  }

  showFront(view) {
    const key = JSON.stringify(frontKey(view));
    if (key === this.frontKey) return;
    this.frontKey = key;
    this.front.close();
    this.front = jobFront(view);
    this.frontPlace.replaceChildren(...[this.front.node].filter(Boolean));
  }

  // The tab of an address without one, or whose tab has no content yet. It stays while the state of the job does.
  usualTab({ state }, names) {
    if (state === "succeeded") return this.active && this.stateOfActive === state && names.includes(this.active) ? this.active : names[0];
    if (this.stateOfActive === state && this.active !== "log" && names.includes(this.active)) return this.active;
    if (state === "draft") return "settings";
    return LIVE.has(state) ? FIRST_OF_LIVE.find((name) => names.includes(name)) : "log";
  }

  // Makes the tab that the address names, or the usual one.
  async showTab() {
    const { view } = this;
    if (!view) return;
    const names = TABS.filter((t) => t.has(view)).map((t) => t.name), name = names.includes(this.wanted) ? this.wanted : this.usualTab(view.job, names);
    const tab = TABS.find((t) => t.name === name), key = JSON.stringify(tab.key(view));
    this.stateOfActive = view.job.state;
    this.bar.offer(names, name);
    const known = this.made.get(name);
    if (known?.key !== key) {
      known?.part.close?.();
      this.made.set(name, { key, part: tab.make(view) });
    }
    const { part } = this.made.get(name), turned = this.panel.firstChild !== part.node;
    if (turned) this.panel.replaceChildren(part.node);
    this.active = name;
    if (turned) part.shown?.();
    await part.update?.(view);
  }

  // Another tab of the same job, from its address.
  turn(tab) {
    this.wanted = tab;
    if (!tab) this.active = null;
    this.showTab().catch((error) => console.error(error));
  }

  async round() {
    this.about ??= await getJson("/v1/about");
    this.meanings ??= parameterMeanings((await getJson("/v1/options")).models);
    const job = await this.fetchJob(), { id, about, charts, pair, meanings } = this;
    if (this.gone) return 5;
    if (job.generation !== this.generation) {
      this.generation = job.generation;
      this.closeAll();
      this.list = NO_FILES;
      this.listKey = "";
    }
    await this.fetchList(job);
    this.nPoll++;
    if (this.gone) return 5;
    const compared = job.state === "succeeded" ? configurations(job, new Map(this.list.files.map((f) => [f.path, f.url]))) : [];
    this.view = { id, job, about, charts, pair, list: this.list, compared, meaningOf: (model) => (p) => meanings.get(`${model} ${p.name}`) ?? "" };
    this.showHead(job);
    await this.repair.update(job);
    await charts.update(job);
    if (this.gone) return 5;
    this.showFront(this.view);
    await this.showTab();
    return job.state === "running" ? 1 : LIVE.has(job.state) || MAKING.has(this.pictures?.state) ? 2 : 10;
  }

  leave() {
    this.gone = true;
    this.poller.stop();
    this.charts.destroy();
    this.closeAll();
  }
}

export const jobPage = (page, id, tab) => new JobPage(page, id, tab);
