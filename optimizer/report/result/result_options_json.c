#include "optimizer/report/result/result_options_json.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_number.h"

#include "optimizer/report/findings/findings.h"
#include "optimizer/stages/validation/pipeline_contrast.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"

#include <math.h>
#include <stdio.h>

void result_parameter_options(const struct pipeline_model *m, size_t p, json_t *parameter)
{
    const struct job_fit_option *o = m->setup->option;
    bool tied = o->leader[p] != p;
    json_object_set_new(parameter, "tied_to",
                        tied ? json_string(m->setup->sets.info.param[o->leader[p]].name) : json_null());
    json_object_set_new(parameter, "ratio", tied ? json_real(o->ratio[p]) : json_null());
    json_object_set_new(parameter, "prior",
                        isnan(o->prior_mean[p])
                            ? json_null()
                            : json_pack("{s:f, s:f}", "mean", o->prior_mean[p], "se", o->prior_se[p]));
}

static void row_gain(const struct report *report, const struct pipeline_model *m, size_t i, double *gain, double *se)
{
    struct estimate a, b;
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[0][i], &a);
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[1][i], &b);
    nuisance_photograph_gain(&report->in.job->rows->observation.item[i], &a, &b, m->setup->option->gain_prior_rel,
                             m->fit->result.uncertainty.misfit_var, gain, se);
}

static json_t *rgb_json(const double v[3])
{
    return json_pack("[o, o, o]", json_number(v[0]), json_number(v[1]), json_number(v[2]));
}

static json_t *texture_json(const struct report *report, const struct pipeline_model *m, size_t i)
{
    const struct observation *o = &report->in.job->rows->contrast.item[i];
    double rendered[3], se[3];
    pipeline_rendered_contrast(m->validation, i, rendered, se);
    return json_pack("{s:f, s:I, s:o, s:o, s:o, s:o}", "block_mm",
                     job_texture_cell_mm(report->in.job->setup->crop_cm, report->in.job->fit->texture_block_mm),
                     "blocks_a_side", (json_int_t)o->n_cell, "measured", rgb_json(o->mean_rgb), "measured_se",
                     rgb_json(o->se_rgb), "rendered", rgb_json(rendered), "rendered_se", rgb_json(se));
}

void result_row_options(const struct report *report, const struct pipeline_model *m, size_t i, json_t *row)
{
    double gain = NAN, se = NAN;
    if (m->setup->option->gain == JOB_GAIN_PER_PHOTOGRAPH) row_gain(report, m, i, &gain, &se);
    json_object_set_new(row, "gain", json_number(gain));
    json_object_set_new(row, "gain_se", json_number(se));
    json_object_set_new(row, "texture",
                        report->in.job->rows->contrast.n > 0 ? texture_json(report, m, i) : json_null());
}

static json_t *nuisance_json(const struct fit_nuisance *n)
{
    json_t *list = json_array();
    for (size_t i = 0; i < n->n; i++)
        json_array_append_new(list,
                              json_pack("{s:s, s:o, s:o, s:b}", "name", n->name[i], "value", json_number(n->value[i]),
                                        "standard_error", json_number(n->se[i]), "at_bound", (int)n->at_bound[i]));
    return list;
}

static json_t *values_json(const struct pipeline_model *m, const double *param)
{
    json_t *list = json_array();
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++)
        json_array_append_new(list, json_number(param_to_file_unit(&m->setup->sets.info.param[p], param[p])));
    return list;
}

static json_t *starts_json(const struct pipeline_model *m)
{
    json_t *list = json_array();
    for (size_t k = 0; k < m->fit->result.n_start; k++) {
        const struct fit_start *s = &m->fit->result.start[k];
        json_array_append_new(list,
                              json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:b, s:b, s:b, s:I}", "start",
                                        values_json(m, s->from), "value", values_json(m, s->param), "objective",
                                        json_number(s->objective), "objective_se", json_number(s->objective_se),
                                        "prior_penalty", json_number(s->prior_penalty), "cross_validation_rel_rms",
                                        json_number(s->cross_validation), "converged", (int)s->converged, "kept",
                                        (int)s->kept, "elsewhere", (int)s->elsewhere, "n_path", (json_int_t)s->n_path));
    }
    return list;
}

static json_t *certificate_json(const struct pipeline_model *m)
{
    const struct derivative_check *k = &m->advice->certificate;
    json_t *list = json_array();
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++)
        if (k->checked[p])
            json_array_append_new(list, json_pack("{s:s, s:o, s:o, s:o}", "name", m->setup->sets.info.param[p].name,
                                                  "rel_error", json_number(k->error[p]), "noise",
                                                  json_number(k->noise[p]), "noise_se", json_number(k->noise_se[p])));
    return json_pack("{s:b, s:o, s:o, s:o, s:s, s:I, s:o}", "passed", (int)pipeline_certificate_passed(m),
                     "worst_rel_error", json_number(k->error[k->worst]), "worst_noise", json_number(k->noise[k->worst]),
                     "worst_noise_se", json_number(k->noise_se[k->worst]), "worst_parameter",
                     m->setup->sets.info.param[k->worst].name, "n_path", (json_int_t)k->n_path, "parameters", list);
}

static json_t *candidate_json(const struct report *report, const struct pipeline_model *m, size_t rank)
{
    const struct pipeline_candidate *k = &m->advice->candidate[rank];
    const struct job_candidate *g = &report->in.job->fit->candidate[k->i_candidate];
    json_t *determines = json_array();
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++)
        if (k->score.determines[p]) json_array_append_new(determines, json_string(m->setup->sets.info.param[p].name));
    return json_pack("{s:I, s:f, s:f, s:f, s:f, s:f, s:o, s:o, s:o, s:o}", "candidate", (json_int_t)k->i_candidate,
                     "light_theta_deg", g->light_theta_deg, "light_phi_deg", g->light_phi_deg, "camera_theta_deg",
                     g->camera_theta_deg, "camera_phi_deg", g->camera_phi_deg, "cloth_rotation_deg",
                     g->cloth_rotation_deg, "information_nats", json_number(k->score.information), "misfit_nats",
                     json_number(k->score.misfit_information), "standard_error_after",
                     values_json(m, k->score.se_after), "determines", determines);
}

/* The ranked candidates, best first. */
static json_t *candidates_json(const struct report *report, const struct pipeline_model *m)
{
    json_t *list = json_array();
    for (size_t i = 0; m->advice->candidate != NULL && i < report->in.job->fit->n_candidate; i++)
        json_array_append_new(list, candidate_json(report, m, i));
    return list;
}

void result_fit_options(const struct report *report, const struct pipeline_model *m, json_t *result)
{
    json_object_set_new(result, "prior_penalty", json_number(m->fit->result.prior_penalty));
    json_object_set_new(result, "nuisance", nuisance_json(&m->fit->result.nuisance));
    json_object_set_new(result, "starts", starts_json(m));
    json_object_set_new(result, "next_photograph", candidates_json(report, m));
    json_object_set_new(result, "certificate", certificate_json(m));
    const struct validation *v = m->validation;
    json_object_set_new(result, "fit_rel_rms_with_gains", json_number(v->fit_with_gains.rel_rms));
    json_object_set_new(result, "fit_rel_rms_with_gains_se", json_number(v->fit_with_gains.rel_rms_se));
    json_object_set_new(result, "heldout_rel_rms_with_gains", json_number(v->held_out_with_gains.rel_rms));
    json_object_set_new(result, "heldout_rel_rms_with_gains_se", json_number(v->held_out_with_gains.rel_rms_se));
}

/* Standard deviation of the blocks' means in per cent of their mean, averaged over the channels. */
static double scatter_percent(const double contrast_rgb[3])
{
    return 100.0 * sqrt(fmax(0.0, contrast_rgb[0] + contrast_rgb[1] + contrast_rgb[2]) / 3.0);
}

static void print_textures(const struct report *report, const struct pipeline_model *m, FILE *out)
{
    if (report->in.job->rows->contrast.n == 0) return;
    fprintf(out, "\ntexture: scatter of the means of %.3g mm blocks, per cent of the mean%s\n%-14s %-8s %9s %9s %s\n",
            job_texture_cell_mm(report->in.job->setup->crop_cm, report->in.job->fit->texture_block_mm),
            report->in.job->fit->texture_weight > 0.0 ? "" : " (not fitted: its weight is 0)", "row", "set", "measured",
            "rendered", "+-");
    for (size_t i = 0; i < report->in.job->rows->contrast.n; i++) {
        const struct observation *o = &report->in.job->rows->contrast.item[i];
        double rendered[3], se[3];
        pipeline_rendered_contrast(m->validation, i, rendered, se);
        double shown = scatter_percent(rendered), mean_se = (se[0] + se[1] + se[2]) / 3.0;
        fprintf(out, "%-14.14s %-8s %9.2f %9.2f %.2g\n", o->name, o->set == JOB_SET_FIT ? "fit" : "held-out",
                scatter_percent(o->mean_rgb), shown,
                shown > 0.0 ? 1e4 * mean_se / (2.0 * fmax(shown, 100.0 * sqrt(mean_se))) : 100.0 * sqrt(mean_se));
    }
}

void result_summary_options(const struct report *report, const struct pipeline_model *m, FILE *out)
{
    const struct fit_nuisance *n = &m->fit->result.nuisance;
    const struct derivative_check *check = &m->advice->certificate;
    const struct validation *v = m->validation;
    fprintf(
        out,
        "gradient certificate: the derivatives on this cloth are right to %.1g (noise: %.1g +- %.1g), worst by %s\n",
        check->error[check->worst], check->noise[check->worst], check->noise_se[check->worst],
        m->setup->sets.info.param[check->worst].name);
    if (m->advice->candidate != NULL) {
        const struct job_candidate *best = &report->in.job->fit->candidate[m->advice->candidate[0].i_candidate];
        fprintf(out,
                "next photograph: lamp %.0f (phi %.0f), camera %.0f (phi %.0f), cloth turned by %.0f degrees would add "
                "%.2f nats\n",
                best->light_theta_deg, best->light_phi_deg, best->camera_theta_deg, best->camera_phi_deg,
                best->cloth_rotation_deg, m->advice->candidate[0].score.information);
    }
    for (size_t i = 0; i < n->n; i++)
        fprintf(out, "%-12s %10.5f %10.5f  nuisance term%s\n", n->name[i], n->value[i], n->se[i],
                n->at_bound[i] ? ", at a bound" : "");
    print_textures(report, m, out);
    if (isfinite(v->fit_with_gains.rel_rms))
        fprintf(out, "one gain for each photograph: relative RMS error over the fitted rows with them %.2f %%\n",
                100.0 * v->fit_with_gains.rel_rms);
    if (isfinite(v->held_out_with_gains.rel_rms))
        fprintf(out, "                              over the held-out rows %.2f %%\n",
                100.0 * v->held_out_with_gains.rel_rms);
    for (size_t k = 0; k < m->fit->result.n_start; k++) {
        const struct fit_start *s = &m->fit->result.start[k];
        char left_out[60] = "";
        if (isfinite(s->cross_validation))
            snprintf(left_out, sizeof left_out, ", cross-validation %.2f %%", 100.0 * s->cross_validation);
        fprintf(out, "start %-2zu squared errors %.5g +- %.2g%s%s%s%s\n", k + 1, s->objective, s->objective_se,
                left_out, s->converged ? "" : ", not converged", s->kept ? ", kept" : "",
                s->elsewhere ? ", as good but at other parameters" : "");
    }
}

/* Root mean square of ln factor over the places and channels: how much is left to the factor. */
static double rms_log_factor(const struct discrepancy *d)
{
    double sum = 0.0;
    for (size_t i = 0; i < d->n; i++)
        for (size_t c = 0; c < 3; c++) {
            double log_factor = 0.0;
            for (size_t k = 0; k < d->n; k++)
                log_factor += d->weight[k][c] * discrepancy_kernel(d->scale, d->place[i], d->place[k]);
            sum += log_factor * log_factor;
        }
    return sqrt(sum / (3.0 * (double)d->n));
}

json_t *discrepancy_json(const struct pipeline_model *m)
{
    const struct discrepancy *d = pipeline_discrepancy(m->validation);
    json_t *place = json_array(), *weight = json_array();
    if (d == NULL) {
        json_decref(place);
        json_decref(weight);
        return json_null();
    }
    for (size_t i = 0; i < d->n; i++) {
        json_array_append_new(place, json_number_list(d->place[i], DISCREPANCY_COORDINATES, 1.0));
        json_array_append_new(weight, json_number_list(d->weight[i], 3, 1.0));
    }
    return json_pack("{s:f, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "share",
                     m->fit->result.cross_validation.discrepancy_share, "rms_log_factor",
                     json_number(rms_log_factor(d)), "fit_rel_rms_without",
                     json_number(m->validation->discrepancy.fit_rel_rms), "heldout_rel_rms_without",
                     json_number(m->validation->discrepancy.heldout_rel_rms), "cross_validation_rel_rms_without",
                     json_number(m->fit->result.cross_validation.plain_rel_rms), "scale",
                     json_number_list(d->scale, DISCREPANCY_COORDINATES, 1.0), "place", place, "log_weight", weight);
}
