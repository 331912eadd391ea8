#include "optimizer/report/findings/verdict.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/job/document/json_number.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

/* Standard errors of the error that are subtracted before it is compared. */
static const double sure_se = 2.0;

const char *verdict_code_id(enum verdict_code code)
{
    static const char *const id[] = {[VERDICT_NONE] = "none",
                                     [VERDICT_GOOD] = "good",
                                     [VERDICT_USABLE] = "usable",
                                     [VERDICT_DOES_NOT_DESCRIBE] = "does_not_describe_this_cloth"};
    return id[code];
}

const char *verdict_code_words(enum verdict_code code)
{
    static const char *const words[] = {[VERDICT_NONE] = "none",
                                        [VERDICT_GOOD] = "good",
                                        [VERDICT_USABLE] = "usable with reservations",
                                        [VERDICT_DOES_NOT_DESCRIBE] = "does not describe this cloth"};
    return words[code];
}

const char *verdict_rows_id(enum verdict_rows rows)
{
    static const char *const id[] = {
        [VERDICT_HELD_OUT] = "held_out", [VERDICT_LEFT_OUT] = "cross_validation", [VERDICT_FITTED] = "fitted"};
    return id[rows];
}

/* ---- the error that the measurements allow ---- */

static bool counts(const struct observation *o, enum job_set set)
{
    return o->set == set && o->weight > 0.0 && !observation_is_contrast(o);
}

double verdict_allowed_error(const struct observation_set *o, enum job_set set)
{
    double sum = 0.0, n = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        const struct observation *row = &o->item[i];
        if (!counts(row, set)) continue;
        for (int c = 0; c < 3; c++)
            sum += row->se_rgb[c] * row->se_rgb[c] * objective_relative_weight(row) +
                   VERDICT_LEAST_ERROR * VERDICT_LEAST_ERROR;
        n += 3.0;
    }
    return n > 0.0 ? sqrt(sum / n) : NAN;
}

double verdict_one_color_error(const struct observation_set *o, enum job_set judged)
{
    double color[3] = {0.0, 0.0, 0.0}, weight = 0.0, sum = 0.0, n = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        if (!counts(&o->item[i], JOB_SET_FIT)) continue;
        double w = objective_relative_weight(&o->item[i]);
        for (int c = 0; c < 3; c++) color[c] += w * o->item[i].mean_rgb[c];
        weight += w;
    }
    for (int c = 0; c < 3; c++) color[c] /= weight;
    for (size_t i = 0; i < o->n; i++) {
        if (!counts(&o->item[i], judged)) continue;
        sum += objective_relative_weight(&o->item[i]) * objective_image_difference(color, o->item[i].mean_rgb);
        n += 3.0;
    }
    return weight > 0.0 && n > 0.0 ? sqrt(sum / n) : NAN;
}

/* ---- reservations ---- */

static void reserve(struct verdict *v, const char *code, const char *format, ...) __attribute__((format(printf, 3, 4)));

static void reserve(struct verdict *v, const char *code, const char *format, ...)
{
    va_list list;
    if (v->n_reservation == VERDICT_MAX_RESERVATION) return;
    struct verdict_reservation *r = &v->reservation[v->n_reservation++];
    r->code = code;
    va_start(list, format);
    vsnprintf(r->text, sizeof r->text, format, list);
    va_end(list);
}

static const char *rows_words(enum verdict_rows rows)
{
    return rows == VERDICT_HELD_OUT   ? "the held-out rows"
           : rows == VERDICT_LEFT_OUT ? "fitted rows left out in turn"
                                      : "the fitted rows";
}

static double sure_error(const struct verdict_facts *f)
{
    return f->error - (isfinite(f->error_se) ? sure_se * f->error_se : 0.0);
}

/* An error that is not a number is above everything. */
static bool above(double error, double limit) { return !(error <= limit); }

static void reserve_error(const struct verdict_facts *f, struct verdict *v)
{
    const double error = sure_error(f), percent = 100.0;
    if (above(error, VERDICT_NEAR * f->allowed))
        reserve(v, "error_beyond_noise",
                "The error over %s is %.3g %%, %.3g times what the measurements allow (%.2g %%).", rows_words(f->rows),
                percent * f->error, f->error / f->allowed, percent * f->allowed);
    if (isfinite(f->one_color_error) && above(error, f->one_color_error))
        reserve(v, "worse_than_one_color", "One color for all rows predicts %s better (%.3g %%) than this fit.",
                rows_words(f->rows), percent * f->one_color_error);
    if (isfinite(f->plain_brdf_error) && above(error, f->plain_brdf_error))
        reserve(v, "worse_than_plain_brdf",
                "A plain BRDF that knows nothing of the cloth predicts %s better (%.3g %%) than this fit (%.3g %%).",
                rows_words(f->rows), percent * f->plain_brdf_error, percent * f->error);
    if (f->rows != VERDICT_HELD_OUT)
        reserve(v, "no_held_out_rows", "No rows were held out, so the error is that of %s.",
                f->rows == VERDICT_LEFT_OUT ? "fitted rows left out in turn" : "the rows that were fitted");
}

static void reserve_fit(const struct verdict_facts *f, struct verdict *v)
{
    if (!f->converged) reserve(v, "not_converged", "The fit has not converged.");
    if (!f->derivatives_right)
        reserve(v, "derivatives_wrong", "The gradient certificate failed: the standard errors are not to be trusted.");
    if (f->several_solutions)
        reserve(v, "several_solutions", "Other parameters describe the fitted rows as well as these.");
    if (f->not_determined[0] != '\0')
        reserve(v, "parameters_not_determined", "The measurements do not determine %s.", f->not_determined);
    if (f->at_bound[0] != '\0') reserve(v, "parameters_at_bound", "At the edge of the allowed range: %s.", f->at_bound);
}

static void reserve_lines(const struct scan_grade *g, struct verdict *v)
{
    const struct scan_coverage *c = &g->coverage;
    if (g->faults & GRADE_UNEXPLAINED)
        reserve(v, "material_unexplained",
                "No traced fiber explains %.0f %% of the material (density about %.2f of the densest), most of it near "
                "slices x %zu, y %zu, z %zu.",
                100.0 * (1.0 - c->explained_share), c->unexplained_density, c->slice[0], c->slice[1], c->slice[2]);
    if (g->faults & GRADE_PARTICLES)
        reserve(v, "lines_are_particles", "%.0f %% of the traced length may be particles in place of fibers.",
                100.0 * g->likeness.particle_share);
    if (g->faults & GRADE_DOUBLED)
        reserve(v, "lines_within_fibers", "%.0f %% of the traced length lies within another traced fiber.",
                100.0 * g->double_share);
    if (g->faults & GRADE_SEVERAL)
        reserve(v, "lines_hold_several_fibers",
                "The traced lines do not have the sections of single fibers: each may hold several, or a yarn.");
    if (g->faults & GRADE_PIECES)
        reserve(v, "fibers_in_pieces", "Fibers are traced in about %.1f pieces each.", g->likeness.fragments);
}

static void reserve_input(const struct verdict_facts *f, struct verdict *v)
{
    const double share = 100.0 * f->scan_safe_share;
    if (f->scan == VERDICT_SCAN_UNRESOLVED)
        reserve(v, "scan_not_resolved",
                "The scan does not show single fibers: %.0f %% of the traced length is sure, the rest is invented.",
                share);
    if (f->scan == VERDICT_SCAN_PARTLY)
        reserve(v, "scan_partly_resolved", "The scan shows single fibers in part: %.0f %% of the length is sure.",
                share);
    if (f->grade != NULL) reserve_lines(f->grade, v);
    if (f->n_input_warning > 0)
        reserve(v, "input_warnings", "%zu warning%s about the input and its geometry; see the warnings.",
                f->n_input_warning, f->n_input_warning == 1 ? "" : "s");
}

/* ---- the verdict ---- */

static bool does_not_describe(const struct verdict_facts *f)
{
    const double error = sure_error(f);
    if (!f->has_fit)
        return f->scan == VERDICT_SCAN_UNRESOLVED || (f->grade != NULL && f->grade->score < GRADE_LEAST_SCORE);
    if (above(error, VERDICT_FAR * f->allowed)) return true;
    if (isfinite(f->one_color_error) && above(error, f->one_color_error)) return true;
    return isfinite(f->plain_brdf_error) && above(error, VERDICT_NEAR * f->allowed) &&
           above(error, VERDICT_PLAIN_BRDF_FACTOR * f->plain_brdf_error);
}

static void put_text(const struct verdict_facts *f, struct verdict *v)
{
    static const char *const of_scan[] = {
        [VERDICT_GOOD] = "The scan shows single fibers, and they explain its material.",
        [VERDICT_USABLE] = "The traced fibers can be used with reservations.",
        [VERDICT_DOES_NOT_DESCRIBE] = "The traced fibers do not describe this cloth.",
    };
    static const char *const of_fit[] = {
        [VERDICT_GOOD] = "The fit describes this cloth",
        [VERDICT_USABLE] = "The fit can be used with reservations",
        [VERDICT_DOES_NOT_DESCRIBE] = "The fit does not describe this cloth",
    };
    if (!f->has_fit)
        snprintf(v->text, sizeof v->text, "%s", of_scan[v->code]);
    else
        snprintf(v->text, sizeof v->text,
                 "%s: over %s the relative RMS error is %.3g +- %.1g %%, where the measurements allow %.2g %%.",
                 of_fit[v->code], rows_words(f->rows), 100.0 * f->error, 100.0 * f->error_se, 100.0 * f->allowed);
}

void verdict_reach(const struct verdict_facts *f, struct verdict *v)
{
    *v = (struct verdict){.rows = f->rows,
                          .error = NAN,
                          .error_se = NAN,
                          .allowed = NAN,
                          .one_color_error = NAN,
                          .plain_brdf_error = NAN};
    if (!f->has_fit && f->scan == VERDICT_NO_SCAN) {
        snprintf(v->text, sizeof v->text, "There is nothing to judge: the job has neither measurements nor a scan.");
        return;
    }
    if (f->has_fit) {
        v->error = f->error;
        v->error_se = f->error_se;
        v->allowed = f->allowed;
        v->one_color_error = f->one_color_error;
        v->plain_brdf_error = f->plain_brdf_error;
        reserve_error(f, v);
        reserve_fit(f, v);
    }
    reserve_input(f, v);
    v->code = does_not_describe(f) ? VERDICT_DOES_NOT_DESCRIBE : v->n_reservation > 0 ? VERDICT_USABLE : VERDICT_GOOD;
    put_text(f, v);
}

json_t *verdict_json(const struct verdict *v)
{
    if (v->code == VERDICT_NONE) return json_null();
    const char *rows = isfinite(v->error) || isfinite(v->allowed) ? verdict_rows_id(v->rows) : NULL;
    json_t *list = json_array();
    for (size_t i = 0; i < v->n_reservation; i++)
        json_array_append_new(list,
                              json_pack("{s:s, s:s}", "code", v->reservation[i].code, "text", v->reservation[i].text));
    return json_pack("{s:s, s:s, s:s, s:s?, s:o, s:o, s:o, s:o, s:o, s:o}", "code", verdict_code_id(v->code), "words",
                     verdict_code_words(v->code), "text", v->text, "judged_by", rows, "rel_rms", json_number(v->error),
                     "rel_rms_se", json_number(v->error_se), "allowed_rel_rms", json_number(v->allowed),
                     "one_color_rel_rms", json_number(v->one_color_error), "plain_brdf_rel_rms",
                     json_number(v->plain_brdf_error), "reservations", list);
}
