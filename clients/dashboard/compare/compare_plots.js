// The tab "Plots" of a comparison: a scatter plot of two quantities, and parallel coordinates of several.
import { card, el } from "../page_parts.js";
import { parallelOf } from "./job_parallel.js";
import { quantities, varies } from "./job_quantities.js";
import { scatterOf } from "./job_scatter.js";

const AXES = 6; // of parallel coordinates at first

function select(id, list, chosen, change) {
  const groups = [...new Set(list.map((q) => q.group))];
  return el("select", { id, onchange: change }, groups.map((group) => el("optgroup", { label: group }, list.filter((q) => q.group === group).map((q) => el("option", { value: q.key, selected: q.key === chosen }, q.name)))));
}

// choice: what the reader has chosen before, {across, up, axes}, which is brought up to date
export function comparePlots(columns, choice) {
  const jobs = columns.filter((c) => c.job.result), list = quantities(jobs), find = (key) => list.find((q) => q.key === key);
  if (list.length === 0) return el("p", { class: "hint" }, "These jobs have no numbers to plot.");
  const first = list.find((q) => q.group === "Parameters" && varies(q, jobs)) ?? list[0];
  choice.up = find(choice.up)?.key ?? list[0].key;
  choice.across = find(choice.across)?.key ?? (find("finished") ?? first).key;
  choice.axes ??= list.filter((q) => varies(q, jobs) && q.key !== "finished" && q.key !== "tag").slice(0, AXES).map((q) => q.key);
  const scatter = el("div", { id: "job-scatter" }), parallel = el("div", { id: "job-parallel" });
  const up = select("plot-up", list, choice.up, () => draw()), across = select("plot-across", list, choice.across, () => draw());
  const boxes = list.map((q) => el("label", {}, el("input", { type: "checkbox", value: q.key, checked: choice.axes.includes(q.key), onchange: () => draw() }), q.name));
  const draw = () => {
    choice.up = up.value;
    choice.across = across.value;
    choice.axes = boxes.map((b) => b.querySelector("input")).filter((b) => b.checked).map((b) => b.value);
    scatter.replaceChildren(scatterOf(jobs, find(choice.across), find(choice.up)));
    parallel.replaceChildren(parallelOf(jobs, choice.axes.map(find).filter(Boolean)));
  };
  draw();
  return el("div", {},
    card("One quantity against another", el("div", { class: "choices" }, el("label", {}, "Up ", up), el("label", {}, "Across ", across)), scatter, el("p", { class: "hint" }, "A point is a job, with two standard errors either way. A click opens it.")),
    card("Parallel coordinates", el("p", { class: "hint" }, "Each line is a job, each axis a quantity from its least to its greatest value among these jobs."), parallel,
      el("details", {}, el("summary", {}, "Axes"), el("div", { class: "choices" }, boxes))));
}
