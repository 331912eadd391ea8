// The tab "Parameters": the fitted numbers with their meanings; models compared, correlations and the course of the fit
// are folded. While the fit runs, its course is the content.
import { card, el } from "../page_parts.js";
import { radiusPlot } from "../comparison.js";
import { correlationTable } from "../record/correlation_table.js";
import { choiceOf, fitted, models, radiusSearch } from "../result_view.js";
import { fitBeside } from "../job/fit_details.js";
import { modelTable, parameterTable, profileModels } from "../job/parameter_table.js";
import { profilePlot } from "../job/profile_plot.js";

const folded = (title, id, ...content) => el("section", { class: "card" }, el("details", { id }, el("summary", {}, title), ...content));

function profileCards(job, files, meaningOf) {
  const { profile } = job.result;
  return [card("Measured and fitted profile", profilePlot(profile, files)),
    card("Models fitted to the profile", profileModels(profile.models)),
    ...profile.models.map((m) => (m.best ? card(`Parameters of ${m.id}`, parameterTable(fitted(m), meaningOf(m.id), "parameters"))
      : folded(`Parameters of ${m.id}`, null, parameterTable(fitted(m), meaningOf(m.id)))))];
}

function fitCards(job, meaningOf) {
  const compete = models(job), radius = radiusSearch(job), beside = fitBeside(job), correlated = correlationTable(job), list = fitted(job);
  return [list.length ? el("section", { class: "card" }, el("div", { class: "card-head" }, el("h2", {}, "Fitted parameters"), el("a", { href: "#glossary" }, "Glossary")), parameterTable(list, meaningOf(job.result.model), "parameters")) : "",
    compete.length > 1 ? card("Models compared", ...modelTable(compete, choiceOf(job))) : "",
    ...compete.filter((m) => !m.best).map((m) => folded(`Parameters of ${m.id}`, null, parameterTable(m.parameters, meaningOf(m.id)))),
    beside ? card("More about the fit", beside) : "",
    radius ? card("Fiber radius", radiusPlot(radius)) : "",
    correlated ? folded("Correlations of the parameters", "correlations", correlated) : ""];
}

export const parametersTab = {
  name: "parameters",
  title: "Parameters",
  has: ({ job, charts }) => Boolean(job.result?.parameters?.length || job.result?.profile) || charts.drawn,
  key: ({ job }) => [job.generation, job.state === "succeeded"],
  make({ job, list, charts, meaningOf }) {
    const done = job.state === "succeeded" && job.result;
    const parts = !done ? [] : job.result.profile ? profileCards(job, list.files, meaningOf) : fitCards(job, meaningOf);
    const course = el("details", { id: "course", open: !done, ontoggle: () => charts.resize() }, el("summary", {}, "Course of the fit"), charts.node);
    return { node: el("div", {}, parts, charts.drawn ? el("section", { class: "card" }, course) : ""), shown: () => charts.resize() };
  },
};
