// The tab "Log": the last lines, the whole log by ranges, the course of the objective, and checks of the fit's inside.
import { card, el } from "../page_parts.js";
import { fitInside } from "../job/fit_details.js";
import { LogTail, WholeLog } from "../job/log_tail.js";

export const logTab = {
  name: "log",
  title: "Log",
  has: () => true,
  key: ({ job }) => [job.generation, job.state === "succeeded"],
  make({ id, job, charts }) {
    const lines = el("pre", { class: "log", tabIndex: 0, role: "region", "aria-label": "the last lines of the log" });
    const tail = new LogTail(lines), inside = job.state === "succeeded" ? fitInside(job) : null;
    const whole = el("details", { id: "whole-log", ontoggle: () => {
      if (whole.childElementCount > 1) return;
      const log = new WholeLog(id);
      whole.append(log.node);
      log.show(0);
    } }, el("summary", {}, "The whole log"));
    return {
      node: el("div", {}, card("Log", lines, whole), charts.fits ? card("Course of the objective", charts.objectiveNode) : "",
        inside ? card("Inside the fit", inside) : ""),
      shown: () => charts.resize(),
      update: () => tail.update(id),
    };
  },
};
