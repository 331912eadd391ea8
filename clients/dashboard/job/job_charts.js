// Draws the curves of one fit from the incremental series: relative error (log axis) and one chart for each parameter in
// one place, the objective in another.
import { CurveChart } from "./curve_charts.js";
import { el } from "../page_parts.js";
import { describedParameters, finite, parameterGroups } from "../result_view.js";
import { getJson } from "../server_link.js";

const BAND = 2; // standard errors
const MAX_POINT = 200; // a chart has some 250 to 600 pixels; drawing takes time with each point
const RGB = ["--red", "--green", "--blue"];

function band(value, se, { positive = false, lower = 0, upper = Infinity } = {}) {
  if (finite(value) === null || (positive && value <= 0)) return null;
  const half = finite(se) === null ? 0 : BAND * se;
  // bands end at the bounds of the parameter
  return [Math.max(value - half, positive ? value * 0.05 : lower), value, Math.min(value + half, upper)];
}

function block(title, tall) {
  const legend = el("span", { class: "legend" }), node = el("div", { class: tall ? "chart tall" : "chart" });
  return { legend, node, box: el("div", {}, el("div", { class: "chart-title" }, el("span", {}, title), legend), node) };
}

export class JobCharts {
  constructor() {
    this.node = el("div", { class: "course" });
    this.objectiveNode = el("div");
    this.reset(null);
  }

  get drawn() { return this.charts.length > 0; }

  reset(generation) {
    this.destroy();
    this.generation = generation;
    this.points = [];
    this.after = -1;
    this.charts = [];
    this.parameterCharts = null;
    this.models = [];
    this.chosen = null; // the model that the user has chosen
    this.node.replaceChildren();
    this.objectiveNode.replaceChildren(el("p", { class: "hint" }, "The curve appears when the fit has started."));
  }

  async update(job) {
    this.fits = Boolean(job.document?.photographs || job.document?.measurements);
    if (job.generation !== this.generation) this.reset(job.generation);
    for (let round = 0; round < 20; round++) {
      const series = await getJson(`/v1/jobs/${job.id}/series?after_step=${this.after}&max_points=${MAX_POINT}`);
      if (series.generation !== undefined && series.generation !== this.generation) { this.reset(series.generation); continue; }
      if (series.points.length === 0) break;
      this.models = series.models ?? [];
      this.points.push(...series.points);
      this.after = series.next_after_step ?? this.points[this.points.length - 1].step;
      // read the series again, merged to fewer points by the server
      if (this.points.length > 2 * MAX_POINT) { this.points = []; this.after = -1; continue; }
      this.draw(job);
    }
    if (this.charts.length > 0 && this.shown !== this.wanted(job)) this.draw(job); // the job has ended without new points
  }

  // The model to be shown: the user's choice, else the best one of a finished job, else the one that is being fitted.
  wanted(job) {
    const best = this.models.findIndex((m) => m.id === job.result?.model);
    return this.chosen ?? (best >= 0 ? best : this.points[this.points.length - 1].i_model ?? 0);
  }

  // Draws the curves of one model at a time, because different models have different parameters.
  draw(job) {
    const model = this.wanted(job);
    if (this.charts.length === 0 || this.shown !== model) this.build(job, model);
    this.drawTabs(job);
    const p = this.points.filter((x) => (x.i_model ?? 0) === model);
    this.objective.set(p.map((x) => [x.step, band(x.objective, x.objective_se, { positive: true })]));
    this.rms.set(p.map((x) => [x.step, finite(x.rel_rms) === null || x.rel_rms <= 0 ? null : [100 * x.rel_rms, 100 * x.rel_rms, 100 * x.rel_rms]]));
    for (const { group, chart } of this.parameterCharts)
      chart.set(p.map((x) => [x.step, ...group.flat.map((f) => band(x.parameter?.[f.i], x.parameter_se?.[f.i], this.parameters[f.i]))]));
  }

  drawTabs(job) {
    if (this.models.length < 2) return;
    this.tabs.replaceChildren(...this.models.map((m, i) => el("button", { class: i === this.shown ? "main" : "", onclick: () => { this.chosen = i; this.draw(job); } }, m.id)));
  }

  build(job, model) {
    this.destroy();
    this.shown = model;
    this.tabs = el("p", { class: "tabs", id: "models-shown" });
    const objective = block("Objective f ± 2 s.e. (log)", true), rms = block("Relative error of the fitted rows, % (log)");
    this.objectiveNode.replaceChildren(objective.box);
    this.objective = new CurveChart(objective.node, objective.legend, ["f"], ["--accent"], { log: true });
    this.rms = new CurveChart(rms.node, rms.legend, ["%"], ["--warn"], { log: true, digits: 3 });
    const n = this.points.find((x) => (x.i_model ?? 0) === model)?.parameter?.length ?? 0;
    this.parameters = describedParameters(this.models[model], job, n);
    this.parameterCharts = parameterGroups(this.parameters).filter((g) => g.flat.some((f) => !this.parameters[f.i].fixed)).map((group) => {
      const part = block(group.symbol + (group.unit ? ` (${group.unit === "deg" ? "°" : group.unit})` : ""));
      const colours = group.flat.map((f) => (f.channel < 0 ? "--accent" : RGB[f.channel]));
      const labels = group.flat.map((f) => (f.channel < 0 ? f.name : "rgb"[f.channel]));
      return { group, box: part.box, chart: new CurveChart(part.node, part.legend, labels, colours, { digits: 4 }) };
    });
    const sets = [...new Set(this.parameterCharts.map((c) => c.group.set))];
    this.node.replaceChildren(this.tabs, rms.box, ...sets.flatMap((set) => [sets.length > 1 ? el("h3", {}, set || "cloth") : "",
      el("div", { class: "charts" }, this.parameterCharts.filter((c) => c.group.set === set).map((c) => c.box))]));
    this.charts = [this.objective, this.rms, ...this.parameterCharts.map((c) => c.chart)];
  }

  // To be called when the charts become visible: a chart in a hidden tab has no size.
  resize() {
    for (const chart of this.charts) chart.resize();
  }

  destroy() {
    for (const chart of this.charts ?? []) chart.destroy();
    this.charts = [];
  }
}
