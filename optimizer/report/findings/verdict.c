#include "optimizer/report/findings/verdict.h"
#include "base/percent_words.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/job/document/json_number.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

/* Standard errors of the error that are subtracted before it is compared. */
static const double sure_se = 2.0;

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

/* Adds a reservation with which the verdict is `at_best`. */
static void reserve(struct verdict *v, enum verdict_code at_best, const char *code, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

static void reserve(struct verdict *v, enum verdict_code at_best, const char *code, const char *format, ...)
{
    va_list list;
    if (v->code < at_best) v->code = at_best;
    if (v->n_reservation == VERDICT_MAX_RESERVATION) return;
    struct verdict_reservation *r = &v->reservation[v->n_reservation++];
    r->code = code;
    va_start(list, format);
    vsnprintf(r->text, sizeof r->text, format, list);
    va_end(list);
}

static const char *rows_words(const struct verdict_facts *f)
{
    return f->kind == VERDICT_OF_PROFILE ? "the profile"
           : f->rows == VERDICT_HELD_OUT ? "the held-out rows"
           : f->rows == VERDICT_LEFT_OUT ? "fitted rows left out one after another"
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
        reserve(v, VERDICT_PICTURES_ONLY, "error_beyond_noise",
                "The error over %s is %.3g %%, %.3g times what the measurements allow (%.2g %%).", rows_words(f),
                percent * f->error, f->error / f->allowed, percent * f->allowed);
    else if (f->stated_multiple > VERDICT_NEAR && above(error, VERDICT_LEAST_ERROR))
        reserve(v, VERDICT_PICTURES_ONLY, "error_beyond_noise",
                "The residual of %s (%.3g %%) is %.3g times the errors that it states.", rows_words(f),
                percent * f->error, f->stated_multiple);
    if (isfinite(f->one_color_error) && above(error, f->one_color_error))
        reserve(v, VERDICT_DOES_NOT_DESCRIBE, "worse_than_one_color",
                "One color for all rows predicts %s better (%.3g %%) than this fit.", rows_words(f),
                percent * f->one_color_error);
    if (isfinite(f->plain_brdf_error) && above(f->error, f->plain_brdf_error))
        reserve(v, VERDICT_PICTURES_ONLY, "worse_than_plain_brdf",
                "A plain BRDF that knows nothing of the cloth predicts %s better (%.3g %%) than this fit (%.3g %%).",
                rows_words(f), percent * f->plain_brdf_error, percent * f->error);
    if (f->kind == VERDICT_OF_FIT && f->rows != VERDICT_HELD_OUT)
        reserve(v, f->rows == VERDICT_LEFT_OUT ? VERDICT_GOOD : VERDICT_PICTURES_ONLY, "no_held_out_rows",
                "No rows were held out, so the error is that of %s.",
                f->rows == VERDICT_LEFT_OUT ? rows_words(f) : "the rows that were fitted");
}

static void reserve_fit(const struct verdict_facts *f, struct verdict *v)
{
    if (!f->converged) reserve(v, VERDICT_PICTURES_ONLY, "not_converged", "The fit has not converged.");
    if (!f->derivatives_right)
        reserve(v, VERDICT_PICTURES_ONLY, "derivatives_wrong",
                "The gradient certificate failed: the standard errors are not to be trusted.");
    if (f->several_solutions)
        reserve(v, VERDICT_PICTURES_ONLY, "several_solutions",
                "Other parameters describe the fitted rows as well as these.");
    if (f->not_determined[0] != '\0')
        reserve(v, VERDICT_GOOD_BUT_UNDETERMINED, "parameters_not_determined", "The measurements do not determine %s.",
                f->not_determined);
    if (f->at_bound[0] != '\0')
        reserve(v, VERDICT_GOOD_BUT_UNDETERMINED, "parameters_at_bound", "At the edge of the allowed range: %s.",
                f->at_bound);
}

static void reserve_lines(const struct scan_grade *g, struct verdict *v)
{
    const struct scan_coverage *c = &g->coverage;
    if (g->faults & GRADE_UNEXPLAINED)
        reserve(
            v, VERDICT_PICTURES_ONLY, "material_unexplained",
            "No traced fiber explains %.0f %% of the material (density about %.2f of the densest%s), most of it near "
            "slices x %zu, y %zu, z %zu.",
            100.0 * (1.0 - c->explained_share), c->unexplained_density,
            scan_coverage_has_particles(c) ? "; mostly compact, as particles are" : "", c->slice[0], c->slice[1],
            c->slice[2]);
    if (g->faults & GRADE_PARTICLES)
        reserve(v, VERDICT_PICTURES_ONLY, "lines_are_particles",
                "%.0f %% of the traced length may be particles in place of fibers.",
                100.0 * g->likeness.particle_share);
    if (g->faults & GRADE_DOUBLED)
        reserve(v, VERDICT_PICTURES_ONLY, "lines_within_fibers",
                "%.0f %% of the traced length lies within another traced fiber.", 100.0 * g->double_share);
    if (g->faults & GRADE_SEVERAL)
        reserve(v, VERDICT_PICTURES_ONLY, "lines_hold_several_fibers",
                "Traced lines do not have the sections of single fibers: they hold several, or a yarn.");
    if (g->faults & GRADE_PIECES)
        reserve(v, VERDICT_PICTURES_ONLY, "fibers_in_pieces", "Fibers are traced in about %.1f pieces each.",
                g->likeness.fragments);
}

static void reserve_input(const struct verdict_facts *f, struct verdict *v)
{
    const double share = 100.0 * f->scan_safe_share;
    if (f->scan == VERDICT_SCAN_UNRESOLVED)
        reserve(v, VERDICT_PICTURES_ONLY, "scan_not_resolved",
                "The scan does not show single fibers: %.0f %% of the traced length is sure, the rest is invented.",
                share);
    if (f->scan == VERDICT_SCAN_PARTLY)
        reserve(v, VERDICT_PICTURES_ONLY, "scan_partly_resolved",
                "The scan shows single fibers in part: %.0f %% of the length is sure.", share);
    if (f->grade != NULL) reserve_lines(f->grade, v);
    if (f->n_input_warning > 0)
        reserve(v, VERDICT_PICTURES_ONLY, "input_warnings",
                "%zu warning%s about the input and its geometry; see the warnings.", f->n_input_warning,
                f->n_input_warning == 1 ? "" : "s");
}

/* ---- the verdict ---- */

static bool has_fit(const struct verdict_facts *f)
{
    return f->kind == VERDICT_OF_FIT || f->kind == VERDICT_OF_PROFILE;
}

static bool does_not_describe(const struct verdict_facts *f)
{
    const double error = sure_error(f);
    if (!has_fit(f))
        return f->scan == VERDICT_SCAN_UNRESOLVED || (f->grade != NULL && f->grade->score < GRADE_LEAST_SCORE);
    if (above(error, VERDICT_FAR * f->allowed)) return true;
    return isfinite(f->plain_brdf_error) && above(error, VERDICT_NEAR * f->allowed) &&
           above(error, VERDICT_PLAIN_BRDF_FACTOR * f->plain_brdf_error);
}

/* One sentence for a result without a fit. */
static const char *text_without_fit(const struct verdict *v)
{
    static const char *const of_scan[] = {
        [VERDICT_GOOD] = "The scan shows single fibers, and they explain its material.",
        [VERDICT_PICTURES_ONLY] = "The traced fibers can be shown in pictures; do not quote numbers of them.",
        [VERDICT_DOES_NOT_DESCRIBE] = "The traced fibers do not describe this cloth.",
    };
    if (v->kind == VERDICT_OF_PICTURES && v->code == VERDICT_PICTURES_ONLY)
        return "The pictures show given parameters, which no measurement of this job has tested.";
    return of_scan[v->code];
}

/* The begin of the sentence about a fit. */
static void put_finding(const struct verdict_facts *f, const struct verdict *v, char *out, size_t n_out)
{
    const char *of = f->kind == VERDICT_OF_PROFILE ? "fiber" : "cloth";
    if (v->code == VERDICT_DOES_NOT_DESCRIBE)
        snprintf(out, n_out, "The fit does not describe this %s", of);
    else if (v->code == VERDICT_PICTURES_ONLY)
        snprintf(out, n_out, "The fit may be used for pictures, but its parameters are not to be quoted");
    else if (v->code == VERDICT_GOOD_BUT_UNDETERMINED)
        snprintf(out, n_out, "The fit describes this %s, but the measurements do not determine %s", of,
                 f->undetermined);
    else
        snprintf(out, n_out, "The fit describes this %s", of);
}

static void put_text(const struct verdict_facts *f, struct verdict *v)
{
    char finding[VERDICT_TEXT_BYTES - 160], error[PERCENT_WORDS_BYTES];
    if (!has_fit(f)) {
        snprintf(v->text, sizeof v->text, "%s", text_without_fit(v));
        return;
    }
    put_finding(f, v, finding, sizeof finding);
    percent_words(f->error, f->error_se, error);
    snprintf(v->text, sizeof v->text, "%s: over %s the relative RMS error is %s, where the measurements allow %.2g %%.",
             finding, rows_words(f), error, 100.0 * f->allowed);
}

static void put_words(const struct verdict_facts *f, struct verdict *v)
{
    const size_t n = f->n_undetermined;
    if (v->code == VERDICT_GOOD_BUT_UNDETERMINED)
        snprintf(v->words, sizeof v->words, "good, but %zu parameter%s undetermined", n, n == 1 ? " is" : "s are");
    else if (v->code == VERDICT_DOES_NOT_DESCRIBE && f->kind == VERDICT_OF_PROFILE)
        snprintf(v->words, sizeof v->words, "does not describe this fiber");
    else
        snprintf(v->words, sizeof v->words, "%s", verdict_code_words(v->code));
}

void verdict_reach(const struct verdict_facts *f, struct verdict *v)
{
    *v = (struct verdict){.code = VERDICT_GOOD,
                          .kind = f->kind,
                          .rows = f->rows,
                          .error = NAN,
                          .error_se = NAN,
                          .allowed = NAN,
                          .one_color_error = NAN,
                          .plain_brdf_error = NAN};
    if (f->kind == VERDICT_OF_GEOMETRY && f->scan == VERDICT_NO_SCAN) {
        v->code = VERDICT_NONE;
        snprintf(v->text, sizeof v->text, "There is nothing to judge: the job has neither measurements nor a scan.");
        put_words(f, v);
        return;
    }
    if (has_fit(f)) {
        v->error = f->error;
        v->error_se = f->error_se;
        v->allowed = f->allowed;
        v->one_color_error = f->one_color_error;
        v->plain_brdf_error = f->plain_brdf_error;
        reserve_error(f, v);
        reserve_fit(f, v);
    }
    if (f->kind == VERDICT_OF_PICTURES)
        reserve(v, VERDICT_PICTURES_ONLY, "no_measurements", "The parameters were given, and nothing was measured.");
    reserve_input(f, v);
    if (does_not_describe(f)) v->code = VERDICT_DOES_NOT_DESCRIBE;
    put_words(f, v);
    put_text(f, v);
}

json_t *verdict_json(const struct verdict *v)
{
    if (v->code == VERDICT_NONE) return json_null();
    const bool fitted = v->kind == VERDICT_OF_FIT || v->kind == VERDICT_OF_PROFILE;
    const char *rows = fitted ? verdict_rows_id(v->rows) : NULL;
    json_t *list = json_array();
    for (size_t i = 0; i < v->n_reservation; i++)
        json_array_append_new(list,
                              json_pack("{s:s, s:s}", "code", v->reservation[i].code, "text", v->reservation[i].text));
    return json_pack("{s:s, s:s, s:s, s:s?, s:o, s:o, s:o, s:o, s:o, s:o}", "code", verdict_code_id(v->code), "words",
                     v->words, "text", v->text, "judged_by", rows, "rel_rms", json_number(v->error), "rel_rms_se",
                     json_number(v->error_se), "allowed_rel_rms", json_number(v->allowed), "one_color_rel_rms",
                     json_number(v->one_color_error), "plain_brdf_rel_rms", json_number(v->plain_brdf_error),
                     "reservations", list);
}
