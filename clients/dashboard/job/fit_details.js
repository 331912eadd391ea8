// Shows results of a fit beyond its parameters, in three places: numbers of the cloth and comparisons beside the
// parameters; gains, textures and the next photograph beside the rows; checks of the fit's inside beside the log.
import { el, isNumber, percent, percentWithError, withError } from "../page_parts.js";

function table(id, heads, rows) {
  return el("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": `table ${id}` }, el("table", { id }, el("thead", {}, el("tr", {}, heads.map((h) => el("th", { class: h.startsWith("#") ? "number" : null }, h.replace("#", ""))))), el("tbody", {}, rows)));
}

const number = (text) => el("td", { class: "number" }, text);
const tag = (text, kind = "warn") => el("span", { class: `tag ${kind}` }, text);

function nuisance(result) {
  const list = result.nuisance ?? [];
  if (!list.length) return null;
  const name = { gain: "gain of all photographs", stray_light: "stray light (radiance)" };
  return el("div", {}, el("h3", {}, "Nuisance terms"),
    table("nuisance", ["Term", "#Value ± standard error", ""], list.map((n) => el("tr", {}, el("td", {}, name[n.name] ?? n.name), number(withError(n.value, n.standard_error)), el("td", {}, n.at_bound ? tag("at a bound") : "")))));
}

function gains(result) {
  const rows = (result.rows ?? []).filter((r) => isNumber(r.gain));
  if (!rows.length) return null;
  return el("div", {}, el("h3", {}, "Gain of each photograph"),
    el("p", { class: "hint" }, `With these gains the relative RMS error over the fitted rows is ${percentWithError(result.fit_rel_rms_with_gains, result.fit_rel_rms_with_gains_se)}` +
      (result.heldout_rel_rms_with_gains == null ? "." : `, over the held-out rows ${percentWithError(result.heldout_rel_rms_with_gains, result.heldout_rel_rms_with_gains_se)}.`)),
    table("gains", ["Photograph", "#Gain ± standard error", ""], rows.map((r) => el("tr", {}, el("td", { class: "mono" }, r.name), number(withError(r.gain, r.gain_se)),
      el("td", {}, Math.abs(r.gain - 1) > 3 * r.gain_se && Math.abs(r.gain - 1) > 0.05 ? tag("differs from the others") : "")))));
}

// Texture contrasts are squared values. The scatter of the block means, in per cent of their mean, is the square root
// of the contrast averaged over channels.
function textures(result) {
  const rows = (result.rows ?? []).filter((r) => r.texture);
  if (!rows.length) return null;
  const mean = (rgb) => (rgb[0] + rgb[1] + rgb[2]) / 3;
  // of a contrast that noise hides, the bound
  const scatter = (rgb, se) => {
    const contrast = mean(rgb), noise = mean(se);
    return contrast < 2 * noise ? `below ${percent(Math.sqrt(Math.max(0, contrast) + 2 * noise), 1)}` : percent(Math.sqrt(contrast), 1);
  };
  return el("div", {}, el("h3", {}, "Texture"),
    el("p", { class: "hint" }, `Scatter of the means of ${rows[0].texture.block_mm} mm blocks, in per cent of the mean.`),
    table("textures", ["Photograph", "Set", "#Measured", "#Rendered", ""], rows.map(({ name, set, texture: t }) => {
      const apart = Math.abs(mean(t.rendered) - mean(t.measured)), noise = Math.hypot(mean(t.rendered_se), mean(t.measured_se));
      return el("tr", {}, el("td", { class: "mono" }, name), el("td", {}, set), number(scatter(t.measured, t.measured_se)), number(scatter(t.rendered, t.rendered_se)),
        el("td", {}, apart > 3 * noise && apart > 0.3 * mean(t.measured) ? tag("differs") : ""));
    })));
}

function starts(result) {
  const list = result.starts ?? [];
  if (!list.length) return null;
  const names = result.parameters.map((p) => p.name);
  const short = (v) => v.map((x, i) => `${names[i]} ${Number(x.toPrecision(3))}`).join(", ");
  return el("div", {}, el("h3", {}, "Starts"),
    table("starts", ["Start", "#Sum of squared errors ± s.e.", "", "Ended at"], list.map((s, i) => el("tr", {}, el("td", { title: short(s.start) }, String(i + 1)), number(withError(s.objective, s.objective_se)),
      el("td", {}, s.kept ? tag("kept", "good") : "", s.converged ? "" : tag("not converged"), s.elsewhere ? tag("as good, elsewhere") : ""), el("td", { class: "hint" }, short(s.value))))));
}

function certificate(result) {
  const c = result.certificate;
  if (!c) return null;
  return el("div", { id: "certificate" }, el("h3", {}, "Gradient certificate ", tag(c.passed ? "passed" : "failed", c.passed ? "good" : "warn")),
    el("p", { class: "hint" }, `Derivatives of ${c.n_path} paths through this cloth, compared with finite differences over the same paths: the worst relative error is ${c.worst_rel_error.toExponential(1)} (${c.worst_parameter}), of which noise explains ${c.worst_noise.toExponential(1)} ± ${c.worst_noise_se.toExponential(0)}.`));
}

// The plain BRDF fitted to the same rows: a user's alternative to this twin.
function skill(result) {
  const plain = result.skill?.plain_brdf;
  if (!plain || !isNumber(plain.heldout_rel_rms)) return null;
  const better = result.skill.heldout_ratio < 1;
  return el("div", { id: "skill" }, el("h3", {}, "Skill ", tag(better ? "better than a plain BRDF" : "no better than a plain BRDF", better ? "good" : "warn")),
    el("p", { class: "hint" }, `A plain BRDF that knows nothing of the cloth, fitted to the same rows, has a relative RMS error of ${percent(plain.heldout_rel_rms, 2)} over the held-out rows; this fit has ${percentWithError(result.heldout_rel_rms, result.heldout_rel_rms_se)}.`));
}

const SHOWN_CANDIDATES = 8;

function nextPhotograph(result) {
  const list = result.next_photograph ?? [];
  if (!list.length) return null;
  const angle = (x) => number(`${Number(x.toPrecision(4))}°`);
  return el("div", {}, el("h3", {}, "Next photograph"),
    el("p", { class: "hint" }, `The best of ${list.length} candidates: those that would tell most about the parameters, and about where the model does not describe the cloth.`),
    table("next-photograph", ["#Light", "#phi", "#Camera", "#phi", "#Cloth turned", "#Information, nats", "#about misfit", ""], list.slice(0, SHOWN_CANDIDATES).map((c) => el("tr", {},
      angle(c.light_theta_deg), angle(c.light_phi_deg), angle(c.camera_theta_deg), angle(c.camera_phi_deg), angle(c.cloth_rotation_deg), number(c.information_nats.toFixed(2)), number((c.misfit_nats ?? 0).toFixed(2)),
      el("td", {}, c.determines.length ? tag(`determines ${c.determines.join(", ")}`, "good") : "")))));
}

// The fitted numbers of a described cloth.
function clothNumbers(result) {
  const list = result.cloth_numbers ?? [];
  if (!list.length) return null;
  return el("div", {}, el("h3", {}, "Numbers of the cloth"),
    el("p", { class: "hint" }, "Fitted together with the parameters, whose standard errors contain those of these numbers."),
    table("cloth-numbers", ["Number", "#Value ± standard error", "Unit", "#Range", ""], list.map((n) => el("tr", {}, el("td", { class: "mono" }, n.name), number(withError(n.value, n.standard_error)), el("td", {}, n.unit),
      number(`${n.lower} to ${n.upper}`), el("td", {}, n.determined ? "" : tag("these measurements do not determine it"), n.at_bound ? tag(`at its ${n.at_bound} bound`) : "")))));
}

// Changes to the fibers of a scan or a file that the photographs ask for, and the gain of each.
function corrections(result) {
  const without = result.without_corrections;
  if (!without) return null;
  const asked = without.asked_for;
  const scored = isNumber(without.heldout_gain), gains = scored && without.heldout_gain >= 2 * without.heldout_gain_se;
  const verdict = !scored ? null : gains ? tag("lower the held-out error", "good") : tag("not worth keeping", "warn");
  const errors = (r) => `${percentWithError(r.fit_rel_rms, r.fit_rel_rms_se)} over the fitted rows${isNumber(r.heldout_rel_rms) ? `, ${percentWithError(r.heldout_rel_rms, r.heldout_rel_rms_se)} over the held-out rows` : ""}`;
  return el("div", { id: "corrections" }, el("h3", {}, "Corrections of the fibers ", verdict),
    el("p", { class: "hint" }, asked.length ? `The photographs ask for ${asked.join(", ")}. ` : "The photographs ask for none of these corrections. ",
      `Relative RMS error without them: ${errors(without)}; with them: ${errors(result)}.`,
      scored ? ` They ${without.heldout_gain < 0 ? "raise" : "lower"} the held-out error by ${percent(Math.abs(without.heldout_gain), 2)} ± ${percent(without.heldout_gain_se, 2)}.` : ""));
}

// Returns these parts of the result, or null if there is nothing to show.
function shown(job, parts) {
  const made = job.result ? parts.map((part) => part(job.result)).filter((p) => p !== null) : [];
  return made.length ? el("div", { class: "fit-details" }, made) : null;
}
export const fitBeside = (job) => shown(job, [skill, clothNumbers, corrections, nuisance]);
export const fitOfRows = (job) => shown(job, [gains, textures, nextPhotograph]);
export const fitInside = (job) => shown(job, [certificate, starts]);
