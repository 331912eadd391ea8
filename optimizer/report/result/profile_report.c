#include "optimizer/report/result/profile_report.h"
#include "base/angle.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/result_json.h"

#include <math.h>
#include <stdlib.h>

static json_t *model_json(const struct report *report, size_t i)
{
    const struct pipeline_model *m = &report->model[i];
    const struct profile_fit *f = &m->fit->profile;
    json_t *json = json_pack("{s:s, s:s, s:b, s:o, s:o, s:o, s:b}", "id", m->setup->appearance.id, "title",
                             m->setup->appearance.title, "best", (int)(i == report_best_model(report)), "parameters",
                             result_parameters_json(m), "scale", json_number(f->scale), "scale_se",
                             json_number(f->scale_se), "scale_fitted", (int)isnan(report->in.profile->scale));
    if (f->has_turn) {
        json_object_set_new(json, "turn_deg", json_number(angle_to_deg(f->turn_rad)));
        json_object_set_new(json, "turn_se_deg", json_number(angle_to_deg(f->turn_se_rad)));
        json_object_set_new(json, "turn_fitted", json_boolean(isnan(report->in.profile->turn_deg)));
        json_object_set_new(json, "turn_determined", json_boolean(f->turn_determined));
    }
    json_object_set_new(json, "nrmse", json_number(f->nrmse));
    json_object_set_new(json, "rel_rms", json_number(f->rel_rms));
    json_object_set_new(json, "misfit", json_number(f->misfit));
    json_object_set_new(json, "chi_square", json_number(f->chi_square));
    json_object_set_new(json, "bic", json_number(f->bic));
    json_object_set_new(json, "n_unknown", json_count(f->n_free));
    json_object_set_new(json, "n_start", json_count(f->n_start));
    json_object_set_new(json, "n_agree", json_count(f->n_agree));
    json_object_set_new(json, "n_evaluation", json_count(f->n_evaluation));
    json_object_set_new(json, "converged", json_boolean(f->converged));
    json_object_set_new(json, "fit_wall_s", json_number(f->wall_s));
    return json;
}

static json_t *table_json(const struct report *report)
{
    const struct fiber_profile *p = &report->in.fiber->profile;
    double range[4][2] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}, {INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
    for (size_t i = 0; i < p->n; i++) {
        const double angle[4] = {p->row[i].theta_i_rad, p->row[i].theta_o_rad, p->row[i].phi_rad, p->row[i].phi_i_rad};
        for (int k = 0; k < 4; k++) {
            range[k][0] = fmin(range[k][0], angle_to_deg(angle[k]));
            range[k][1] = fmax(range[k][1], angle_to_deg(angle[k]));
        }
    }
    json_t *json = json_pack("{s:s, s:o, s:o, s:b, s:o, s:o, s:o}", "file", job_profile_name(report->in.profile),
                             "n_row", json_count(p->n), "n_channel", json_count(p->n_channel), "has_errors",
                             (int)p->has_se, "theta_i_deg", json_number_list(range[0], 2, 1.0), "theta_o_deg",
                             json_number_list(range[1], 2, 1.0), "phi_deg", json_number_list(range[2], 2, 1.0));
    if (p->has_phi_i) json_object_set_new(json, "phi_i_deg", json_number_list(range[3], 2, 1.0));
    const char *mode = job_profile_mode(report->in.profile);
    if (mode != NULL) json_object_set_new(json, "mode", json_string(mode));
    return json;
}

/* Returns the steps from the photographs of a bowl to the table; NULL without photographs. */
static json_t *bowl_json(const struct report *report)
{
    const struct job_bowl *b = &report->in.profile->bowl;
    const struct bowl_record *r = &report->in.fiber->bowl;
    json_t *shots = json_array();
    for (size_t i = 0; i < r->n_shot; i++) {
        const struct bowl_shot *s = &r->shot[i];
        json_array_append_new(shots, json_pack("{s:s, s:o, s:o, s:o, s:o, s:o}", "file", b->photograph[i].picture.file,
                                               "n_pixel", json_count(s->n_pixel), "n_saturated",
                                               json_count(s->n_saturated), "n_cell", json_count(s->n_cell),
                                               "background_share", json_number(s->background / s->mean),
                                               "reflected_share", json_number(s->reflected / s->mean)));
    }
    return json_pack("{s:o, s:o, s:o, s:o}", "camera_mm", json_number_list(r->camera.position_mm, 3, 1.0), "focal_px",
                     json_number(r->camera.focal_px), "marks_rms_px", json_number(r->camera.rms_px), "photographs",
                     shots);
}

static json_t *profile_json(const struct report *report)
{
    json_t *models = json_array();
    for (size_t i = 0; i < report->n_model; i++) json_array_append_new(models, model_json(report, i));
    json_t *json = json_pack("{s:o, s:s, s:s, s:o}", "table", table_json(report), "chosen_by", "bic", "csv",
                             "profile.csv", "models", models);
    if (report->in.profile->bowl.given) json_object_set_new(json, "bowl", bowl_json(report));
    return json;
}

status profile_json_write(struct report *report, struct error *err)
{
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    json_t *json =
        json_pack("{s:i, s:s, s:s, s:n, s:o, s:[], s:[], s:I, s:o}", "format", 1, "sample", report->in.sample, "model",
                  m->setup->appearance.id, "method", "parameters", result_parameters_json(m), "rows", "models", "seed",
                  (json_int_t)report->in.job->seed, "profile", profile_json(report));
    return result_json_finish(report, json, err);
}

status profile_csv_write(const struct report *report, struct error *err)
{
    const struct fiber_profile *p = &report->in.fiber->profile;
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    FILE *out = open_memstream(&text, &n);
    if (out == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the profile: out of memory");
    fprintf(out, "theta_i_deg,%stheta_o_deg,phi_deg,channel,radiance", p->has_phi_i ? "phi_i_deg," : "");
    for (size_t i = 0; i < report->n_model; i++) fprintf(out, ",%s", report->model[i].setup->appearance.id);
    fputs("\n", out);
    for (size_t k = 0; k < p->n * p->n_channel; k++) {
        const struct profile_row *row = &p->row[k / p->n_channel];
        fprintf(out, "%.6g,", angle_to_deg(row->theta_i_rad));
        if (p->has_phi_i) fprintf(out, "%.6g,", angle_to_deg(row->phi_i_rad));
        fprintf(out, "%.6g,%.6g,%s,%.9g", angle_to_deg(row->theta_o_rad), angle_to_deg(row->phi_rad),
                p->n_channel == 1 ? "grey" : (const char *[]){"r", "g", "b"}[k % 3], row->radiance[k % p->n_channel]);
        for (size_t i = 0; i < report->n_model; i++) fprintf(out, ",%.9g", report->model[i].fit->profile.value[k]);
        fputs("\n", out);
    }
    fclose(out);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "profile.csv", path);
    status s = worker_folder_replace(report->in.job->tools->folder, path, text, n, err);
    free(text);
    return s;
}

void profile_print(const struct report *report, size_t i, FILE *out)
{
    const struct pipeline_model *m = &report->model[i];
    const struct profile_fit *f = &m->fit->profile;
    fprintf(out, "model    %s (%s)%s, fitted to the profile of a fiber\n", m->setup->appearance.id,
            m->setup->appearance.title, report->n_model > 1 && i == report_best_model(report) ? ", the best" : "");
    fputs("residual ", out);
    if (isfinite(f->nrmse)) fprintf(out, "%.2f %% of the range of %zu radiances; ", 100.0 * f->nrmse, f->n_value);
    fprintf(out, "relative %.2f %%", 100.0 * f->rel_rms);
    if (isfinite(f->chi_square)) fprintf(out, "; %.3g times the stated variance", f->chi_square);
    fprintf(out, "\nscale    %.5g", f->scale);
    if (f->scale_se > 0.0) fprintf(out, " +- %.2g", f->scale_se);
    if (f->has_turn) fprintf(out, "\nturn     %.4g degrees", angle_to_deg(f->turn_rad));
    if (f->has_turn && f->turn_se_rad > 0.0) fprintf(out, " +- %.2g", angle_to_deg(f->turn_se_rad));
    fprintf(out, "\nstarts   %zu of %zu came to this result%s\n", f->n_agree, f->n_start,
            f->converged ? "" : "; the steps ended before the residual was at its least");
}
