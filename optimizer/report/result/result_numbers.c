#include "optimizer/report/result/result_numbers.h"
#include "base/catalogue/correction_numbers.h"
#include "optimizer/job/document/json_number.h"

#include <math.h>

/* The bound at which number k ended, "lower" or "upper"; NULL for none. */
static const char *at_bound(const struct report *report, const struct pipeline_model *m, size_t k)
{
    const struct uncertainty *u = &m->fit->cloth.joint.uncertainty;
    const struct fit_parameter *range = &report->in.made->number.range[k];
    if (m->fit->cloth.took_screened || !u->at_bound[u->n_param - report->in.made->number.n + k]) return NULL;
    return m->fit->cloth.number[k] - range->lower < range->upper - m->fit->cloth.number[k] ? "lower" : "upper";
}

/* Correlations of unknown p with the scattering parameters (the first n unknowns), or with the numbers. */
static json_t *correlation_json(const struct fit_result *r, size_t p, size_t first, size_t n)
{
    return json_number_list(r->uncertainty.correlation + p * r->uncertainty.n_param + first, n, 1.0);
}

static json_t *number_json(const struct report *report, const struct pipeline_model *m, size_t k)
{
    const struct cloth_number_item *item = &report->in.made->number.item[k];
    const struct fit_parameter *range = &report->in.made->number.range[k];
    const struct fit_result *r = &m->fit->cloth.joint;
    const size_t n = r->uncertainty.n_param - report->in.made->number.n, p = n + k;
    json_t *json =
        json_pack("{s:s, s:s, s:o, s:o, s:f, s:f, s:f, s:s?, s:b}", "name", report->in.made->number.info[k].name,
                  "unit", item->unit, "value", json_number(m->fit->cloth.number[k]), "standard_error",
                  json_number(r->uncertainty.se_param[p]), "lower", range->lower, "upper", range->upper, "start",
                  range->start, "at_bound", at_bound(report, m, k), "determined", (int)r->uncertainty.determined[p]);
    json_object_set_new(
        json, "prior",
        isnan(item->prior_sd) ? json_null() : json_pack("{s:f, s:f}", "mean", item->prior_mean, "sd", item->prior_sd));
    json_object_set_new(json, "correlation_parameters", correlation_json(r, p, 0, n));
    json_object_set_new(json, "correlation_numbers", correlation_json(r, p, n, report->in.made->number.n));
    return json;
}

static json_t *screening_json(const struct report *report, const struct cloth_search_result *r)
{
    json_t *list = json_array();
    for (size_t i = 0; i < r->n_screen; i++) {
        const struct cloth_screened *s = &r->screened[i];
        json_array_append_new(list, json_pack("{s:o, s:o, s:o, s:b}", "values",
                                              json_number_list(s->number, report->in.made->number.n, 1.0), "objective",
                                              json_number(s->objective), "objective_se", json_number(s->objective_se),
                                              "best", (int)(i == r->i_best)));
    }
    return list;
}

/* Returns whether the photographs ask for correction k: it is determined, and two standard errors or more from the
 * value that leaves the fibers as they are. */
static bool asked_for(const struct report *report, const struct pipeline_model *m, size_t k)
{
    const struct uncertainty *u = &m->fit->cloth.joint.uncertainty;
    const size_t p = u->n_param - report->in.made->number.n + k;
    const double off =
        m->fit->cloth.number[k] - correction_number_table[report->in.made->number.item[k].index].standard;
    return !m->fit->cloth.took_screened && u->determined[p] && fabs(off) >= 2.0 * u->se_param[p];
}

/* Decrease of the held-out error by the corrections, and its standard error by tracing. NaN without held-out rows. */
static double heldout_gain(const struct pipeline_model *m, double *se)
{
    const struct uncorrected_errors *u = &m->fit->scan_error.uncorrected;
    *se = hypot(u->heldout_rel_rms_se, m->validation->held_out.rel_rms_se);
    return u->heldout_rel_rms - m->validation->held_out.rel_rms;
}

static json_t *uncorrected_json(const struct report *report, const struct pipeline_model *m)
{
    const struct uncorrected_errors *u = &m->fit->scan_error.uncorrected;
    json_t *asked = json_array();
    double se, gain = heldout_gain(m, &se);
    for (size_t k = 0; k < report->in.made->number.n; k++)
        if (asked_for(report, m, k)) json_array_append_new(asked, json_string(report->in.made->number.info[k].name));
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "fit_rel_rms", json_number(u->fit_rel_rms), "heldout_rel_rms",
                     json_number(u->heldout_rel_rms), "heldout_rel_rms_se", json_number(u->heldout_rel_rms_se),
                     "heldout_gain", json_number(gain), "heldout_gain_se", json_number(se), "asked_for", asked);
}

void result_numbers_put(json_t *json, const struct report *report, const struct pipeline_model *m)
{
    if (report->in.made->number.n == 0) return;
    json_t *list = json_array();
    for (size_t k = 0; k < report->in.made->number.n; k++) json_array_append_new(list, number_json(report, m, k));
    json_object_set_new(json, "cloth_numbers", list);
    if (m->fit->scan_error.uncorrected.measured)
        json_object_set_new(json, "without_corrections", uncorrected_json(report, m));
    json_object_set_new(json, "cloth_screening", screening_json(report, &m->fit->cloth));
}

/* The corrections by the photographs, and the gain by them. */
static void print_uncorrected(const struct report *report, const struct pipeline_model *m, FILE *out)
{
    const struct uncorrected_errors *u = &m->fit->scan_error.uncorrected;
    double se, gain = heldout_gain(m, &se);
    size_t n_asked = 0;
    if (!u->measured) return;
    for (size_t k = 0; k < report->in.made->number.n; k++)
        if (asked_for(report, m, k))
            fprintf(out, "%s%s", n_asked++ == 0 ? "         the photographs ask for " : ", ",
                    report->in.made->number.info[k].name);
    fputs(n_asked > 0 ? "\n" : "         the photographs ask for none of these corrections\n", out);
    if (isfinite(gain))
        fprintf(out, "         the corrections %s the held-out error by %.4f +- %.4f%s\n",
                gain < 0.0 ? "raise" : "lower", fabs(gain), se, gain < 2.0 * se ? ": not worth keeping" : "");
    fprintf(out, "         without these corrections: relative RMS error %.4f fitted", u->fit_rel_rms);
    if (isfinite(u->heldout_rel_rms)) fprintf(out, ", %.4f held out", u->heldout_rel_rms);
    fputs("\n", out);
}

void result_numbers_print(const struct report *report, const struct pipeline_model *m, FILE *out)
{
    const struct fit_result *r = &m->fit->cloth.joint;
    for (size_t k = 0; k < report->in.made->number.n; k++) {
        const size_t p = r->uncertainty.n_param - report->in.made->number.n + k;
        const char *bound = at_bound(report, m, k);
        fprintf(out, "%s %-28s %10.4g +- %-8.2g %s%s%s%s\n", k == 0 ? "cloth   " : "        ",
                report->in.made->number.info[k].name, m->fit->cloth.number[k], r->uncertainty.se_param[p],
                report->in.made->number.item[k].unit,
                r->uncertainty.determined[p] ? "" : " these measurements do not determine it",
                bound != NULL ? " at its bound: " : "", bound != NULL ? bound : "");
    }
    print_uncorrected(report, m, out);
    if (report->in.made->number.n > 0)
        fprintf(out, "         the errors of the parameters contain those of these numbers\n\n");
}
