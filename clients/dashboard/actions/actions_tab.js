// The tab "Make more" of a finished job: a picture in another light, files for other programs and the twin, each a job of
// its own without a new fit.
import { card, el } from "../page_parts.js";
import { getJson, sendJson } from "../server_link.js";
import { LIGHTS, SHAPES, SIZES, STUDIO_SIZES, VIEWS, formatsOf, pictureRequest, studioRequest } from "./action_choices.js";
import { exportErrors } from "./export_errors.js";
import { MadeJobs } from "./made_jobs.js";
import { ShareCard } from "./share_card.js";

let nGroup = 0;

// Choices as drawings with their words; `chosen()` is the choice.
function choiceOf(title, list) {
  const name = `choice-${++nGroup}`;
  const inputs = list.map((c, i) => el("input", { type: "radio", name, value: c.id, checked: i === 0 }));
  return {
    node: el("fieldset", { class: "choices" }, el("legend", {}, title),
      list.map((c, i) => el("label", { class: c.draw ? "choice" : "choice words" }, inputs[i], c.draw ? c.draw() : null, el("span", {}, c.words)))),
    chosen: () => list[inputs.findIndex((input) => input.checked)],
  };
}

// A cloth with parameters can be shown; a scan alone, or the profile of a fiber, cannot.
const isCloth = ({ job, list }) => (job.parameters?.length ?? 0) > 0 && list.files.some((f) => f.path === "fibers.hair");

class Actions {
  constructor(view) {
    this.id = view.id;
    this.made = new MadeJobs(view.id);
    this.note = el("p", { class: "note bad", hidden: true, role: "alert" });
    this.formats = el("div", { class: "formats" });
    const own = exportErrors(view.job);
    const twin = view.list.files.some((f) => f.path === "twin/twin.bin");
    const makers = isCloth(view) ? [this.studioCard(), this.pictureCard(), el("div", { class: "columns" },
      card("Files for other programs", this.formats, this.button("make-export", "Make the files", () => this.exportRequest()),
        own ? el("p", { class: "hint" }, "Files that this job has made itself:") : "", own ?? ""),
      card("The cloth to turn with the mouse",
        el("p", { class: "hint" }, twin ? "This job has it: it stands at the top of the page." : "Tables from which a browser shows the cloth while it is turned, bent and lit. They take one to three minutes of a processor."),
        twin ? "" : this.button("make-twin", "Make the twin", () => ({ twin: { make: true } })))),
      el("p", { class: "hint" }, "Each of these is a job of its own, without a new fit. It shows below, and in the list of jobs.")] : [];
    this.node = el("div", { id: "actions" }, ...makers, this.note, this.made.node, new ShareCard(view.id).node);
    if (makers.length) this.showFormats().catch((error) => this.fail(error));
  }

  studioCard() {
    const view = choiceOf("View", VIEWS), size = choiceOf("Size", STUDIO_SIZES);
    return card("A picture in the studio", view.node, size.node, this.button("make-studio", "Make the picture", () => studioRequest(view.chosen(), size.chosen())));
  }

  pictureCard() {
    const shape = choiceOf("Shape", SHAPES), light = choiceOf("Light", LIGHTS), size = choiceOf("Size", SIZES);
    return card("A picture with a lamp of your choice", shape.node, light.node, size.node,
      this.button("make-picture", "Make the picture", () => pictureRequest(shape.chosen(), light.chosen(), size.chosen())));
  }

  async showFormats() {
    this.boxes = formatsOf((await getJson("/v1/options")).options).map((f) => ({ id: f.id, box: el("input", { type: "checkbox", value: f.id }), words: f.words }));
    this.formats.replaceChildren(...this.boxes.map((f) => el("label", { class: "format" }, f.box, el("span", {}, el("b", {}, f.id), ` ${f.words}`))));
  }

  exportRequest() {
    const wanted = (this.boxes ?? []).filter((f) => f.box.checked).map((f) => [f.id, true]);
    if (wanted.length === 0) throw new Error("Choose a format first.");
    return { export: Object.fromEntries(wanted) };
  }

  fail(error) {
    this.note.textContent = error?.message ?? "";
    this.note.hidden = !error;
  }

  button(id, words, request) {
    const button = el("button", { id, class: "main", onclick: async () => {
      button.disabled = true;
      try {
        this.fail(null);
        await sendJson("POST", `/v1/jobs/${this.id}/derive`, request(), { "Idempotency-Key": crypto.randomUUID?.() ?? `${Date.now()}-${Math.random()}` });
        this.made.wake();
        this.made.node.scrollIntoView?.({ block: "nearest" });
      } catch (error) { this.fail(error); }
      button.disabled = false;
    } }, words);
    return button;
  }
}

export const actionsTab = {
  name: "more",
  title: "Make and share",
  has: ({ job }) => job.state === "succeeded",
  key: (view) => [view.job.generation, view.job.state, isCloth(view)],
  make(view) {
    const actions = new Actions(view);
    return { node: actions.node, close: () => actions.made.close() };
  },
};
